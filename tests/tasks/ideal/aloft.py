"""Flies the profile hexa-00 with its full simulation."""

import math
from dataclasses import replace
from pathlib import Path

from lean import UNLOGGED

import imc
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


class Flight:
    """A hovering vehicle with events: a message, a task that becomes silent, or what is done to the vehicle.

    With `until_down` the flight ends 5 s after landing. There is no log unless it is `logged`.
    """

    def __init__(self, folder: Path, *events, seconds, overrides=(), plan=HOVER, until_down=False, logged=False):
        overrides = overrides if logged else (UNLOGGED, *overrides)
        places = {"log_root": folder / "log", "state_folder": folder / "db"}
        self.vehicle = prepare("hexa-00", overrides=overrides, **places).vehicle
        self.truths, self.modes, self.log, self.op_modes = [], [], [], []
        self.vehicle.observe(imc.SimulatedState, self.truths.append)
        self.volts, self.amperes = [], []
        self.vehicle.observe(imc.Voltage, lambda m: self.volts.append(m.value))
        self.vehicle.observe(imc.Current, lambda m: self.amperes.append(m.value))
        self.vehicle.observe(imc.AutopilotMode, lambda m: self._note(self.modes, m.mode))
        self._until_down = until_down
        self.vehicle.observe(
            imc.VehicleState, lambda m: self._note(self.op_modes, imc.VehicleState.OpMode(m.op_mode).name)
        )
        self.vehicle.observe(imc.LogBookEntry, lambda m: self.log.append(m.text))
        self.vehicle.start()
        start = imc.PlanControl(op=imc.PlanControl.Op.START, plan_id=plan.plan_id, arg=plan, dst=OWN, src=CCU)
        for at, event in ((START, start), *events):
            self.vehicle.kernel.after(at, self._happen, event)
        self.vehicle.run(seconds)
        self.vehicle.close()

    def _happen(self, event):
        if isinstance(event, str):
            self.vehicle.task(event).cancel_callbacks()
        elif callable(event):
            event(self.vehicle)
        else:
            packet = imc.encode_with_header(event, self.vehicle.kernel.now_ns / 1e9, event.src, 0xFF, event.dst, 0xFF)
            self.vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    def _note(self, found, word):
        if found[-1:] != [word]:
            found.append(word)
            if self._until_down and found is self.modes and word == "GROUND" and len(found) > 1:
                self.vehicle.kernel.after(5.0, self.vehicle.stop)

    @property
    def end(self):
        return self.truths[-1]

    @property
    def touchdown(self):
        """The hardest touchdown (m/s)."""
        return max((float(text.split()[-2]) for text in self.log if text.startswith("touchdown")), default=math.inf)
