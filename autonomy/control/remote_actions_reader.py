"""An operator's buttons and axes in the text of RemoteActions."""

import math
from collections.abc import Iterable, Mapping

from imc.tuple_list import parse_tuple_list, parse_tuple_list_integer

FULL = 127.0  # full deflection of an axis, to either side
AXES = ("Heading", "Thrust", "Pitch", "Roll")
BUTTONS = ("Accelerate", "Decelerate", "Stop")


class RemoteActionsReader:
    """Positions of axes, -1 to 1, and newly pressed buttons, of one operator or of any.

    A button counts once, when it goes down. An axis that a message does not name is released; the caller keeps the
    thrust, since buttons change it too.
    """

    def __init__(self) -> None:
        self.reset("")

    def reset(self, custom: str) -> None:
        """Start over; `custom` of Teleoperation may name the only system allowed to steer, as "src=16385"."""
        self.source: int | None = parse_tuple_list_integer(custom, "src")
        self.axes: dict[str, float] = {}
        self._down: set[str] = set()

    def receive(self, actions: str) -> tuple[list[str], list[str]]:
        """Read the text of RemoteActions; returns the newly pressed buttons and the values that are not numbers."""
        values, wrong = dict[str, float](), list[str]()
        for name, text in parse_tuple_list(actions).items():
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if name in AXES or name in BUTTONS:
                if math.isfinite(value):
                    values[name] = value
                else:
                    wrong.append(f"{name}={text}")
        down = {name for name in BUTTONS if values.get(name)}
        pressed, self._down = [name for name in BUTTONS if name in down - self._down], down
        self.axes = {name: max(-1.0, min(1.0, value / FULL)) for name, value in values.items() if name in AXES}
        return pressed, wrong

    def axis(self, name: str) -> float:
        """Position of an axis, 0 if it is released."""
        return self.axes.get(name, 0.0)


def format_actions_request(buttons: Iterable[str], axes: Iterable[str]) -> str:
    """The text of RemoteActionsRequest that offers buttons and axes to a console."""
    return ";".join([*(f"{b}=Button" for b in buttons), *(f"{a}=Axis" for a in axes), f"Ranges=Range{FULL:.0f}"])


def format_remote_actions(shares: Mapping[str, float]) -> str:
    """The text of RemoteActions for axes by name, in shares of full deflection, -1 to 1."""
    return ";".join(f"{name}={round(share * FULL)}" for name, share in shares.items())
