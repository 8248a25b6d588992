"""Events that happen several times, and limits of metrics."""

import math
import re

import pytest

import imc
from shoal.scenarios import ScenarioFileError

BOAT = """
vehicle: {profile: otter}
limit: 30 s
"""


def told(result, words):
    """When the log book of the vehicle has an entry with these words (s from the start)."""
    log = imc.Log(result.logs["otter"])
    begin = min(message.timestamp for message in log.messages(imc.SimulatedState))
    entries = [message for message in log.messages(imc.LogBookEntry) if words in message.text]
    return [round(message.timestamp - begin) for message in entries]


@pytest.mark.heavy
def test_an_event_is_repeated_each_so_many_seconds(play, tmp_path):
    result = play(
        """
        events:
          - {at: 10 s, every: 5 s, times: 3, silent: Simulators.GPS, for: 2 s}
          - {at: 12 s, every: 6 s, set: {Simulators.GPS: {HACC: 9}}, for: 1 s}
        metrics: {fixes: {last: count(GpsFix)}}
        """,
        BOAT,
        log_root=tmp_path,
    )
    assert result.error == ""
    assert told(result, "fault of Simulators.GPS: silent") == [10, 15, 20]
    assert told(result, "fault of Simulators.GPS ends") == [12, 17, 22]
    assert told(result, "HACC = 9") == [12, 18, 24]
    assert result.metrics["fixes"] == 30.0 - 6.0
    assert not result.warnings


