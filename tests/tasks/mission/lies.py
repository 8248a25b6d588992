"""Flies plans of the shipped vehicles while a sensor of theirs lies."""

import math

from flying import goto, place, plan_of
from lean import BLIND

import imc
from imc.coordinates import absolute_position
from support.wgs84 import displacement
from tests.tasks.mission.underway import Underway, underway

FAULT = 25.0  # s
DEEP = "Bathymetry:Data=0 0 120, 500 500 120, -500 -500 120"
Mode = imc.VehicleState.OpMode
HIGH = {"z": 10.0, "z_units": imc.ZUnits.ALTITUDE}
GENTLE = {"z": 20.0, "z_units": imc.ZUnits.DEPTH, "amplitude": 15.0, "pitch": math.radians(3.0), "speed": 1.2}
FLIGHTS = {
    "lauv-noptilus-1": (plan_of(goto(300, 0, 6.0)), (DEEP, BLIND)),
    "lauv-noptilus-1, in the basin": (plan_of(goto(80, 40, 6.0)), (BLIND,)),
    "lauv-noptilus-1, gently": (plan_of(imc.YoYo(**place(3000, 0), **GENTLE)), (DEEP, BLIND)),
    "otter": (plan_of(goto(300, 0)), ()),
    "caravel": (plan_of(goto(300, 0)), ()),
    "hexa-00": (
        plan_of(imc.Takeoff(**place(0, 0), **HIGH, speed=2.0), imc.Goto(**place(300, 0), **HIGH, speed=4.0)),
        (),
    ),
}
DEPTH, AHRS, DVL, GPS = (f"Simulators.{name}" for name in ("DepthSensor", "IMU/AHRS", "DVL", "GPS"))
NAVIGATION = "Navigation.UAV.Navigation"
SOUNDER, MOTOR, BAROMETER = "Simulators.Environment", "Simulators.Motor", "Simulators.Barometer"
FAR = math.radians(0.0684)  # 7.6 km


def lies(task, kind, *changes, times=math.inf):
    """From FAULT on, the task publishes other values of a type: a number stays, a function changes, None sticks."""

    def inject(vehicle):
        sensor, count, held = vehicle.task(task), 0, {}
        honest = sensor.publish

        def publish(message, **options):
            nonlocal count
            if type(message) is kind and count < times:
                count += 1
                now = vehicle.kernel.now_ns * 1e-9 - vehicle.start_time - FAULT
                for field, lie in changes:
                    true = held.setdefault(field, getattr(message, field))
                    value = true if lie is None else lie(getattr(message, field), now) if callable(lie) else lie
                    message = message.replace(**{field: value})
            return honest(message, **options)

        sensor.publish = publish

    return inject


def gaps(task, period, silent):
    """From FAULT on, the task says nothing for `silent` of each `period` s."""

    def inject(vehicle):
        sensor = vehicle.task(task)
        at_once = sensor.publish

        def publish(message, **options):
            now = vehicle.kernel.now_ns * 1e-9 - vehicle.start_time - FAULT
            return message if now % period < silent else at_once(message, **options)

        sensor.publish = publish

    return inject


def all_of(*injections):
    """Several faults at once."""

    def inject(vehicle):
        for one in injections:
            one(vehicle)

    return inject


def late(task, seconds):
    """From FAULT on, all that the task publishes comes late."""

    def inject(vehicle):
        sensor = vehicle.task(task)
        at_once = sensor.publish

        def publish(message, **options):
            vehicle.kernel.after(seconds, lambda: at_once(message, **options))
            return message

        sensor.publish = publish

    return inject


def fixes_under_water(vehicle):
    """A strange receiver: three fixes 7.6 km north."""
    lat, lon = math.radians(41.185) + FAR, math.radians(-8.7062)
    fix = imc.GpsFix(validity=0x1FF, lat=lat, lon=lon, satellites=8, hdop=0.9, hacc=2.0)
    for delay in (10.0, 11.0, 12.0):
        vehicle.kernel.after(delay, vehicle.task(GPS).publish, fix)


def before(flight: str) -> Underway:
    """A vehicle as it is when it begins to lie."""
    plan, settings = FLIGHTS[flight]
    return underway(flight.partition(",")[0], plan, FAULT, *settings)


class Flight:
    """What comes of a lie: the largest errors of the estimate, modes, errors, depths, descriptions.

    It ends after `seconds` from the start, or when a multirotor in error has been on the ground for 10 s.
    """

    def __init__(self, state: Underway, folder, inject, seconds=50.0):
        self.vehicle = vehicle = state.go_on(folder)
        self.modes, self.errors, self.said, self.depths, self.failed, self.truth = [], [], set(), [], math.inf, None
        self.aloft, self.astray, self.wrong_depth, self.touchdown = math.inf, 0.0, 0.0, 0.0
        self.variances = []
        vehicle.observe(imc.VehicleState, self._note)
        vehicle.observe(imc.SimulatedState, self._measure)
        vehicle.observe(imc.EstimatedState, self._compare)
        vehicle.observe(imc.EntityState, lambda state: self.said.add(state.description))
        vehicle.observe(imc.LogBookEntry, self._read)
        vehicle.observe(imc.NavigationUncertainty, lambda sure: self.variances.append((sure.x, sure.z)))
        inject(vehicle)
        vehicle.run(seconds - FAULT)
        vehicle.close()

    def _note(self, state):
        after = state.timestamp - self.vehicle.start_time - FAULT
        if after >= 0.0:
            self.modes.append(Mode(state.op_mode))
            if state.op_mode == Mode.ERROR:
                self.failed = min(self.failed, after)
                self.errors.append(state.last_error)

    def _measure(self, truth):
        self.truth = truth
        self.depths.append(truth.z)
        if truth.z < -0.1:
            self.aloft = truth.timestamp
        elif self.errors and truth.timestamp > self.aloft + 10.0:
            self.vehicle.stop()  # it has landed

    def _read(self, entry):
        if entry.text.startswith("touchdown"):
            self.touchdown = max(self.touchdown, float(entry.text.split()[-2]))

    def _compare(self, state):
        if self.truth is None:
            return
        north, east, _ = displacement(self.truth.lat, self.truth.lon, 0.0, *absolute_position(state)[:2], 0.0)
        self.astray = max(self.astray, math.hypot(north - self.truth.x, east - self.truth.y))
        self.wrong_depth = max(self.wrong_depth, abs(state.z - self.truth.z))
