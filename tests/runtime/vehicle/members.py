"""Small vehicles for a fleet in one process."""

import imc
from runtime import State, Task, consume, param, periodic
from runtime.kernel import SECOND, VirtualClock
from runtime.testing import START, NoProfile
from runtime.vehicle import Fleet, Vehicle


class Diver(Task):
    """Publishes noisy depths at a rate, and answers messages with a script."""

    rate: float = param(10.0, "Hz", "Rate.", minimum=0.0)
    patience: float = param(0.3, "s", "Time between hearing and answering.")
    leaves_after: float = param(0.0, "s", "When it stops the vehicle; 0 is never.")
    stumbles_after: float = param(0.0, "s", "When it fails; 0 is never.")

    def start(self) -> None:
        self.set_entity_state(State.NORMAL, "active")
        if self.leaves_after:
            self.after(self.leaves_after, self.vehicle.stop)
        if self.stumbles_after:
            self.after(self.stumbles_after, self.stumble)

    def stop(self) -> None:
        self.publish(imc.Depth(value=-1.0))

    def stumble(self) -> None:
        raise ValueError("a stone")

    @periodic("rate")
    def tick(self) -> None:
        self.publish(imc.Depth(value=self.random.normal()))

    @consume
    def answer(self, depth: imc.Depth) -> None:
        self.start_script(self.wait, depth.value)

    async def wait(self, script, value) -> None:
        await script.sleep(self.patience)
        script.publish(imc.Temperature(value=value))


class Echo(Task):
    """Answers immediately, and again a little later."""

    def start(self) -> None:
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def hear(self, depth: imc.Depth) -> None:
        self.publish(imc.Salinity(value=depth.value))
        self.after(0.05, self.publish, imc.Pressure(value=depth.value))


class Impatient:
    """An instrument that stops a vehicle at some time, as a mission does."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.lost = False

    def lose_patience(self) -> None:
        self.lost = True
        self.vehicle.stop()


def vehicle(name, *, seed=0, keep_going=False, clock=None, fleet=None, tasks=(Diver, Echo), **values):
    if fleet is None and clock is None:
        clock = VirtualClock(START * SECOND)
    made = Vehicle(name, 1, clock=clock, fleet=fleet, profile=NoProfile(), seed=seed, keep_going=keep_going)
    for task in tasks:
        made.add(task, f"Test.{task.__name__}", **(values if task is Diver else {}))
    return made


def recorded(made):
    packets = []
    made.observe(imc.Message, lambda _, packet: packets.append(packet), packets=True)
    return packets


def alone(seconds, name, **how):
    made = vehicle(name, **how)
    packets = recorded(made)
    made.start()
    made.run(seconds)
    made.close()
    return packets


def run(fleet, seconds):
    with fleet:
        fleet.start()
        fleet.run(seconds)


def together(seconds, members):
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        packets = {name: recorded(vehicle(name, fleet=fleet, **how)) for name, how in members}
        fleet.start()
        fleet.run(seconds)
    return packets
