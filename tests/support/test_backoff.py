"""Attempts become rarer while they fail, and frequent again after a success."""

from support.backoff import Backoff


def test_pauses_double_up_to_the_longest_and_begin_again_after_a_success() -> None:
    backoff = Backoff(0.5, 5.0)
    assert [backoff.fail() for _ in range(6)] == [0.5, 1.0, 2.0, 4.0, 5.0, 5.0]
    assert backoff.failures == 6
    backoff.reset()
    assert backoff.failures == 0
    assert backoff.fail() == 0.5


def test_what_has_worked_for_long_begins_again_with_the_first_pause() -> None:
    backoff = Backoff(1.0, 60.0, healthy_after=60.0)
    assert backoff.fail(1e9) == 1.0
    assert backoff.fail(1e9 + 61.0) == 2.0, "it has worked for 60 s only, after a pause of 1 s"
    assert backoff.fail(1e9 + 61.0 + 2.0 + 60.5) == 1.0
    assert backoff.failures == 1


def test_it_never_overflows() -> None:
    backoff = Backoff(1.0, 60.0)
    assert {backoff.fail() for _ in range(5000)} == {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0}
