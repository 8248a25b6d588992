"""Steering by hand: axes of a ground station as RemoteActions, while it has chosen to steer."""

import math

import imc
from mavlink import Mode, ReceivedMessage, statustext
from mavlink.vehicle.command.hold_and_abort import VehicleControl
from mavlink.vehicle.session import Session
from support.log_limit import ReportLimit

FULL = 1000.0  # full deflection of MANUAL_CONTROL
PITCH = 1  # of enabled_extensions: the axis s is valid
UNUSED = 0x7FFF
MIDDLE, SPAN = 1500.0, 400.0  # µs of RC_CHANNELS_OVERRIDE
RELEASED = (0, 0xFFFF)
RANGE = 127  # of RemoteActions
HANDOVER = 2.0  # s of silence after which another station may steer
DEFLECTED = 0.1  # share of the full deflection
REPORT_PERIOD = 20.0  # s between two texts that a stick is ignored
AIRCRAFT = "Stick ignored: an aircraft is not steered by hand"
NOT_CHOSEN = "Stick ignored: choose TELEOPERATION to steer"
STRANGER = "Another ground station steers"


class ManualControl:
    """The component of a station that steers; another one may when it has fallen silent."""

    def __init__(self, control: VehicleControl) -> None:
        self._control = control
        self._operator: tuple[Session, int, int] | None = None
        self._steered_at = -math.inf
        self._ignored = ReportLimit(REPORT_PERIOD)

    def steer_by_axes(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """MANUAL_CONTROL: x is thrust; r turns, of boats also y; z around 500, or s, is the pitch of an AUV."""
        values = message.values
        x, y, r = (_share(values[name] / FULL) if values[name] != UNUSED else 0.0 for name in "xyr")
        pitch = _share((values["z"] - FULL / 2.0) / (FULL / 2.0)) if values["z"] != UNUSED else 0.0
        if values["enabled_extensions"] & PITCH:
            pitch = _share(values["s"] / FULL)
        turn = r if r or self._control.model.dives else y
        self._steer(session, message, thrust=x, turn=turn, pitch=pitch, now=now)

    def steer_by_channels(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """RC_CHANNELS_OVERRIDE as ArduSub and ArduRover read it.

        5 is thrust, 4 turn, 3 pitch; of boats 3 is thrust and 1 turn.
        """

        def channel(number: int) -> float:
            value = message.values[f"chan{number}_raw"]
            return 0.0 if value in RELEASED else _share((value - MIDDLE) / SPAN)

        if self._control.model.dives:
            self._steer(session, message, thrust=channel(5), turn=channel(4), pitch=channel(3), now=now)
        else:
            self._steer(session, message, thrust=channel(3), turn=channel(1), pitch=0.0, now=now)

    def _steer(
        self, session: Session, message: ReceivedMessage, *, thrust: float, turn: float, pitch: float, now: float
    ) -> None:
        model = self._control.model
        if model.mode is not Mode.TELEOPERATION or model.active_guided_plan_id != "steered":
            if max(abs(thrust), abs(turn)) > DEFLECTED:
                self._report_ignored(session, message, now)
            return
        if not self._may_steer((session, message.system, message.component), now):
            session.send_statustext(statustext.WARNING, STRANGER, now)
            return
        axes = {"Heading": turn, "Thrust": thrust} | ({"Pitch": pitch} if model.dives else {})
        actions = ";".join(f"{name}={round(share * RANGE)}" for name, share in axes.items())
        self._control.publish(imc.RemoteActions(actions=actions))

    def _report_ignored(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Send the reason why a stick has no effect, now and then, unless something else moves the vehicle."""
        model = self._control.model
        if model.kind.afloat and model.mode is not Mode.MANUAL:
            return
        if self._ignored.is_due((id(session), message.system, message.component), now):
            session.send_statustext(statustext.WARNING, NOT_CHOSEN if model.kind.afloat else AIRCRAFT, now)

    def _may_steer(self, operator: tuple[Session, int, int], now: float) -> bool:
        """Whether a component may steer now: the one that does, until it falls silent."""
        if self._operator != operator and self._control.age(self._steered_at) < HANDOVER:
            return False
        self._operator, self._steered_at = operator, now
        return True


def _share(value: float) -> float:
    return max(-1.0, min(1.0, value)) if math.isfinite(value) else 0.0
