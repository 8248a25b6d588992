"""Events on shipped profiles: what goes wrong, what the vehicle does then, and what its log says."""

import pytest

import imc
from shoal.scenarios import ScenarioFileError
from tests.shoal.scenarios.conftest import DIVE, SHORT

FAR = DIVE.replace("north: 30", "north: 300").replace("dive\n", "far\n")
SURFACE = FAR.replace("depth: 3 m", "depth: 0 m")


@pytest.fixture
def told(play, tmp_path):
    """Runs the scenario of a text; the result, and the texts of all its log books by vehicle."""

    def told(text, begin=FAR):
        root = tmp_path / f"logs{len(list(tmp_path.iterdir()))}"
        result = play(text, begin, log_root=root)
        assert result.error == ""
        return result, {name: list(texts_of(root / name)) for name in result.logs}

    return told


def texts_of(root):
    """The texts in all logs of a vehicle, which begins one for each plan."""
    for folder in sorted({path.parent for path in root.rglob("Data.lsf*")}):
        yield from (entry.text for entry in imc.Log(folder).messages(imc.LogBookEntry))


def said(texts):
    return [text for text in texts["lauv-noptilus-1"] if text.startswith(("scenario:", "fault of"))]


@pytest.mark.heavy
def test_without_gps_the_uncertainty_of_the_position_grows_and_more_without_dvl(told):
    text = """
    limit: 53 s
    events:
      - {at: 20 s, silent: Simulators.GPS, for: 30 s}
      - {at: 40 s, silent: Simulators.DVL, for: 8 s}
    metrics:
      soon: {min: NavigationUncertainty.x, from: 25 s, to: 40 s}
      later: {last: NavigationUncertainty.x, to: 40 s}
      without both: {last: NavigationUncertainty.x, to: 48 s}
      again: {last: NavigationUncertainty.x}
    """
    result, texts = told(text, SURFACE)
    metrics = result.metrics
    assert metrics["soon"] < metrics["later"]
    assert metrics["without both"] > 2.0 * metrics["later"]
    assert metrics["again"] < metrics["without both"]
    assert said(texts) == [
        "fault of Simulators.GPS: silent, for 30 s",
        "fault of Simulators.DVL: silent, for 8 s",
        "fault of Simulators.DVL ends: silent",
        "fault of Simulators.GPS ends: silent",
    ]


@pytest.mark.heavy
def test_a_servo_that_is_stuck_while_the_vehicle_turns_lets_it_turn_on_until_the_plan_ends(told):
    text = """
    settle: 10 s
    events:
      - {when: abs(SimulatedState.r) > 0.1, stuck: Simulators.Servos}
    expect:
      - {finally: SimulatedState.psi > 120°}
    """
    east = SURFACE.replace("{north: 300, east: 10}", "{north: -20, east: 300}")
    result, texts = told(text, east)
    assert result.outcomes == {"lauv-noptilus-1": "FAILURE"}
    assert result.passed, result.verdicts
    assert said(texts) == ["fault of Simulators.Servos: stuck"]


@pytest.mark.heavy
def test_a_leak_ends_the_plan_in_error(told):
    text = """
    settle: 10 s
    events:
      - {when: EstimatedState.depth > 2, after: 3 s, leak: all, for: 5 s}
    expect:
      - {eventually: VehicleState.op_mode == ERROR}
      - {finally: VehicleState.op_mode == SERVICE}
    """
    result, texts = told(text)
    assert result.outcomes == {"lauv-noptilus-1": "FAILURE"}
    assert result.passed, result.verdicts
    assert said(texts) == ["scenario: leak of all sensors, for 5 s", "scenario: end of the leak of all sensors"]


@pytest.mark.heavy
def test_an_abort_and_a_plan_that_is_stopped(told):
    for event, words in (("abort: true", "scenario: abort"), ("plan: stop", "scenario: plan stop")):
        result, texts = told(f"events: [{{at: 15 s, {event}}}]")
        assert result.outcomes == {"lauv-noptilus-1": "FAILURE"}
        assert 15.0 <= result.seconds < 20.0
        assert said(texts) == [words]


@pytest.mark.heavy
def test_a_plan_that_is_started_again(told):
    text = """
    settle: 10 s
    events:
      - {at: 15 s, plan: stop}
      - {at: 20 s, plan: start}
    expect:
      - {finally: PlanControlState.state == EXECUTING}
    """
    assert told(text)[0].passed


def test_an_empty_battery_ends_the_plan(told):
    result, texts = told("events: [{at: 15 s, drain: 5 %}]\nmetrics: {level: {last: 'FuelLevel[Batteries].value'}}")
    assert result.outcomes == {"lauv-noptilus-1": "FAILURE"}
    assert result.seconds < 45.0
    assert said(texts) == ["scenario: battery drained to 5 %"]


