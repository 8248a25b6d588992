"""Flies the profile hexa-00 with its full simulation."""

import math
import tempfile
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from lean import UNLOGGED

import imc
from runtime.kernel import VirtualClock
from runtime.snapshot import InputJournals, restore, take_snapshot
from runtime.snapshot import load as load_snapshot
from shoal.missions import parse_plan, prepare

HEAD = "origin: 41.185°, -8.7062°\nspeed: 5 m/s\naltitude: 20\nmaneuvers:\n"
HOVER = parse_plan(
    "plan: hover\n" + HEAD + "  - takeoff: {altitude: 15}\n  - station_keeping: {north: 30, altitude: 15}"
)
OWN, CCU = 0x0C30, 0x4000
START = 5.0


def load(kilograms):
    """An event that adds a load to the vehicle, or takes one away."""

    def hang(vehicle):
        craft = vehicle.task("Simulators.UAV").craft
        craft.airframe = replace(craft.airframe, mass=craft.airframe.mass + kilograms)

    return hang


@dataclass
class Heard:
    """What a vehicle has published: its true states, voltages, currents, changes of mode, texts of the log book."""

    truths: list[imc.SimulatedState] = field(default_factory=list)
    volts: list[float] = field(default_factory=list)
    amperes: list[float] = field(default_factory=list)
    modes: list[str] = field(default_factory=list)
    op_modes: list[str] = field(default_factory=list)
    log: list[str] = field(default_factory=list)

    def observe(self, vehicle):
        vehicle.observe(imc.SimulatedState, self.truths.append)
        vehicle.observe(imc.Voltage, lambda m: self.volts.append(m.value))
        vehicle.observe(imc.Current, lambda m: self.amperes.append(m.value))
        vehicle.observe(imc.AutopilotMode, lambda m: self.change_mode(m.mode))
        vehicle.observe(imc.VehicleState, lambda m: self._note(self.op_modes, imc.VehicleState.OpMode(m.op_mode).name))
        vehicle.observe(imc.LogBookEntry, lambda m: self.log.append(m.text))

    def change_mode(self, mode):
        """Note a mode of the autopilot; whether it is another one."""
        return self._note(self.modes, mode)

    @staticmethod
    def _note(found, word):
        is_new = found[-1:] != [word]
        if is_new:
            found.append(word)
        return is_new


def vehicle_in(folder, overrides, **options):
    return prepare(
        "hexa-00", overrides=overrides, log_root=folder / "log", state_folder=folder / "db", **options
    ).vehicle


def publish(vehicle, message):
    packet = imc.encode_with_header(message, vehicle.kernel.now_ns / 1e9, message.src, 0xFF, message.dst, 0xFF)
    vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)


def begin(vehicle, plan):
    """The vehicle has just been asked to carry out a plan."""
    vehicle.start()
    vehicle.run(START)
    publish(vehicle, imc.PlanControl(op=imc.PlanControl.Op.START, plan_id=plan.plan_id, arg=plan, dst=OWN, src=CCU))


@cache
def hovering(moment, overrides):
    """How a vehicle is at a moment (s) of the plan to hover, for flights that go on from it, and what it published."""
    heard = Heard()
    with tempfile.TemporaryDirectory() as folder:
        vehicle = vehicle_in(Path(folder), overrides)
        InputJournals(vehicle)
        heard.observe(vehicle)
        begin(vehicle, HOVER)
        vehicle.run(moment - START)
        state = load_snapshot(take_snapshot(vehicle))
        vehicle.close()
    return state, heard


class Flight(Heard):
    """A hovering vehicle with events: a message, a task that becomes silent, or what is done to the vehicle.

    With `until_down` the flight ends 5 s after landing. There is no log unless it is `logged`.
    """

    def __init__(self, folder: Path, *events, seconds, overrides=(), plan=HOVER, until_down=False, logged=False):
        super().__init__()
        overrides = tuple(overrides) if logged else (UNLOGGED, *overrides)
        began = min((at for at, _ in events), default=0.0)
        self._until_down = until_down
        if plan is HOVER and began > START and not logged:
            state, heard = hovering(began, overrides)
            vars(self).update({name: list(found) for name, found in vars(heard).items()})
            self.vehicle = vehicle_in(folder, overrides, clock=VirtualClock(state.time))
            restore(self.vehicle, state)
            self.observe(self.vehicle)
        else:
            began = START
            self.vehicle = vehicle_in(folder, overrides)
            self.observe(self.vehicle)
            begin(self.vehicle, plan)
        for at, event in events:
            self.vehicle.kernel.after(at - began, self._happen, event)
        self.vehicle.run(seconds - began)
        self.vehicle.close()

    def _happen(self, event):
        if isinstance(event, str):
            self.vehicle.task(event).cancel_callbacks()
        elif callable(event):
            event(self.vehicle)
        else:
            publish(self.vehicle, event)

    def change_mode(self, mode):
        is_new = super().change_mode(mode)
        if self._until_down and is_new and mode == "GROUND" and len(self.modes) > 1:
            self.vehicle.kernel.after(5.0, self.vehicle.stop)
        return is_new

    @property
    def end(self):
        return self.truths[-1]

    @property
    def touchdown(self):
        """The hardest touchdown (m/s)."""
        return max((float(text.split()[-2]) for text in self.log if text.startswith("touchdown")), default=math.inf)
