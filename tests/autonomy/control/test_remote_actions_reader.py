"""The axes and buttons of an operator."""

from autonomy.control import AXES, BUTTONS, RemoteActionsReader, format_actions_request


def test_a_button_counts_when_it_goes_down_and_an_axis_is_released_when_it_is_not_named():
    operator = RemoteActionsReader()
    assert operator.receive("Heading=63.5;Accelerate=1") == (["Accelerate"], [])
    assert (operator.axis("Heading"), operator.axis("Pitch")) == (0.5, 0.0)
    assert operator.receive("Accelerate=1;Thrust=-999") == ([], [])
    assert operator.axes == {"Thrust": -1.0}
    assert operator.receive("Accelerate=0") == ([], [])
    assert operator.receive("Accelerate=1;Stop=1") == (["Accelerate", "Stop"], [])


def test_what_is_not_a_number_is_named():
    operator = RemoteActionsReader()
    assert operator.receive("Heading=nan;Stop=x;Else=y") == ([], ["Heading=nan", "Stop=x"])
    assert operator.axes == {}


def test_one_system_may_be_the_only_one_and_what_there_is_is_offered():
    operator = RemoteActionsReader()
    operator.reset("src=16385")
    assert operator.source == 16385
    assert format_actions_request(BUTTONS, AXES) == (
        "Accelerate=Button;Decelerate=Button;Stop=Button;Heading=Axis;Thrust=Axis;Pitch=Axis;Roll=Axis;Ranges=Range127"
    )
