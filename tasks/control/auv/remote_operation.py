"""Lets an operator steer an underwater vehicle."""

import math
from typing import ClassVar

import imc
from autonomy.control import RemoteActionsReader
from runtime import param
from tasks.control.remote_operation_task import Enable, Loops, ThrustActionsTask


class RemoteOperation(ThrustActionsTask):
    """Turns RemoteActions into thrust, heading rate, and pitch or depth, while the loop TELEOPERATION is enabled.

    Heading, Thrust and Pitch are axes; Accelerate, Decelerate and Stop change the thrust. With Pitch released the
    vehicle holds its depth. Everything goes to neutral if the operator falls silent or EstimatedState is missing.
    """

    axes: ClassVar[tuple[str, ...]] = ("Heading", "Thrust", "Pitch")
    loops: ClassVar[int] = Loops.SPEED | Loops.YAW_RATE | Loops.PITCH

    pitch_reference: float = param(15.0, "°", "Pitch at full deflection of the axis.", minimum=0, maximum=80)

    def publish_references(self, operator: RemoteActionsReader, *, blind: bool) -> None:
        """Publish pitch, too, or hold the depth if no pitch is commanded."""
        super().publish_references(operator, blind=blind)
        share, depth = operator.axis("Pitch"), self._state.depth if self._state is not None else -1.0
        if blind or share or depth < 0.0:
            self._control(Loops.PITCH, Loops.DEPTH)
            self._kept = None
            self.publish(imc.DesiredPitch(value=share * math.radians(self.pitch_reference)))
            return
        self._control(Loops.DEPTH, Loops.PITCH)
        if self._kept is None:
            self._kept = depth
        self.publish(imc.DesiredZ(value=self._kept, z_units=imc.ZUnits.DEPTH))

    def _control(self, wanted: int, other: int) -> None:
        if self._enabled & other:
            self._switch(Enable.DISABLE, other)
            self._switch(Enable.ENABLE, wanted)
            self._enabled = self._enabled & ~other | wanted

    def _release(self) -> None:
        super()._release()
        self._kept: float | None = None