def test_parameters_change_and_change_back(told):
    text = """
    limit: 12 s
    events:
      - {at: 5 s, set: {Simulators.GPS: {HACC: 9}, Simulators.Battery: {Hotel Load: 50}}, for: 4 s}
    metrics:
      before: {last: GpsFix.hacc, to: 5 s}
      then: {last: GpsFix.hacc, to: 8.9 s}
      after: {last: GpsFix.hacc}
    """
    result, texts = told(text, SHORT.replace("otter", "lauv-noptilus-1").replace("limit: 3 s\n", ""))
    metrics = result.metrics
    assert metrics["then"] == 9.0
    assert metrics["before"] == metrics["after"] < 9.0
    assert said(texts)[:2] == [
        "scenario: Simulators.GPS: HACC = 9, for 4 s",
        "scenario: Simulators.Battery: Hotel Load = 50, for 4 s",
    ]
    assert len(said(texts)) == 4


def test_messages_of_others_and_of_the_vehicle(told):
    text = """
    limit: 6 s
    events:
      - at: 3 s
        message: {abbrev: SetEntityParameters, name: GPS, params: [{abbrev: EntityParameter, name: HACC, value: "7"}]}
      - {at: 4 s, message: {abbrev: Temperature, src: lauv-noptilus-1, src_ent: GPS, value: 99e0}}
      - {at: 4 s, message: {abbrev: EulerAngles, src: 0x4002, psi: 90°, dst_ent: GPS}}
    metrics:
      hacc: {last: GpsFix.hacc}
    """
    result, texts = told(text, SHORT.replace("otter", "lauv-noptilus-1").replace("limit: 3 s\n", ""))
    log = imc.Log(result.logs["lauv-noptilus-1"])
    (warm,) = [m for m in log.messages(imc.Temperature) if m.value == 99.0]
    (turn,) = [m for m in log.messages(imc.EulerAngles) if m.src == 0x4002]
    assert (warm.src, warm.src_ent) == (0x1A, turn.dst_ent)
    assert turn.psi == pytest.approx(1.5708, abs=1e-4)
    assert result.metrics["hacc"] == 7.0
    assert said(texts) == [
        f"scenario: message {name}" for name in ("SetEntityParameters", "Temperature", "EulerAngles")
    ]


def test_a_crash_is_an_event_and_the_run_goes_on(told):
    result, texts = told("limit: 8 s\nevents: [{at: 3 s, crash: Simulators.GPS}]", SHORT.replace("limit: 3 s\n", ""))
    assert result.seconds == 8.0
    assert "fault of Simulators.GPS: crash" in texts["otter"]
    assert any("crashed on purpose" in text and "restarting" in text for text in texts["otter"])


def test_an_event_that_does_not_happen_is_reported(play):
    text = """
    events:
      - {when: SimulatedState.z > 50, abort: true}
      - {when: SimulatedState.z < 50, after: 9 s, abort: true}
      - {at: 2 s, abort: true}
    stop when: EstimatedState.x > -50
    """
    told = [text.partition("trial.scenario.")[2] for text in play(text).warnings]
    assert told == [
        "yaml:6: has not happened: SimulatedState.z > 50 did not hold",
        "yaml:7: has not happened: the run ended before 9.02 s",
        "yaml:8: has not happened: the run ended before 2 s",
    ]


@pytest.mark.heavy
def test_the_same_events_give_the_same_run(play):
    text = """
    limit: 16 s
    events:
      - {at: 8 s, noisy: Simulators.GPS, of: GpsFix, field: lon, deviation: 0.0001°}
      - {at: 10 s, crash: Simulators.DVL}
    """
    first = play(text, SURFACE)
    assert first.fingerprint == play(text, SURFACE).fingerprint
    assert first.fingerprint != play(text, SURFACE, seed=5).fingerprint


@pytest.mark.parametrize(
    ("event", "words"),
    [
        ("{at: 1 s}", "expected one of silent"),
        ("{at: 1 s, silnet: Simulators.GPS}", r"\(did you mean 'silent'\?\)"),
        ("{silent: Simulators.GPS}", "has either a time, at: 60 s, or a condition"),
        ("{at: 1 s, when: SimulatedState.z > 1, abort: true}", "has either a time"),
        ("{at: 1 s, after: 3 s, abort: true}", "it needs when"),
        ("{at: 3 s, abort: true}", "is not before the end of the run, at 3 s"),
        ("{at: 1 s, abort: yes please}", "write abort: true"),
        ("{at: 1 s, abort: true, for: 3 s}", "unknown key 'for'"),
        ("{at: 1 s, silent: Simulators.GSP}", "there is no task 'Simulators.GSP' .*'Simulators.GPS'"),
        ("{at: 1 s, silent: Simulators.GPS, of: GpsFx}", "there is no message 'GpsFx' .*'GpsFix'"),
        ("{at: 1 s, biased: Simulators.GPS, of: GpsFix, field: lat}", "'by' is missing"),
        ("{at: 1 s, biased: Simulators.GPS, of: GpsFix, field: lta, by: 1}", "has no field 'lta' .*'lat'"),
        ("{at: 1 s, biased: Simulators.GPS, of: GpsFix, field: lat, by: 1 m}", "should be in °"),
        ("{at: 1 s, noisy: Simulators.GPS, of: GpsFix, field: lat, deviation: -1}", "at least 0"),
        ("{at: 1 s, drain: 300 %}", "from 0 % to 100 %"),
        ("{at: 1 s, plan: start}", "otter has no plan"),
        ("{at: 1 s, plan: begin}", "there is no order 'begin'"),
        ("{at: 1 s, message: {value: 3}}", "'abbrev' is missing"),
        ("{at: 1 s, message: {abbrev: Temprature}}", "did you mean 'Temperature'"),
        ("{at: 1 s, message: {abbrev: Temperature, valeu: 3}}", "did you mean 'value'"),
        ("{at: 1 s, message: {abbrev: Temperature, value: warm}}", "value"),
        ("{at: 1 s, message: {abbrev: Temperature, src: 100000}}", "src"),
        ("{at: 1 s, cut: radio}", "there is no link 'radio'"),
        ("{when: Nothing.z > 3, abort: true}", "Nothing"),
        ("{at: 1 s, vehicle: lauv, abort: true}", "there is no vehicle 'lauv'"),
    ],
)
def test_events_that_cannot_be_read(document, event, words):
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:[56]: .*{words}"):
        document(f"events:\n  - {event}").scenario()


