"""Several vehicles, their starts and worlds, and how a run ends, with shipped profiles."""

import math

import pytest

from shoal.scenarios import ScenarioFileError, run

PAIR = """
vehicles:
  first: {profile: lauv-noptilus-1}
  second:
    profile: otter
    seed: 9
    start: {at: "41.186°, -8.7062°", heading: 90°}
limit: 3 s
"""
GOTO = """
    plan: {{origin: "41.185°, -8.7062°", speed: 1 m/s, depth: 0, maneuvers: [goto: {{north: {north}}}]}}
"""


def test_vehicles_share_their_time_and_hear_nothing_of_each_other(play):
    alone = play(
        "metrics: {u: {last: SimulatedState.svx}}", "vehicle: {profile: lauv-noptilus-1, name: first}\nlimit: 3 s\n"
    )
    result = play(
        """
        expect:
          - {name: apart, always: "distance(SimulatedState@first, SimulatedState@second) > 100 m", from: 1 s}
          - {name: deaf, always: SimulatedState.z < 1 m, vehicle: second}
        metrics:
          far: {max: "distance(SimulatedState@first, SimulatedState@second)"}
          u: {last: SimulatedState.svx@first}
        """,
        PAIR,
    )
    assert result.error == ""
    assert result.passed
    assert result.metrics["far"] == pytest.approx(111.0, abs=1.0)
    assert result.metrics["u"] == alone.metrics["u"]


def test_a_vehicle_in_company_has_the_log_that_it_has_alone(play, tmp_path):
    alone = (
        "vehicle: {profile: otter, name: second, seed: 9, start: {at: '41.186°, -8.7062°', heading: 90°}}\nlimit: 3 s\n"
    )
    hashes = play("", alone, log_root=tmp_path / "a").hashes
    both = play("", PAIR, log_root=tmp_path / "b").hashes
    assert both["second"] == hashes["second"]
    assert set(both) == {"first", "second"}


@pytest.mark.heavy
def test_the_run_ends_when_all_plans_are_over_and_settled(play):
    begin = "vehicles:\n" + "".join(
        f"  {name}:\n    profile: otter{GOTO.format(north=north)}" for name, north in (("near", 5), ("far", 12))
    )
    first = play("metrics: {x: {last: SimulatedState.x@far}}\nlimit: 5 min", begin)
    assert first.outcomes == {"near": "SUCCESS", "far": "SUCCESS"}
    assert first.metrics["x"] > 6.0
    later = play("settle: 7 s\nlimit: 5 min", begin)
    assert later.seconds == pytest.approx(first.seconds + 7.0, abs=1e-6)


def test_stop_when(play):
    result = play("stop when: EstimatedState.depth > 2 m\nexpect: [{finally: EstimatedState.depth > 2 m}]", DIVING)
    assert result.passed
    assert 5.0 < result.seconds < 60.0
    assert result.outcomes == {"lauv-noptilus-1": "TIMEOUT"}


DIVING = """
vehicle:
  profile: lauv-noptilus-1
  plan: {origin: "41.185°, -8.7062°", speed: 1.2 m/s, depth: 3 m, maneuvers: [goto: {north: 60}]}
"""


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "hexa-00", "caravel"])
def test_starts_are_those_of_the_file(play, profile):
    begin = (
        f'vehicle:\n  profile: {profile}\n  start: {{at: "41.2°, -8.75°", heading: 90°, level: 55 %}}\nlimit: 12 s\n'
    )
    result = play(
        """
        metrics:
          lat: {first: SimulatedState.lat}
          lon: {first: SimulatedState.lon}
          heading: {first: SimulatedState.psi}
          level: {first: FuelLevel.value}
        """,
        begin,
    )
    assert result.error == ""
    assert math.degrees(result.metrics["lat"]) == pytest.approx(41.2)
    assert math.degrees(result.metrics["lon"]) == pytest.approx(-8.75)
    assert result.metrics["heading"] == pytest.approx(math.radians(90.0), abs=1e-3)
    assert result.metrics["level"] == pytest.approx(55.0, abs=0.2)


def test_an_auv_can_start_under_water(play):
    begin = "vehicle: {profile: lauv-noptilus-1, start: {depth: 3 m}}\nlimit: 2 s\n"
    text = """
    metrics:
      deep: {first: SimulatedState.z}
      known: {first: EstimatedState.depth}
      error: {max: abs(EstimatedState.depth - SimulatedState.z)}
    """
    result = play(text, begin)
    assert result.metrics["deep"] == pytest.approx(3.0, abs=0.01)
    assert result.metrics["known"] == 3.0
    assert result.metrics["error"] < 0.2


