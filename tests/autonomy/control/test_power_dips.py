"""What a multirotor makes of losses of its power that last a moment."""

import pytest

from autonomy.control import BLIND_DESCENT, GRAVITY, PowerDips


def fail(*begins, length=0.3):
    dips = PowerDips()
    for begin in begins:
        assert dips.receive(begin, powered=False)
        assert dips.receive(begin + length, powered=True)
    return dips


def test_the_time_without_lift_is_counted_once_and_exactly():
    dips = PowerDips()
    assert not dips.receive(10.0, powered=True)
    dips.receive(10.02, powered=False)
    assert dips.take_lost_time(10.1) == pytest.approx(0.08)
    dips.receive(10.32, powered=True)
    assert dips.take_lost_time(10.4) == pytest.approx(0.27)  # with the time in which the rotors spin up
    assert dips.take_lost_time(10.5) == 0.0


def test_it_rises_before_a_loss_that_is_expected_and_descends_between_two():
    dips = fail(10.0, 12.0, 14.1)
    speeds = {time: dips.descent(time) for time in (14.5, 15.0, 15.9, 16.5)}
    assert speeds[14.5] == speeds[15.0] == speeds[16.5] == BLIND_DESCENT
    assert speeds[15.9] + 0.35 * GRAVITY == pytest.approx(2.0)
    assert dips.descent(30.0) == BLIND_DESCENT  # the power no longer fails


@pytest.mark.parametrize("dips", [fail(10.0), fail(10.0, 50.0), fail(10.0, 12.0, length=1.5), fail(10.0, 10.9, 11.8)])
def test_it_descends_steadily_where_nothing_is_expected_or_nothing_helps(dips):
    assert {dips.descent(12.0 + 0.1 * i) for i in range(400)} == {BLIND_DESCENT}


def test_losses_repeat_if_they_are_less_than_half_a_minute_apart():
    assert [fail(10.0, time).has_repeated(time + 0.3) for time in (35.0, 45.0)] == [True, False]
    assert fail(10.0).urgent_descent(11.0) is None
    assert [fail(10.0, 12.0).urgent_descent(time) for time in (71.0, 73.0)] == [BLIND_DESCENT, None], (
        "a fault of before"
    )
    assert [fail(10.0).is_settled(time) for time in (20.0, 26.0)] == [False, True]


def test_where_losses_repeat_a_state_is_missing_after_a_moment():
    assert fail(10.0).state_timeout(11.0, 0.5) == 0.5
    assert fail(10.0, 12.0).state_timeout(13.0, 0.5) < 0.2
    assert fail(10.0, 12.0).state_timeout(13.0, 0.1) == 0.1
    assert fail(10.0, 12.0).state_timeout(80.0, 0.5) == 0.5


@pytest.mark.parametrize(("force", "stands"), [(GRAVITY, True), (0.1 * GRAVITY, False), (None, False)])
def test_what_feels_its_weight_without_power_stands_on_the_ground(force, stands):
    dips = fail(10.0)
    assert not any(dips.stands(11.0 + 0.1 * i, GRAVITY) for i in range(9))
    dips.receive(12.0, powered=False)
    assert [dips.stands(12.0 + 0.1 * i, force) for i in range(3)] == [False, False, stands]


@pytest.mark.parametrize(("force", "share", "stands"), [(GRAVITY, 0.4, True), (4.0, 0.4, False), (GRAVITY, 1.0, False)])
def test_where_losses_repeat_rotors_that_carry_little_show_that_the_ground_carries(force, share, stands):
    """Nor does it rise before a loss then, which would lift it off again."""
    dips = fail(10.0, 12.0)
    assert dips.urgent_descent(13.8) < 0.0
    assert [dips.stands(13.4 + 0.1 * i, force, share) for i in range(4)] == [False, False, False, stands]
    assert (dips.urgent_descent(13.8) > 0.0) == stands
    assert not any(fail(10.0).stands(11.0 + 0.1 * i, force, share) for i in range(9)), "a single loss"


def test_losses_at_the_same_time_have_no_interval_to_expect_the_next_after():
    assert fail(10.0, 10.0, length=0.0).urgent_descent(10.0) == BLIND_DESCENT