@pytest.mark.heavy
def test_an_event_is_repeated_when_its_condition_begins_to_hold_again(play, tmp_path):
    result = play(
        """
        events:
          - {at: 5 s, every: 6 s, times: 4, silent: Simulators.GPS, for: 3 s}
          - {when: age(GpsFix) > 2 s, times: unlimited, drain: 90 %}
          - {when: age(GpsFix) > 2 s, times: 2, drain: 80 %}
          - {when: age(GpsFix) > 2 s, drain: 70 %}
          - {when: age(GpsFix) > 2 s, times: 9, drain: 60 %}
          - {when: age(GpsFix) > 20 s, times: 2, drain: 50 %}
        """,
        BOAT,
        log_root=tmp_path,
    )
    assert result.error == ""
    counts = {level: len(told(result, f"drained to {level} %")) for level in (90, 80, 70, 60)}
    assert counts == {90: 4, 80: 2, 70: 1, 60: 4}
    events = sorted(words for words in result.warnings if "happened" in words)
    assert len(events) == 2
    assert re.search(r":10: has happened 4 of 9 times: age\(GpsFix\) > 2 s did not begin to hold again$", events[0])
    assert re.search(r":11: has not happened: age\(GpsFix\) > 20 s did not hold$", events[1])


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        ("{at: 1 s, every: 0 s, abort: true}", "every must be at least 0.01 s"),
        ("{at: 1 s, times: 3, abort: true}", "times needs every: TIME, or a condition: when"),
        ("{at: 1 s, every: 9 s, times: 0, abort: true}", "times must be at least 1"),
        ("{at: 1 s, every: 9 s, times: often, abort: true}", "expected a whole number, or unlimited, not 'often'"),
        ("{at: 1 s, every: 9 s, times: 5, abort: true}", "the last time, at 37 s, is not before the end of the run"),
        ("{when: age(GpsFix) > 3 s, every: 9 s, abort: true}", "every is the period from a time on: it needs at"),
        ("{at: 1 s, every: 9 s, silent: Simulators.GPS, for: 10 s}", "for: 10 s is longer than every: 9 s"),
        ("{at: 1 s, evry: 9 s, abort: true}", "unknown key 'evry' (did you mean 'every'?)"),
    ],
)
def test_mistakes_of_repeated_events_are_reported_with_their_line(document, event, reason):
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:5: {re.escape(reason)}"):
        document(f"events:\n  - {event}", BOAT).scenario()


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("captures: {x: {of: GpsFix.lat, event: outage}}", 4, "no event has a name: write name: NAME in one"),
        ("captures: {x: {at: 3 s}}", 4, "'of' is missing"),
        ("captures: {x y: {of: GpsFix.lat, at: 3 s}}", 4, "'x y' cannot be a name"),
        ("captures: {x: {of: GpsFix.lat}}", 4, "either a time, at: 60 s, or a condition"),
        ("captures: {x: {of: GpsFix.lat > 3, at: 3 s}}", 4, "is true or false, not a number"),
        ("captures: {x: {of: $y, at: 3 s}}", 4, "$y: no value with this name is captured before"),
        (
            "events: [{name: outage, at: 3 s, abort: true}]\ncaptures: {x: {of: GpsFix.lat, event: outge}}",
            5,
            "there is no event with the name 'outge' (did you mean 'outage'?)",
        ),
        (
            "events: [{name: o, at: 3 s, abort: true}]\ncaptures: {x: {of: GpsFix.lat, event: o, at: 3 s}}",
            5,
            "the time is that of the event: no at",
        ),
        (
            "events: [{name: o, at: 3 s, abort: true},\n  {name: o, at: 4 s, abort: true}]",
            5,
            "there are two events 'o'",
        ),
        ("expect: [{metric: drift, at most: 3}]", 4, "the scenario has no metrics"),
        (
            "metrics: {drift: {max: SimulatedState.z}}\nexpect: [{metric: drft, at most: 3}]",
            5,
            "there is no metric 'drft' (did you mean 'drift'?)",
        ),
        (
            "metrics: {drift: {max: SimulatedState.z}}\nexpect: [{metric: drift}]",
            5,
            "a limit is missing: one of at most",
        ),
        (
            "metrics: {drift: {max: SimulatedState.z}}\nexpect: [{metric: drift, at most: 3 s}]",
            5,
            "'3 s' should be in m",
        ),
        (
            "metrics: {drift: {max: SimulatedState.z}}\nexpect: [{metric: drift, at most: 3, within: 3 s}]",
            5,
            "unknown key 'within'",
        ),
        ("expect: [{always: age(GpsFx) < 3 s}]", 4, "age takes messages, such as SimulatedState, not 'GpsFx'"),
        ("expect: [{always: GpsFix.lat < 3 furlongs}]", 4, "there is no unit 'furlongs', at character 16"),
    ],
)
def test_mistakes_are_reported_with_their_line(document, text, line, reason):
    with pytest.raises(ScenarioFileError) as caught:
        document(text, BOAT).scenario()
    assert f"trial.scenario.yaml:{line}: " in str(caught.value)
    assert reason in str(caught.value)


def test_a_metric_has_a_limit(play):
    result = play(
        """
        metrics:
          depth: {max: SimulatedState.z + 3 m}
          fixes: {last: count(GpsFix)}
          none: {max: 'Temperature[GPS].value'}
        expect:
          - {name: shallow, metric: depth, at most: 5 m, above: 100 cm}
          - {metric: depth, at most: 1 m}
          - {name: exact, metric: fixes, at least: 3, at most: 3}
          - {name: more, metric: fixes, above: 3}
          - {name: absent, metric: none, below: 9}
        """
    )
    found = {verdict.name: verdict for verdict in result.verdicts}
    depth = result.metrics["depth"]
    assert found["shallow"].passed
    assert found["shallow"].margin == min(5.0 - depth, depth - 1.0)
    assert not found["depth at most 1 m"].passed
    assert found["depth at most 1 m"].reason == f"depth is {depth:.6g}, off by {depth - 1.0:.6g}"
    assert found["exact"].passed
    assert not found["more"].passed
    assert found["more"].margin == 0.0
    assert not found["absent"].passed
    assert not found["absent"].applied
    assert found["absent"].reason == "none was not measured"
    assert found["absent"].margin == -math.inf
    assert found["absent"].origin.endswith(":14")
