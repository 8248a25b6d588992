"""Vehicles of shipped profiles that hear each other over links that lose, delay and drop."""

import itertools

import pytest

import imc
from shoal.scenarios import ScenarioFileError

PAIR = """
vehicles:
  lauv-noptilus-1: {profile: lauv-noptilus-1, seed: 1}
  otter: {profile: otter, start: {at: "41.1855°, -8.7062°"}}
limit: 30 s
"""
TWINS = """
vehicles:
  lauv-noptilus-1: {profile: lauv-noptilus-1}
  lauv-noptilus-2: {profile: lauv-noptilus-1, seed: 9}
limit: 30 s
"""


def heard(result, vehicle, kind, source):
    """What the log of a vehicle has of another one."""
    log = imc.Log(result.logs[vehicle])
    return [message for message in log.messages(kind) if message.src == source]


@pytest.mark.heavy
def test_a_link_loses_and_delays_what_a_vehicle_and_a_boat_say(play, tmp_path):
    text = """
    links:
      - {between: [lauv-noptilus-1, otter], name: acoustic, latency: 0.4 s, propagation: 1500 m/s, loss: 30 %,
         rate: 400 B/s, range: 200 m, messages: [EstimatedState, Heartbeat]}
    """
    result = play(text, PAIR, log_root=tmp_path)
    assert result.error == ""
    counts = {name.removeprefix("acoustic: "): count for name, count in result.metrics.items()}
    assert counts["lost"] / counts["sent"] == pytest.approx(0.3, abs=0.1)
    assert counts["dropped"] > 100.0, "states at 20 Hz do not fit"
    assert counts["out of range"] <= 2.0, "only as long as a place was not known"
    assert counts["sent"] >= counts["received"] + counts["lost"] + counts["out of range"]
    states = heard(result, "otter", imc.EstimatedState, 0x1A)
    assert len(states) > 10
    assert all(a.timestamp < b.timestamp for a, b in itertools.pairwise(states))
    assert result.fingerprint == play(text, PAIR).fingerprint
    assert result.metrics != play(text, PAIR, seed=4).metrics


@pytest.mark.heavy
def test_two_vehicles_of_one_profile_hear_each_other_until_the_link_is_cut(play, tmp_path):
    text = """
    links:
      - {between: [lauv-noptilus-1, lauv-noptilus-2], name: radio, messages: [Heartbeat]}
    events:
      - {at: 10.5 s, cut: radio, for: 10 s}
      - {at: 5 s, vehicle: lauv-noptilus-2, silent: Simulators.GPS}
    """
    result = play(text, TWINS, log_root=tmp_path)
    assert result.error == ""
    assert result.metrics["radio: cut"] == 40.0, "Daemon and Failsafe of each say one a second"
    assert result.metrics["radio: received"] == pytest.approx(80.0, abs=4.0)
    for name, other in (("lauv-noptilus-1", 0x1B), ("lauv-noptilus-2", 0x1A)):
        assert len(heard(result, name, imc.Heartbeat, other)) == pytest.approx(40, abs=2)
        texts = [entry.text for entry in imc.Log(result.logs[name]).messages(imc.LogBookEntry)]
        assert "scenario: link radio cut, for 10 s" in texts
        assert "scenario: link radio mended" in texts
        assert ("fault of Simulators.GPS: silent" in texts) == (name == "lauv-noptilus-2")


