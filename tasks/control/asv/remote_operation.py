"""Lets an operator steer a boat."""

from tasks.control.remote_operation_task import ThrustActionsTask


class RemoteOperation(ThrustActionsTask):
    """Turns RemoteActions into thrust and heading rate, while the loop TELEOPERATION is enabled.

    Heading and Thrust are axes; Accelerate, Decelerate and Stop change the thrust. Everything goes to neutral if the
    operator falls silent or EstimatedState is missing.
    """
