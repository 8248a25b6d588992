"""Expectations and metrics, judged on courses of values that are known."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from shoal.scenarios.conditions import ExpressionScope, parse_expression, parse_scenario_condition
from shoal.scenarios.expectations import Expectation
from shoal.scenarios.metrics import Metric

ALONE = ExpressionScope({"lauv": imc.builtin()}, "lauv")


class Course:
    """Stands in for a run context and its monitor: values of Depth and of Temperature, with their times."""

    def __init__(self):
        self.monitor = self
        self.time = 0.0
        self._watchers = []

    def add_subscriber(self, groups, on_message):
        seen = [[None] * len(group) for group in groups]
        self._watchers.append((groups, on_message, seen))
        return seen

    def play(self, *messages):
        for time, message in messages:
            self.time = time
            for groups, on_message, seen in self._watchers:
                concerned = False
                for group, latest in zip(groups, seen, strict=True):
                    for place, watch in enumerate(group):
                        if watch.kind is type(message):
                            latest[place], concerned = message, True
                if concerned:
                    on_message(time)


def depths(*values):
    """One depth a second, from 0 s on."""
    return [(float(time), imc.Depth(value=value)) for time, value in enumerate(values)]


def judged(kind, text, course, then="", meanwhile="", **more):
    context = Course()
    conditions = {
        key: parse_scenario_condition(words, ALONE)
        for key, words in (("then", then), ("meanwhile", meanwhile))
        if words
    }
    monitor = Expectation("name", kind, "", parse_scenario_condition(text, ALONE), **conditions, **more).make_monitor(
        context
    )
    context.play(*course)
    return monitor.verdict()


def told(verdict):
    return verdict.passed, verdict.margin, verdict.time, verdict.applied


def test_always_has_its_smallest_margin():
    assert told(judged("always", "Depth.value < 5", depths(1, 4, 2))) == (True, 1.0, 1.0, True)
    failed = judged("always", "Depth.value < 5", depths(1, 6, 8, 2))
    assert told(failed) == (False, -3.0, 2.0, True)
    assert failed.reason == "failed first at 1.000 s, worst at 2.000 s, by 3"


def test_what_is_just_missed_has_failed_by_nothing():
    assert told(judged("always", "Depth.value < 5", depths(5))) == (False, 0.0, 0.0, True)
    assert told(judged("always", "Depth.value <= 5", depths(5))) == (True, 0.0, 0.0, True)


def test_a_value_that_is_no_number_fails():
    assert told(judged("always", "Depth.value < 5", depths(1, math.nan))) == (False, -math.inf, 1.0, True)
    assert told(judged("always", "Depth.value > 5", depths(9, math.nan))) == (False, -math.inf, 1.0, True)
    reason = judged("always", "Depth.value > 5", depths(9, math.nan)).reason
    assert reason == "failed first at 1.000 s: a value is no number"
    for kind in ("eventually", "finally"):
        assert judged(kind, "Depth.value < 5", depths(9, math.nan)[-1:]).margin == -math.inf


def test_only_its_time_and_its_while_count():
    assert judged("always", "Depth.value < 5", depths(9, 1, 9), begin=1.0, end=1.5).passed
    course = [(0.0, imc.Temperature(value=3.0)), *depths(9, 9), (2.0, imc.Temperature(value=5.0))]
    verdict = judged(
        "always", "Depth.value < 5", [*course, (3.0, imc.Depth(value=2.0))], meanwhile="Temperature.value > 4"
    )
    assert told(verdict) == (False, -4.0, 2.0, True)
    idle = judged("always", "Depth.value < 5", depths(9), meanwhile="Temperature.value > 4")
    assert told(idle)[:2] + told(idle)[3:] == (True, math.inf, False)
    assert idle.reason == "no Temperature of lauv arrived"


def test_eventually_has_its_largest_margin():
    assert told(judged("eventually", "Depth.value > 5", depths(1, 6, 7, 2))) == (True, 2.0, 2.0, True)
    late = judged("eventually", "Depth.value > 5", depths(1, 4, 3, 7), within=2.5)
    assert told(late) == (False, -1.0, 1.0, True)
    assert late.reason == "not met until 2.500 s, closest at 1.000 s, off by 1"
    assert judged("eventually", "Depth.value > 5", depths(9, 1, 1), begin=1.0, within=1.0).passed is False
    never = judged("eventually", "Depth.value > 5", [])
    assert (never.passed, never.applied, never.reason) == (False, False, "no Depth of lauv arrived")


def test_until_needs_what_holds_before():
    met = judged("until", "Depth.value > 5", depths(1, 2, 7), then="Depth.value < 3")
    assert told(met) == (True, 1.0, 2.0, True)
    broken = judged("until", "Depth.value > 5", depths(1, 4, 7), then="Depth.value < 3")
    assert told(broken)[:2] == (False, -1.0)
    assert broken.reason == "Depth.value < 3 failed at 1.000 s, before Depth.value > 5"
    late = judged("until", "Depth.value > 5", depths(1, 1, 1, 7), then="Depth.value < 3", within=2.0)
    assert (late.passed, late.reason) == (False, "Depth.value > 5 did not hold until 2.000 s")
    assert judged("until", "Depth.value > 5", depths(7, 9), then="Depth.value < 3").passed


@pytest.mark.parametrize(("end", "applied"), [(2.5, False), (3.0, True), (9.0, True)])
def test_what_should_follow_is_not_judged_if_its_time_is_cut_short(end, applied):
    """It begins at 1 s, and has 2 s."""
    found = judged("after", "Depth.value > 5", depths(1, 6, 6, 6, 6), then="Depth.value > 7", within=2.0, end=end)
    assert (found.passed, found.applied) == (not applied, applied)
    met = judged("after", "Depth.value > 5", depths(1, 6, 8, 6, 6), then="Depth.value > 7", within=2.0, end=2.5)
    assert (met.passed, met.applied, met.margin) == (True, True, 1.0)
    broken = judged(
        "after", "Depth.value > 5", depths(1, 6, 8, 6), then="Depth.value < 7", within=2.0, end=2.5, steady=True
    )
    assert (broken.passed, broken.margin) == (False, -1.0)


def test_after_each_beginning_something_follows():
    course = depths(1, 6, 6, 9, 1, 6, 8, 1)
    followed = judged("after", "Depth.value > 5", course, then="Depth.value > 7", within=2.0)
    assert told(followed) == (True, 1.0, 5.0, True)
    assert followed.reason == "followed 2 times, closest after 5.000 s"
    missed = judged("after", "Depth.value > 5", course, then="Depth.value > 8", within=2.0)
    assert told(missed) == (False, 0.0, 5.0, True)
    assert judged("after", "Depth.value > 5", course, then="Depth.value > 5", within=1.0, steady=True).passed
    assert not judged("after", "Depth.value > 5", course, then="Depth.value < 9", within=2.0, steady=True).passed


def test_what_the_end_leaves_open_is_not_judged():
    course = depths(1, 1, 6)
    idle = judged("after", "Depth.value > 5", course, then="Depth.value < 3", within=2.0)
    assert (idle.passed, idle.applied) == (True, False)
    assert judged("after", "Depth.value > 5", course, then="Depth.value > 3", within=2.0).applied
    broken = judged("after", "Depth.value > 5", course, then="Depth.value < 3", within=2.0, steady=True)
    assert (broken.passed, broken.applied) == (False, True)


def test_finally_is_the_end():
    assert told(judged("finally", "Depth.value < 5", depths(9, 9, 3))) == (True, 2.0, 2.0, True)
    assert told(judged("finally", "Depth.value < 5", depths(1, 1, 7))) == (False, -2.0, 2.0, True)
    assert not judged("finally", "Depth.value < 5", []).passed


VALUES = st.lists(st.floats(-10, 10), min_size=1, max_size=12)


@given(VALUES, st.floats(-10, 10))
def test_never_is_the_contrary_of_eventually(values, limit):
    sooner = judged("eventually", f"Depth.value > {limit!r}", depths(*values))
    always = judged("always", f"not Depth.value > {limit!r}", depths(*values))
    assert sooner.passed != always.passed
    assert sooner.margin == -always.margin


@given(VALUES, st.floats(-10, 10))
def test_a_course_moved_by_less_than_the_margin_has_the_same_verdict(values, limit):
    before = judged("always", f"Depth.value < {limit!r}", depths(*values))
    moved = [value + 0.99 * before.margin for value in values]
    if abs(before.margin) > 1e-6:
        assert judged("always", f"Depth.value < {limit!r}", depths(*moved)).passed == before.passed


def measured(kind, course, text="Depth.value", **more):
    context = Course()
    recorder = Metric("name", kind, "", parse_expression(text, ALONE), **more).make_recorder(context)
    context.play(*course)
    return recorder


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("max", 4.0), ("min", 1.0), ("mean", 2.5), ("rms", math.sqrt(7.5)), ("first", 2.0), ("last", 3.0)],
)
def test_metrics(kind, expected):
    recorder = measured(kind, depths(2, 1, 4, 3))
    assert recorder.value() == pytest.approx(expected)
    assert recorder.warning() == ""


@pytest.mark.parametrize(("percentage", "expected"), [(0, 1.0), (50, 2.5), (95, 3.85), (100, 4.0)])
def test_percentiles(percentage, expected):
    assert measured("percentile", depths(2, 1, 4, 3), bound=percentage).value() == pytest.approx(expected)


def test_times_beyond_a_limit_last_until_the_next_value():
    course = [*depths(1, 3, 3, 1), (3.5, imc.Depth(value=4.0)), (5.0, imc.Temperature(value=1.0))]
    context = Course()
    above = Metric("a", "time above", "", parse_expression("Depth.value", ALONE), bound=2.0).make_recorder(context)
    below = Metric("b", "time below", "", parse_expression("Depth.value", ALONE), bound=2.0).make_recorder(context)
    context.play(*course)
    assert above.value() == 2.0 + 1.5
    assert below.value() == 1.0 + 0.5


def test_a_metric_that_cannot_be_measured_says_why():
    nothing = measured("mean", [])
    assert math.isnan(nothing.value())
    assert nothing.warning() == "metric name: no Depth of lauv arrived"
    undefined = measured("max", depths(1, math.nan))
    assert math.isnan(undefined.value())
    assert undefined.warning() == "metric name: 1 values of Depth.value are no numbers"


@given(VALUES)
def test_metrics_are_in_order(values):
    found = {kind: measured(kind, depths(*values)).value() for kind in ("min", "mean", "max", "rms")}
    assert found["min"] - 1e-5 <= found["mean"] <= found["max"] + 1e-5
    assert found["rms"] >= abs(found["mean"]) - 1e-5


@pytest.mark.parametrize("values", [(1e308, 1e308), (math.inf, -math.inf)])
def test_a_mean_that_is_too_large_says_so(values):
    course = [(float(at), imc.EstimatedState(lat=value)) for at, value in enumerate(values)]
    recorder = measured("mean", course, "EstimatedState.lat")
    assert math.isnan(recorder.value())
    assert recorder.warning() == "metric name: values of EstimatedState.lat are too large for a mean"
    assert measured("rms", course, "EstimatedState.lat").value() == math.inf


def test_times_beyond_a_limit_end_with_the_time_of_the_metric():
    context = Course()
    above = Metric("a", "time above", "", parse_expression("Depth.value", ALONE), bound=2.0, end=10.0).make_recorder(
        context
    )
    context.play(*((time, imc.Depth(value=3.0)) for time in (0.0, 4.0, 8.0, 12.0)))
    assert above.value() == 10.0


@pytest.mark.parametrize("steady", [True, False])
def test_what_had_nothing_to_follow_it_proves_nothing(steady):
    found = judged(
        "after", "Depth.value > 5", depths(1, 6, 6, 6, 6), then="Temperature.value < 3", within=2.0, steady=steady
    )
    assert (found.passed, found.applied) == ((True, False) if steady else (False, True))
