"""The delay of messages whose sender has a clock of its own."""

import pytest

from autonomy.control import MessageDelay


def test_the_delay_is_that_beyond_the_fastest_message():
    delay = MessageDelay()
    assert [delay.receive(now, sent) for now, sent in ((10.0, 500.0), (10.5, 500.2), (11.0, 501.0))] == pytest.approx(
        [0.0, 0.3, 0.0], abs=1e-3
    )


@pytest.mark.parametrize("rate", [0.99995, 1.00005])
def test_a_clock_that_runs_slower_or_faster_is_no_delay(rate):
    delay = MessageDelay()
    assert max(delay.receive(float(now), rate * now) for now in range(0, 86_400, 5)) < 0.01


def test_a_delay_that_begins_is_one_for_an_hour():
    delay = MessageDelay()
    delay.receive(0.0, 0.0)
    assert min(delay.receive(float(now), now - 2.0) for now in range(1, 3600)) > 1.6