def test_beyond_the_range_and_without_a_link_nothing_is_received(play, tmp_path):
    text = "links: [{between: [lauv-noptilus-1, otter], range: 20 m}]"
    result = play(text, PAIR.replace("limit: 30 s", "limit: 5 s"), log_root=tmp_path / "a")
    assert result.metrics["lauv-noptilus-1-otter: received"] == 0.0
    assert result.metrics["lauv-noptilus-1-otter: out of range"] > 500.0
    alone = play("", PAIR.replace("limit: 30 s", "limit: 5 s"), log_root=tmp_path / "b")
    assert alone.metrics == {}
    assert heard(alone, "otter", imc.Heartbeat, 0x1A) == []


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ("{range: 3 m}", "'between' is missing"),
        ("{between: [otter]}", "between two or more vehicles"),
        ("{between: [otter, otter]}", "between two or more vehicles"),
        ("{between: [otter, oter]}", r"there is no vehicle 'oter' \(did you mean 'otter'\?\)"),
        ("{between: [lauv-noptilus-1, otter], rnage: 3 m}", r"\(did you mean 'range'\?\)"),
        ("{between: [lauv-noptilus-1, otter], range: 3 s}", "should be in m"),
        ("{between: [lauv-noptilus-1, otter], range: -3}", "must be at least 0"),
        ("{between: [lauv-noptilus-1, otter], loss: 10}", "from 0 to 1"),
        ("{between: [lauv-noptilus-1, otter], rate: 0}", "must be above 0"),
        ("{between: [lauv-noptilus-1, otter], rate: fast}", "is not a number with a unit"),
        ("{between: [lauv-noptilus-1, otter], rate: 3 m}", "should be in B/s or kB/s or bit/s or kbit/s"),
        ("{between: [lauv-noptilus-1, otter], rate: 3 kb/s}", "should be in B/s or kB/s or bit/s or kbit/s"),
        ("{between: [lauv-noptilus-1, otter], latency: soon}", "is not a duration"),
        ("{between: [lauv-noptilus-1, otter], messages: [Depht]}", "did you mean 'Depth'"),
        ("{between: [lauv-noptilus-1, otter]}\n  - {between: [lauv-noptilus-1, otter]}", "there are two links"),
    ],
)
def test_links_that_cannot_be(document, link, words):
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:[78]: .*{words}"):
        document(f"links:\n  - {link}", PAIR).scenario()


@pytest.mark.heavy
def test_what_a_vehicle_receives_differs_from_what_another_one_publishes(play):
    result = play(
        """
        links: [{between: [lauv-noptilus-1, otter], name: acoustic, latency: 0.4 s, messages: [EstimatedState]}]
        events: [{at: 10 s, cut: acoustic, for: 8 s}]
        captures: {last: {of: EstimatedState.x@lauv-noptilus-1->otter, at: 15 s}}
        expect:
          - {name: published, always: age(EstimatedState@lauv-noptilus-1) < 1 s, from: 6 s}
          - {name: received, always: age(EstimatedState@lauv-noptilus-1->otter) < 5 s, from: 6 s}
          - name: known
            finally: distance(SimulatedState@lauv-noptilus-1, EstimatedState@lauv-noptilus-1->otter) < 50 m
          - {name: value, always: EstimatedState.depth->otter < 50 m, vehicle: lauv-noptilus-1}
          - {name: capture, finally: abs($last) < 1 km}
          - {name: counts, metric: "acoustic: received", at least: 100}
        metrics:
          silence: {max: age(EstimatedState@lauv-noptilus-1->otter)}
          sent: {last: count(EstimatedState@lauv-noptilus-1)}
          arrived: {last: count(EstimatedState@lauv-noptilus-1->otter)}
          returned: {last: count(EstimatedState@otter->lauv-noptilus-1)}
        """,
        PAIR,
    )
    assert result.error == ""
    found = {verdict.name: verdict for verdict in result.verdicts}
    assert {name for name, verdict in found.items() if not verdict.passed} == {"received"}
    assert result.metrics["silence"] == pytest.approx(8.0, abs=0.5)
    assert found["received"].margin == pytest.approx(5.0 - result.metrics["silence"])
    assert result.metrics["arrived"] + result.metrics["returned"] == result.metrics["acoustic: received"]
    assert 100.0 < result.metrics["sent"] - result.metrics["arrived"] < result.metrics["acoustic: cut"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("Heartbeat@otter->lauv-noptilus-1", "the link acoustic does not carry Heartbeat"),
        ("EstimatedState@otter->lauv", r"no vehicle 'lauv' \(known: lauv-noptilus-1, otter\), at character 5"),
        ("EstimatedState@otter->otter", "otter receives nothing from itself"),
    ],
)
def test_what_cannot_arrive_is_refused_with_its_line(document, text, reason):
    links = "links: [{between: [lauv-noptilus-1, otter], name: acoustic, messages: [EstimatedState]}]\n"
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:7: .*{reason}"):
        document(f"{links}expect: [{{always: age({text}) < 3 s}}]", PAIR).scenario()
    with pytest.raises(ScenarioFileError, match=r"trial.scenario.yaml:6: .*no link joins otter and lauv-noptilus-1"):
        document("expect: [{always: age(EstimatedState@otter->lauv-noptilus-1) < 3 s}]", PAIR).scenario()
