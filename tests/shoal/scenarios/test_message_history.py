"""Age, rate, absence and count of messages, what has held for a while, and captured values."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from runtime.kernel import SECOND
from shoal.scenarios.conditions import parse_expression, parse_scenario_condition
from shoal.scenarios.message_history import ArrivalHistory, CapturedValue, HeldMargin
from shoal.scenarios.message_names import ExpressionScope
from shoal.scenarios.scenario_condition import ArrivalSelector, CaptureSelector, HeldSelector, MessageSelector

ALONE = ExpressionScope({"lauv": imc.builtin()}, "lauv", captures={"before": "m"})
OUTAGE = """
vehicle: {profile: otter}
limit: 40 s
events:
  - {name: outage, at: 15 s, silent: Simulators.GPS, for: 6 s}
"""


def verdicts(result):
    assert not result.error
    return {verdict.name: verdict for verdict in result.verdicts}


@pytest.mark.heavy
def test_the_age_and_the_rate_of_a_message_fail_in_an_outage(play):
    result = play(
        """
        expect:
          - {name: age, always: age(GpsFix) < 4 s}
          - {name: patient, always: age(GpsFix) < 8 s}
          - {name: rate, always: rate(GpsFix) > 0.8 Hz}
          - {name: rate of 20 s, always: 'rate(GpsFix, 20 s) > 0.6 Hz'}
          - {name: comes back, after: age(GpsFix) > 4 s, within: 5 s, eventually: age(GpsFix) < 1 s}
        metrics: {oldest: {max: age(GpsFix)}, slowest: {min: rate(GpsFix)}, fixes: {last: count(GpsFix)}}
        """,
        OUTAGE,
    )
    found = verdicts(result)
    assert not found["age"].passed
    assert found["age"].margin == pytest.approx(-3.0, abs=0.01)  # the last fix came at 14 s, the next one at 21 s
    assert "failed first at 18.000 s, worst at 21.000 s" in found["age"].reason
    assert found["patient"].passed
    assert found["patient"].margin == pytest.approx(1.0, abs=0.01)
    assert not found["rate"].passed
    assert found["rate"].margin == pytest.approx(-0.4)  # 4 fixes in 10 s
    assert found["rate of 20 s"].passed
    assert found["comes back"].passed
    assert found["comes back"].reason.startswith("followed 1 time")
    assert result.metrics["oldest"] == pytest.approx(7.0, abs=0.01)
    assert result.metrics["slowest"] == pytest.approx(0.4)
    assert result.metrics["fixes"] == 40.0 - 6.0


def test_a_message_that_never_arrives_is_absent_and_not_unknown(play):
    result = play(
        """
        expect:
          - {name: none, always: count(Abort) == 0}
          - {name: late, always: age(Abort) < 2 s}
          - {name: fresh, eventually: age(Abort) < 2 s}
          - {name: old, eventually: age(Abort) > 2 s}
          - {name: no rate, always: 'rate(Abort, 1 s) < 0.1 Hz'}
        metrics: {aborts: {last: count(Abort)}, oldest: {max: age(Abort)}}
        """
    )
    found = verdicts(result)
    assert {name for name, verdict in found.items() if verdict.passed} == {"none", "old", "no rate"}
    assert all(found[name].applied for name in ("none", "late", "old", "no rate"))
    assert found["late"].margin == pytest.approx(-1.0)  # 3 s without any
    assert found["old"].margin == pytest.approx(1.0)
    assert result.metrics["aborts"] == 0.0
    assert math.isnan(result.metrics["oldest"])
    assert any("metric oldest: no Abort of otter arrived" in words for words in result.warnings)


@pytest.mark.heavy
def test_what_holds_for_a_while(play):
    result = play(
        """
          - {at: 30 s, silent: Simulators.GPS, for: 2 s}
        expect:
          - {name: at all, eventually: age(GpsFix) > 4 s}
          - {name: 2 s, eventually: 'held(age(GpsFix) > 4 s, 2 s)'}
          - {name: 4 s, never: 'held(age(GpsFix) > 4 s, 4 s)'}
          - {name: messages, eventually: 'held(EstimatedState.depth < 10 m, 5 s)'}
        stop when: held(age(GpsFix) > 1.5 s, 5 s)
        """,
        OUTAGE,
    )
    found = verdicts(result)
    assert found["at all"].passed
    assert found["2 s"].passed
    assert found["4 s"].passed
    assert found["messages"].passed
    assert result.seconds == pytest.approx(20.5, abs=0.11)  # 14 s + 1.5 s + 5 s


@pytest.mark.heavy
def test_a_value_captured_at_an_event_is_used_later(play):
    result = play(
        """
          - {at: 25 s, name: later, abort: true}
        captures:
          place: {of: SimulatedState.x, event: outage}
          double: {of: $place + $place + 1 m, event: later}
          start: {of: SimulatedState.x, at: 1 s}
          first: {of: GpsFix.lat, when: count(GpsFix) == 3}
          never: {of: EstimatedState.x, when: EstimatedState.depth > 100 m}
        expect:
          - {name: drift, always: abs(SimulatedState.x - $place) < 100 m}
          - {name: not before, eventually: $place < 100 m, to: 14 s}
          - {name: sum, finally: abs($double - $place - $place - 1 m) < 1 mm}
          - {name: unknown, always: EstimatedState.x < $never}
        metrics:
          since: {last: SimulatedState.x - $place}
          captured: {last: $place}
        """,
        OUTAGE,
    )
    found = verdicts(result)
    assert found["drift"].passed
    assert found["drift"].time >= 15.0
    assert not found["not before"].passed
    assert not found["not before"].applied
    assert found["sum"].passed
    assert not found["unknown"].applied
    assert found["unknown"].reason == "$never was not captured"
    assert math.isfinite(result.metrics["since"] + result.metrics["captured"])
    assert any("EstimatedState.depth > 100 m did not hold" in words for words in result.warnings)


@pytest.mark.heavy
def test_text_that_contains_a_word(play):
    result = play(
        """
        expect:
          - {name: told, eventually: LogBookEntry.text ~ 'FAULT of simulators.gps'}
          - {name: quiet, never: "contains(LogBookEntry.text, 'leak')"}
        """,
        OUTAGE,
    )
    assert result.passed
    assert not play("expect: [{never: LogBookEntry.text ~ 'gps'}]", OUTAGE).passed


@pytest.mark.heavy
def test_a_run_with_history_is_the_same_again_and_with_a_log(play, tmp_path):
    text = """
        captures: {x: {of: EstimatedState.x, event: outage}}
        expect:
          - {always: "rate(GpsFix) > 0.2 Hz and held(age(GpsFix) < 9 s, 1 s)"}
          - {always: abs(EstimatedState.x - $x) < 100 m}
        """
    first = play(text, OUTAGE)
    assert play(text, OUTAGE).fingerprint == first.fingerprint
    assert play(text, OUTAGE, log_root=tmp_path / "log").fingerprint == first.fingerprint
    plain = play("", OUTAGE, log_root=tmp_path / "plain")
    assert play(text, OUTAGE, log_root=tmp_path / "again").hashes == plain.hashes  # who watches changes nothing


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("age(GpsFx) > 3", r"age takes messages, such as SimulatedState, not 'GpsFx', at character 5"),
        ("age(GpsFix.lat) > 3", "age takes messages"),
        ("age() > 3", r"age takes a message, such as age\(GpsFix\)"),
        ("age(GpsFix) > 3 m", r"age\(GpsFix\) is in s, but 3 m is in m, at character 15"),
        ("rate(GpsFix, 3 m) > 1 Hz", "rate takes a time that is a number, such as 5 s"),
        ("rate(GpsFix) > 1 s", "is in Hz, but 1 s is in s"),
        ("rate(GpsFix, 0 s) > 1", "the time of rate is from 1 ms"),
        ("count(GpsFix, 3 s) > 1", "count takes a message"),
        ("held(EstimatedState.depth, 3 s)", "a comparison is missing, at character 26"),
        ("held(EstimatedState.depth > 1)", "held takes a condition and a time"),
        ("held(1 > 2, 3 s)", "1 > 2: names no message"),
        ("held(EstimatedState.depth > 1, EstimatedState.depth)", "held takes a time that is a number"),
        ("held(EstimatedState.depth > 1, 3 s) > 2", "is true or false, not a number"),
        ("$befor > 2", r"no value with this name is captured before \(did you mean 'before'\?\), at character 1"),
        ("$before > 2 s", r"\$before is in m, but 2 s is in s"),
        ("agee(GpsFix) > 2", r"no function 'agee' \(did you mean 'age'\?\)"),
        ("EstimatedState.depth->otter > 2", "there is no vehicle 'otter'"),
        ("EstimatedState.depth->lauv > 2", "lauv receives nothing from itself"),
        ("EstimatedState.depth ~ 'a'", "EstimatedState.depth is a number"),
    ],
)
def test_mistakes_are_named(text, reason):
    with pytest.raises(ValueError, match=reason):
        parse_scenario_condition(text, ALONE)


def test_what_a_text_looks_at():
    condition = parse_scenario_condition("held(rate(GpsFix, 2 s) < 1 and $before > 2, 5 s)", ALONE)
    fixes = MessageSelector(imc.GpsFix, "lauv")
    (held, *rest) = condition.selectors
    assert isinstance(held, HeldSelector)
    assert rest == [fixes, ArrivalSelector(fixes, 2 * SECOND), CaptureSelector("before")]
    assert parse_expression("age(GpsFix) + 1 s", ALONE).unit == "s"
    assert parse_expression("$before", ALONE).unit == "m"


TIMES = st.lists(st.integers(1, 30 * SECOND), max_size=20).map(sorted)


@given(TIMES, st.integers(1, 10), st.integers(0, 40 * SECOND))
def test_rate_and_age_are_those_of_all_arrivals(times, seconds, after):
    clock = [0]
    history = ArrivalHistory(lambda: clock[0], seconds * SECOND)
    for time in times:
        clock[0] = time
        history.record_arrival()
    clock[0] = now = (times[-1] if times else 0) + after
    assert history.count == len(times)
    assert history.age() == (now - (times[-1] if times else 0)) / SECOND
    assert history.rate() == len([t for t in times if now - seconds * SECOND <= t < now]) / seconds
    assert history.is_window_open() == (now < seconds * SECOND)


SAMPLES = st.lists(st.tuples(st.integers(1, 5), st.one_of(st.integers(-3, 3), st.just(math.nan))), max_size=25)


@given(SAMPLES, st.integers(1, 8))
def test_what_has_held_is_the_smallest_margin_of_a_while(steps, seconds):
    held, now, samples = HeldMargin(seconds), 0, []
    for step, margin in steps:
        now += step
        samples.append((now, margin))
        held.update(float(now), float(margin))
        known = []  # begin, end and margin of each sample since the last one that was not known
        for (begin, value), end in zip(samples, [*(time for time, _ in samples[1:]), math.inf], strict=True):
            known = [] if math.isnan(value) else [*known, (begin, end, value)]
        inside = [value for _, end, value in known if end > now - seconds]
        is_long = bool(known) and known[0][0] <= now - seconds
        expected = min(inside) if inside and (is_long or min(inside) <= 0) else -77.0
        assert held.margin(-77.0) == expected


def test_a_captured_value_tells_who_uses_it():
    seen, value = [], CapturedValue()
    value.listeners.append(seen.append)
    value.capture(3.0, 1.5)
    assert (value.value, value.is_there, seen) == (3.0, True, [1.5])
