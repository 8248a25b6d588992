"""What an operator wants: buttons and axes out of RemoteActions."""

import math
from collections.abc import Iterable

from imc.tuples import read_tuples, whole_number

FULL = 127.0  # of an axis to either side
AXES = ("Heading", "Thrust", "Pitch")
BUTTONS = ("Accelerate", "Decelerate", "Stop")


class Operator:
    """The positions of axes, -1 to 1, and the buttons that have been pressed, of one operator or of any.

    Buttons count when they go down, whatever number they stay at. An axis that is not named is released; the thrust
    stays, since buttons set it too.
    """

    def __init__(self) -> None:
        self.begin("")

    def begin(self, custom: str) -> None:
        """Begin anew; `custom` is that of Teleoperation, "src=16385" for the system that alone may steer."""
        self.source = whole_number(custom, "src")
        self.axes: dict[str, float] = {}
        self._down: set[str] = set()

    def hear(self, actions: str) -> tuple[list[str], list[str]]:
        """Take the text of RemoteActions: the buttons that go down, and what is no number."""
        values, wrong = dict[str, float](), list[str]()
        for name, text in read_tuples(actions).items():
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
        """Where an axis is, 0 where it is released."""
        return self.axes.get(name, 0.0)


def offered(buttons: Iterable[str], axes: Iterable[str]) -> str:
    """The text of RemoteActionsRequest that offers them to a console."""
    return ";".join([*(f"{b}=Button" for b in buttons), *(f"{a}=Axis" for a in axes), f"Ranges=Range{FULL:.0f}"])