@pytest.mark.parametrize(
    ("event", "words"),
    [
        ("{at: 1 s, leak: Leka Sensor}", "there is no leak sensor 'Leka Sensor'"),
        ("{at: 1 s, set: {Simulators.GSP: {HACC: 3}}}", "there is no task 'Simulators.GSP'"),
        ("{at: 1 s, set: {Simulators.GPS: {HACCC: 3}}}", r"no parameter 'HACCC' \(did you mean 'HACC'\?\)"),
        ("{at: 1 s, set: {Simulators.GPS: {HACC: wide}}}", "Simulators.GPS: HACC: 'wide' is not a number"),
        ("{at: 1 s, message: {abbrev: Temperature, src_ent: GSP}}", "no entity with the label 'GSP'"),
        ("{at: 1 s, message: {abbrev: Temperature, src: nobody}}", "there is no system 'nobody'"),
    ],
)
def test_events_that_the_vehicle_cannot_have_are_reported_before_the_run(document, event, words):
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:5: .*{words}"):
        document(f"events:\n  - {event}", SHORT.replace("otter", "lauv-noptilus-1")).dry_run()


def test_of_overlapping_settings_and_leaks_the_latest_counts_and_nothing_stays(told, tmp_path):
    text = """
    limit: 18 s
    events:
      - {at: 6 s, set: {Simulators.GPS: {HACC: 9}}, for: 4 s}
      - {at: 8 s, set: {Simulators.GPS: {HACC: 7}}, for: 6 s}
      - {at: 6 s, leak: all, for: 4 s}
      - {at: 8 s, leak: Leak Sensor - Tail, for: 6 s}
    metrics:
      first: {last: "GpsFix[GPS].hacc", to: 7.5 s}
      both: {last: "GpsFix[GPS].hacc", to: 9.5 s}
      second: {last: "GpsFix[GPS].hacc", to: 13.5 s}
      after: {last: "GpsFix[GPS].hacc"}
      wet: {last: "EntityState[Leak Sensor - Tail].state", to: 13.5 s}
      dry: {last: "EntityState[Leak Sensor - Nose].state", to: 13.5 s}
      dried: {last: "EntityState[Leak Sensor - Tail].state"}
    """
    metrics = told(text, "vehicle: {profile: lauv-noptilus-1}")[0].metrics
    assert [metrics[name] for name in ("first", "both", "second", "after")] == [9.0, 7.0, 7.0, 2.0]
    assert [metrics[name] for name in ("wet", "dry", "dried")] == [
        imc.EntityState.State.ERROR,
        imc.EntityState.State.NORMAL,
        imc.EntityState.State.NORMAL,
    ]


def test_a_fault_that_changed_nothing_is_reported(play):
    text = """
    limit: 3 s
    events:
      - {at: 1 s, silent: Simulators.GPS, of: Temperature}
      - {at: 1 s, silent: Simulators.GPS, of: GpsFix}
    """
    (warning,) = play(text, "vehicle: {profile: otter}").warnings
    assert warning.endswith("yaml:4: fault of Simulators.GPS: silent, Temperature: this changed nothing")


def test_a_battery_that_has_less_is_not_drained_and_that_is_reported(told):
    begin = "vehicle: {profile: otter, start: {level: 40 %}}\nlimit: 3 s\n"
    result, texts = told("events: [{at: 1 s, drain: 50 %}, {at: 2 s, drain: 30 %}]", begin)
    assert [warning.partition(".yaml:")[2] for warning in result.warnings] == [
        "3: battery not drained to 50 %: it has less"
    ]
    assert [text for text in texts["otter"] if "drained" in text] == [
        "scenario: battery not drained to 50 %: it has less",
        "scenario: battery drained to 30 %",
    ]
