"""Common parts of remote operation: the operator's axes and buttons; on and under water thrust and heading rate."""

import math
from collections.abc import Sequence
from typing import ClassVar

import imc
from autonomy.control import BUTTONS, EnabledLoops, MessageDelay, RemoteActionsReader, format_actions_request
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime import State, Task, consume, param, periodic

Loops = imc.CLoopsMask
Enable = imc.ControlLoops.Enable
STEP = 0.1  # fraction of the largest thrust, for Accelerate and Decelerate
MOST_SENDERS = 16


class RemoteActionsTask(Task):
    """Turns RemoteActions into references, while the loop TELEOPERATION is enabled.

    `axes` and `buttons` are offered to the operator; `loops` are enabled at the start. Everything goes to neutral if
    the operator falls silent or EstimatedState is missing. Actions that come late are not obeyed.
    """

    axes: ClassVar[tuple[str, ...]] = ("Heading", "Thrust")
    buttons: ClassVar[tuple[str, ...]] = ()
    loops: ClassVar[int] = Loops.SPEED | Loops.YAW_RATE

    execution_frequency: float = param(10.0, "Hz", "Rate of the references.", minimum=1, maximum=100)
    connection_timeout: float = param(2.0, "s", "Longest time without RemoteActions.", minimum=0.1)
    longest_delay: float = param(
        1.5,
        "s",
        "RemoteActions that come later than the fastest by more are not obeyed.",
        name="Longest Delay",
        minimum=0.1,
    )
    state_timeout: float = param(
        2.0, "s", "Longest time without EstimatedState.", name="EstimatedState Timeout", minimum=0.1
    )
    maximum_heading_rate: float = param(40.0, "°/s", "Heading rate at full deflection of the axis.", minimum=0)

    def configure(self) -> None:
        self._offer = format_actions_request(["Exit", *self.buttons], self.axes)

    def start(self) -> None:
        self._loops = EnabledLoops(Loops.TELEOPERATION)
        self._operator = RemoteActionsReader()
        self._delays: dict[int, MessageDelay] = {}
        self._received_at = self._located = -math.inf
        self._delay = 0.0
        self._state: imc.EstimatedState | None = None
        self._release()
        self.publish(imc.RemoteActionsRequest(op=imc.RemoteActionsRequest.Op.REPORT, actions=self._offer))
        self.set_entity_state(State.NORMAL, "idle")

    @consume(others=True)
    def report_actions(self, request: imc.RemoteActionsRequest) -> None:
        """Report the available actions."""
        if request.op == imc.RemoteActionsRequest.Op.QUERY and request.dst in (self.system, UNKNOWN_SYSTEM):
            self.reply(request, imc.RemoteActionsRequest(op=request.Op.REPORT, actions=self._offer))

    @consume
    def reset_operator_input(self, teleoperation: imc.Teleoperation) -> None:
        self._operator.reset(teleoperation.custom)

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if not self._loops.receive(loops):
            return
        if self._loops.mask:
            self._release()
            self._delays, self._delay = {}, 0.0
            self._received_at = self.now
            self._enabled = int(self.loops)
            self._switch(Enable.ENABLE, self._enabled)
            self.set_entity_state(State.NORMAL, "active")
            return
        if loops.mask != Loops.ALL and self._enabled:
            self._switch(Enable.DISABLE, self._enabled)
        self._enabled = 0
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self._located, self._state = self.now, state

    @consume(others=True)
    def apply_actions(self, actions: imc.RemoteActions) -> None:
        if not self._loops.mask or not self.is_for_me(actions):
            return
        if self._operator.source not in (None, actions.src) or self._is_late(actions):
            return
        self._received_at = self.now
        pressed, wrong = self._operator.receive(actions.actions)
        if wrong:
            self.log.warning(f"remote actions are not numbers: {', '.join(wrong)}")
        self.press_buttons(pressed)

    def press_buttons(self, pressed: Sequence[str]) -> None:
        """Act on new positions of the axes, and on buttons that go down."""

    @periodic("execution_frequency")
    def steer(self) -> None:
        if not self._loops.mask:
            return
        lost = self._lost()
        if lost:
            if self.entity.state is State.NORMAL:
                self.log.warning(lost)
            self.set_entity_state(State.FAULT, lost)
            self._release_axes()
        else:
            self.set_entity_state(State.NORMAL, "active")
        self.publish_references(self._operator, blind=bool(lost))

    def publish_references(self, operator: RemoteActionsReader, *, blind: bool) -> None:
        """Publish references of the axes; `blind` if operator or navigation is silent."""
        raise NotImplementedError

    def _is_late(self, actions: imc.RemoteActions) -> bool:
        """Whether actions were on the way for so long that the operator may want something else now."""
        clock = self._kernel.clock
        if actions.src == self.system or not (clock.virtual or clock.speed == 1.0):
            return False  # a scaled clock gives way: the delay is unknown
        if not 0.0 < actions.timestamp < math.inf:
            return False  # a sender without a clock
        if actions.src not in self._delays and len(self._delays) >= MOST_SENDERS:
            del self._delays[next(iter(self._delays))]
        delay = self._delays.setdefault(actions.src, MessageDelay()).receive(self.now, actions.timestamp)
        self._delay = delay if delay > self.longest_delay else 0.0
        return bool(self._delay)

    def _lost(self) -> str:
        """The input that has been missing for too long; empty if none."""
        if self.age(self._received_at) > self.connection_timeout:
            late = f": the latest came {self._delay:.1f} s late" if self._delay else ""
            return f"no remote action for {self.connection_timeout:g} s{late}"
        if self.age(self._located) > self.state_timeout:
            return f"no EstimatedState for {self.state_timeout:g} s"
        return ""

    def _release(self) -> None:
        self._release_axes()
        self._enabled = 0

    def _release_axes(self) -> None:
        self._operator.axes = {}

    def _switch(self, enable: int, mask: int) -> None:
        self.publish(imc.ControlLoops(enable=enable, mask=mask, scope_ref=self._loops.scope))


class ThrustActionsTask(RemoteActionsTask):
    """Turns RemoteActions into thrust and heading rate."""

    buttons: ClassVar[tuple[str, ...]] = BUTTONS

    buttons_only: bool = param(False, "", "Offer buttons for thrust, but no axis.", name="Disable Analog Thrust")
    maximum_thrust: float = param(
        0.7, "1", "Actuation at full deflection of the axis.", name="Maximum Thruster Actuation", minimum=0, maximum=1
    )

    def configure(self) -> None:
        axes = [axis for axis in self.axes if axis != "Thrust" or not self.buttons_only]
        self._offer = format_actions_request(["Exit", *self.buttons], axes)

    def press_buttons(self, pressed: Sequence[str]) -> None:
        if "Thrust" in self._operator.axes and not self.buttons_only:
            self._thrust = self._operator.axis("Thrust")
        for button in pressed:
            change = {"Accelerate": STEP, "Decelerate": -STEP}.get(button, -self._thrust)
            self._thrust = max(-1.0, min(1.0, self._thrust + change))

    def publish_references(self, operator: RemoteActionsReader, *, blind: bool) -> None:
        thrust = 100.0 * self._thrust * self.maximum_thrust
        turn = operator.axis("Heading") * math.radians(self.maximum_heading_rate)
        self.publish(imc.DesiredSpeed(value=thrust, speed_units=imc.SpeedUnits.PERCENTAGE))
        self.publish(imc.DesiredHeadingRate(value=turn))

    def _release_axes(self) -> None:
        super()._release_axes()
        self._thrust = 0.0
