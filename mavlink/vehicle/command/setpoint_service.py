"""Messages that move the vehicle without being commands: modes, guided items, targets, a joystick."""

import math
from collections.abc import Mapping

from mavlink import Mode, ReceivedMessage, statustext
from mavlink.missions import BadItem, Item, MissionResult
from mavlink.vehicle.command.guided_commands import NO_PLACE, go_to
from mavlink.vehicle.command.manual_control import ManualControl
from mavlink.vehicle.command.request import CommandRequest, CommandResult, MavResult
from mavlink.vehicle.command.vehicle_commands import COMMANDS, CommandTargets, set_mode
from mavlink.vehicle.mission import acknowledge
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session

ARM = 400  # MAV_CMD_COMPONENT_ARM_DISARM
GUIDED, ALTITUDE_ONLY = 2, 3  # field current of an item that is an order


class SetpointService(MavlinkService):
    """Setpoints that move the vehicle, besides commands and missions."""

    def __init__(self, targets: CommandTargets) -> None:
        self._targets = targets
        self._manual = ManualControl(targets.control)

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {
            "SET_MODE": self._set_mode,
            "SET_POSITION_TARGET_GLOBAL_INT": self._targets.offboard.receive,
            "SET_POSITION_TARGET_LOCAL_NED": self._targets.offboard.receive,
            "SET_ATTITUDE_TARGET": self._targets.offboard.receive,
            "MANUAL_CONTROL": self._manual_control,
            "RC_CHANNELS_OVERRIDE": self._manual.steer_by_channels,
        }

    def check_timeouts(self, now: float) -> None:
        self._targets.offboard.repeat_target_or_hold(now)

    def execute_guided_item(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Go to an item, or only to its altitude: Mission Planner and MAVProxy send a vehicle in this way."""

        def finish(reply: CommandResult) -> None:
            done = reply.result is MavResult.ACCEPTED
            acknowledge(session, message, MissionResult.ACCEPTED if done else MissionResult.ERROR)
            if reply.reason:
                session.send_statustext(statustext.WARNING, reply.reason, now)

        try:
            item = (Item.of_legacy if message.name == "MISSION_ITEM" else Item.of)(message.values)
        except BadItem as bad:
            finish(CommandResult(MavResult.DENIED, str(bad)))
            return
        control = self._targets.control
        control.model.command_count += 1
        place = math.radians(item.x * 1e-7), math.radians(item.y * 1e-7)
        moves = message.values["current"] == GUIDED
        reply = go_to(control, place if moves else NO_PLACE, item.frame, item.z, -1.0, finish, now)
        if reply is not None:
            finish(reply)

    def _set_mode(self, session: Session, message: ReceivedMessage, now: float) -> None:
        def finish(reply: CommandResult) -> None:
            if reply.result is not MavResult.ACCEPTED:
                session.send_statustext(statustext.WARNING, reply.reason, now)

        model = self._targets.control.model
        model.command_count += 1
        number = message.values["custom_mode"]
        reply = set_mode(self._targets, session, session.flavor.mode(model.kind, number), number, finish, now)
        if reply is not None:
            finish(reply)

    def _manual_control(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """The axes steer; the buttons have the functions of the profile, in each mode."""
        targets, values = self._targets, message.values
        control = targets.control
        if values["target"] not in (0, control.model.system):
            return
        self._manual.steer_by_axes(session, message, now)

        def act(action: str) -> None:
            def finish(reply: CommandResult) -> None:
                if reply.reason:
                    session.send_statustext(statustext.WARNING, reply.reason, now)

            control.model.command_count += 1
            if action == "abort":
                control.abort(now)
                return
            order = CommandRequest(ARM, (0.0,) * 7, None, finish)
            reply = (
                COMMANDS[ARM](targets, session, order, now)
                if action == "disarm"
                else set_mode(targets, session, Mode[action.upper()], -1, finish, now)
            )
            if reply is not None:
                finish(reply)

        pressed = values["buttons"] | values["buttons2"] << 16
        targets.relays.execute_button_actions((session, message.system, message.component), pressed, now, act)


def is_guided_item(message: ReceivedMessage) -> bool:
    """Whether an item is an order to go there instead of a part of a mission."""
    names = "MISSION_ITEM", "MISSION_ITEM_INT"
    return message.name in names and message.values["current"] in (GUIDED, ALTITUDE_ONLY)
