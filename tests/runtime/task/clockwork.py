"""A task that ticks."""

from runtime import Task, param, periodic


class Clockwork(Task):
    """Ticks at a rate."""

    rate: float = param(10.0, "Hz", "Ticks per second.", minimum=0.0)

    def configure(self):
        self.ticks = []

    @periodic("rate")
    def tick(self) -> None:
        self.ticks.append(self.now_ns)
