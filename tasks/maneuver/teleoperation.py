"""Lets an operator steer."""

import imc
from tasks.maneuver.protocol import Loops, Maneuver


class Teleoperation(Maneuver):
    """Enables remote operation until TeleoperationDone, or the action Exit."""

    loops = Loops.TELEOPERATION
    hears = ()
    hears_others = (imc.TeleoperationDone, imc.RemoteActions)

    async def execute(self, teleoperation: imc.Teleoperation) -> None:
        self.report()
        while True:
            event = await self.event()
            if event.dst not in (self.system, 0xFFFF):
                continue
            if isinstance(event, imc.TeleoperationDone):
                return
            if isinstance(event, imc.RemoteActions) and _value(event.actions, "Exit") == "1":
                return


def _value(actions: str, name: str) -> str:
    """The value of a name in IMC's "Name=value;..."."""
    pairs = (action.partition("=") for action in actions.split(";"))
    return next((value.strip() for key, _, value in pairs if key.strip() == name), "")