@pytest.mark.parametrize(
    ("begin", "said"),
    [
        ("start: {depth: 30 m}", ":3: .* depth of 30 m: the water there is 4.5 m deep, of which its hull needs 0.1 m"),
        ("start: {depth: 4.5 m}", ":3: .* 4.5 m deep"),
        ('start: {depth: 4 m, at: "41.186°, -8.7062°"}', ":3: .* 3.8 m deep"),
        ("parameters: {Simulators.VSIM: {Initial Depth: 30}}", ":3: .* 4.5 m deep"),
    ],
)
def test_a_start_below_the_bottom_is_refused_before_the_run(document, begin, said):
    made = document(begin=f"vehicle:\n  profile: lauv-noptilus-1\n  {begin}\nlimit: 2 s\n")
    for begin in (made.dry_run, lambda: run(made.scenario())):
        with pytest.raises(ScenarioFileError, match=f"trial.scenario.yaml{said}"):
            begin()


def test_a_start_below_the_bottom_by_the_profile_is_no_mistake_of_a_scenario(document, tmp_path):
    (tmp_path / "deep.ini").write_text(
        "[Require lauv-noptilus-1.ini]\n[Simulators.VSIM]\nInitial Depth = 500\n[Navigation.AUV.Navigation]\n"
    )
    begin = "vehicle: {profile: deep.ini}\nworld: {water visibility: 5}\nlimit: 2 s\n"
    assert not run(document(begin=begin).scenario()).error


@pytest.mark.parametrize(
    ("profile", "said"),
    [("otter", "Initial Depth: a boat floats"), ("hexa-00", "this vehicle has no option for depth")],
)
def test_what_does_not_dive_cannot_start_under_water(document, profile, said):
    made = document(begin=f"vehicle:\n  profile: {profile}\n  start: {{depth: 3 m}}\nlimit: 2 s\n")
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:3: .*{said}"):
        made.dry_run()


def test_a_multirotor_flies_a_plan(play):
    begin = """
    vehicle:
      profile: hexa-00
      plan:
        origin: 41.185°, -8.7062°
        speed: 5 m/s
        altitude: 8
        maneuvers:
          - takeoff: {altitude: 8, speed: 2 m/s}
          - goto: {north: 15}
    world: {wind: {speed: 3 m/s, from: 90°, gusts: 0}}
    limit: 90 s
    """
    text = """
    expect:
      - {name: flies there, eventually: SimulatedState.x > 13 m}
      - {name: stays low, always: "-SimulatedState.z < 12 m"}
      - {outcome: SUCCESS}
    metrics: {climbed: {max: -SimulatedState.z}}
    """
    result = play(text, begin)
    assert result.passed, (result.error, result.verdicts)
    assert result.metrics["climbed"] == pytest.approx(8.0, abs=1.0)
    assert result.outcomes == {"hexa-00": "SUCCESS"}


def test_the_current_carries_and_the_wind_blows(play):
    world = "world: {current: {north: 0.4, east: 0.1 m/s}, wind: {speed: 6 m/s, from: 90°}, tide level: 1.5 m}\n"
    metrics = "metrics: {north: {last: SimulatedState.svx}, east: {last: SimulatedState.svy}}\n"
    boat = play(world + metrics + "expect: [{eventually: AbsoluteWind.speed > 5.9 m/s}]")
    assert (boat.metrics["north"], boat.metrics["east"]) == pytest.approx((0.4, 0.1))
    assert boat.passed
    drone = play(
        "world: {wind: {speed: 6 m/s, from: 90°, gusts: 0}}\n" + metrics, "vehicle: {profile: hexa-00}\nlimit: 2 s\n"
    )
    assert (drone.metrics["north"], drone.metrics["east"]) == pytest.approx((0.0, -6.0), abs=1e-6)


def test_a_vehicle_can_start_at_another_time(play):
    begin = "vehicle: {profile: otter, start: {time: 2027-03-01T12:00:00Z}}\nlimit: 2 s\n"
    result = play(
        "expect: [{always: GpsFix.utc_year == 2027, from: 1 s}, {always: GpsFix.utc_month == 3, from: 1 s}]", begin
    )
    assert result.passed
    assert all(verdict.applied for verdict in result.verdicts)


def test_the_altitude_is_that_above_the_bottom_of_the_world(play):
    begin = """
    vehicle: {profile: lauv-noptilus-1}
    world:
      bathymetry: {at: "41.185°, -8.7062°", soundings: [[0, 0, 25.5], [3, 0, 25.5], [0, 3, 25.5], [-3, -3, 25.5]]}
      tide level: 0.5 m
    limit: 2 s
    """
    text = """
    metrics: {above: {first: altitude(SimulatedState)}, deep: {first: SimulatedState.z}}
    expect: [{always: altitude(SimulatedState) > 20 m}]
    """
    result = play(text, begin)
    assert result.error == ""
    assert result.metrics["above"] + result.metrics["deep"] == pytest.approx(26.0)
    assert result.verdicts[0].margin == pytest.approx(6.0, abs=0.5)
