"""What others cause in any number is logged in part."""

import math

from support.log_limit import AT_ONCE, RATE, LogLimit, ReportLimit, Trouble


def test_the_first_of_many_lines_are_logged_and_that_there_are_more() -> None:
    lines: list[str] = []
    limit = LogLimit("more requests are rejected")
    for number in range(3 * AT_ONCE):
        limit.write(lines.append, f"request {number}", 5.0)
    assert len(lines) == AT_ONCE + 1
    assert lines[AT_ONCE - 1 :] == [
        f"request {AT_ONCE - 1}",
        "more requests are rejected, which are not logged one by one",
    ]
    limit.write(lines.append, "later", 5.0 + math.ceil(1.0 / RATE))
    assert lines[-1] == "later"


def test_each_subject_is_reported_once() -> None:
    limit = ReportLimit()
    assert [limit.is_due(subject) for subject in ("a", "b", "a", ("b", "why"))] == [True, True, False, True]
    assert not limit.is_due("a", 1e12)


def test_a_subject_is_reported_again_after_the_period() -> None:
    limit = ReportLimit(10.0)
    assert [limit.is_due(now=now) for now in (5.0, 6.0, 14.9, 15.0, 15.0, 24.0, 25.0)] == [
        *(True, False, False, True, False, False, True)
    ]
    assert limit.is_due("another", 25.0)


def test_a_flood_of_subjects_is_cut_off_until_the_period_is_over() -> None:
    limit = ReportLimit(10.0, most=2)
    assert [limit.is_due(subject, 0.0) for subject in "abc"] == [True, True, False]
    assert limit.is_full
    assert not limit.is_due("c", 9.0)
    assert limit.is_due("c", 10.0)
    assert not limit.is_full


def test_a_reason_is_logged_when_it_changes_and_its_end_is_noticed_once() -> None:
    lines: list[str] = []
    trouble = Trouble()
    for reason in ("disk full", "disk full", "no disk", "disk full"):
        trouble.report(reason, lines.append, f"not recorded: {reason}")
    assert lines == ["not recorded: disk full", "not recorded: no disk", "not recorded: disk full"]
    assert trouble.reason == "disk full"
    assert [trouble.end(), trouble.end(), trouble.reason] == ["disk full", "", ""]
    trouble.report("disk full", lines.append)
    assert lines[3:] == ["disk full"]
