"""Lets an operator steer a boat."""

from tasks.control.remote import RemoteControl


class RemoteOperation(RemoteControl):
    """Turns RemoteActions into thrust and heading rate, while the loop TELEOPERATION is enabled.

    Heading and Thrust are axes; Accelerate, Decelerate and Stop change the thrust. An operator who falls silent, or a
    boat without EstimatedState, leaves everything neutral.
    """
