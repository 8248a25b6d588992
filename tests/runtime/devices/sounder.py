"""A task with a device, and what tests see of it."""

from collections.abc import Callable
from typing import Any

import imc
from runtime import Script, State, Task, expect, param
from runtime.kernel import WallClock
from runtime.testing import Run, simulate


class Sounder(Task):
    """Publishes the depths that a device sends, one a line."""

    kind: str = param("serial", "", "Kind of device.", choices=("serial", "tcp", "udp"))
    port: str = param("", "", "Its name.")
    number: int = param(0, "1", "Its port.")

    def start(self) -> None:
        if self.kind == "serial":
            self.sounder = self.serial(self.port, 115200, lines=self.measure, opened=self.begin)
        elif self.kind == "tcp":
            self.sounder = self.tcp(self.port, self.number, lines=self.measure, opened=self.begin)
        else:
            self.sounder = self.udp(self.number, lines=self.measure)

    def begin(self) -> None:
        self.sounder.write(b"start\n")

    def stop(self) -> None:
        self.sounder.write(b"stop\n")

    @expect(every=0.6)
    def measure(self, line: str) -> None:
        if line == "crash":
            raise RuntimeError("a mistake of the driver")
        self.publish(imc.Depth(value=float(line)))


def played(script: Callable[[Script], Any], seconds: float = 20.0, **parameters: Any) -> Run:
    """Run the task on a wall clock beside a script, which plays the device and ends the run."""

    async def until_done(script_: Script) -> None:
        await script(script_)
        script_.task.vehicle.stop()

    return simulate(
        Sounder, clock=WallClock(), seconds=seconds, script=until_done, section="Sounder", keep_going=True, **parameters
    )


async def until(script: Script, what: Callable[[], object], seconds: float = 10.0) -> None:
    for _ in range(round(seconds / 0.02)):
        if what():
            return
        await script.sleep(0.02)
    raise AssertionError("it did not come")


def sounder_of(script: Script) -> Any:
    return script.task.vehicle.task("Sounder")


def depths(run: Run) -> list[float]:
    return [message.value for message in run.of(imc.Depth)]


def states(run: Run) -> list[tuple[State, str]]:
    """The states of the entity in their order, without repetitions."""
    found = [(State(m.state), m.description) for m in run.of(imc.EntityState)]
    return [state for state, before in zip(found, [None, *found], strict=False) if state != before]
