"""A fault of any sensor or actuator of the simulated AUV leads to the mode given in docs/mission.md."""

import math
import re
from functools import cache
from pathlib import Path

import pytest
from flying import CCU, DEPTH, OWN, goto, place, plan_of
from lean import BLIND

import imc
from tests.tasks.mission.underway import say, underway

FAULT, END = 25.0, 36.0  # s
PLANS = {
    "legs": plan_of(goto(60, 0, 2.0)),
    "station": plan_of(imc.StationKeeping(**place(5, 0), z=2.0, z_units=DEPTH, radius=15.0, speed=1.2, duration=25)),
}
Mode = imc.VehicleState.OpMode


def fails():
    raise RuntimeError("broken")


def silent(task):
    """The sensor publishes nothing more; its entity state stays the same."""
    return lambda vehicle: vehicle.task(task).cancel_callbacks()


def broken(task):
    """The sensor's task fails, and restarts a second later."""

    def inject(vehicle):
        vehicle.kernel.after(0.0, fails).owner = vehicle.task(task)

    return inject


def stuck(*numbers, value=0.4):
    """The servos report a position of their own, and the fins are there."""

    def inject(vehicle):
        servos = vehicle.task("Simulators.Servos")
        honest = servos.publish

        def publish(message, **options):
            if isinstance(message, imc.ServoPosition) and message.id in numbers:
                message = message.replace(value=value)
            return honest(message, **options)

        servos.publish = publish

    return inject


def says(message):
    return lambda vehicle: say(vehicle, message.replace(dst=OWN, dst_ent=0xFF))


LEAK = imc.LeakSimulation(op=imc.LeakSimulation.Op.ON)
# fault -> the last error, and the longest time to it (s)
ENDS = {
    "AHRS silent": (silent("Simulators.IMU/AHRS"), "Navigation: attitude is missing", 2.1),
    "AHRS fails": (broken("Simulators.IMU/AHRS"), "AHRS: RuntimeError: broken", 0.1),
    "depth sensor silent": (silent("Simulators.DepthSensor"), "Navigation: depth is missing", 5.1),
    "depth sensor fails": (broken("Simulators.DepthSensor"), "Depth Sensor: RuntimeError: broken", 0.1),
    "DVL fails": (broken("Simulators.DVL"), "DVL: RuntimeError: broken", 0.1),
    "GPS fails": (broken("Simulators.GPS"), "GPS: RuntimeError: broken", 0.1),
    "altimeter and echo sounder fail": (broken("Simulators.Environment"), "entity errors: Altimeter", 1.1),
    "motor silent": (silent("Simulators.Motor"), "Speed Control: no Rpm for 2 s", 3.1),
    "motor fails": (broken("Simulators.Motor"), "Motor: RuntimeError: broken", 0.1),
    "servos silent": (silent("Simulators.Servos"), "Allocator: no position from servo 0, 1, 2, 3", 4.1),
    "one servo stuck": (stuck(0), "Allocator: servo 0 not at the commanded angle", 4.1),
    "both pitch servos stuck": (stuck(1, 2), "Attitude: pitch does not follow its reference", 4.1),
    "servos without a number": (stuck(3, value=math.nan), "Allocator: servo 3 not at the commanded angle", 4.1),
    "servos fail": (broken("Simulators.Servos"), "Servos: RuntimeError: broken", 0.1),
    "leak": (says(LEAK), "Leak Sensor - Tail: leak detected", 0.1),
    "navigation fails": (broken("Navigation.AUV.Navigation"), "Navigation: RuntimeError: broken", 0.1),
}
# fault -> the entity that reports it, and its description
GOES_ON = {
    "DVL silent": (silent("Simulators.DVL"), "Navigation", "active without DVL"),
    "GPS silent": (silent("Simulators.GPS"), "Navigation", "active"),
    "altimeter and echo sounder silent": (silent("Simulators.Environment"), "Navigation", "active without altitude"),
    "battery silent": (silent("Simulators.Battery"), "Fuel Monitor", "no Current for 10 s"),
    "battery fails": (broken("Simulators.Battery"), "Batteries", "active"),
}


class Flight:
    """The result of a plan with a fault: when (s after it) the plan failed, modes after it, errors, descriptions.

    `loops` are the control loops that are enabled at the end.
    """

    def __init__(self, state, folder, inject, end):
        self.vehicle = vehicle = state.go_on(folder)
        self.failed, self.modes, self.errors, self.depths = [], [], [], []
        vehicle.observe(imc.VehicleState, self._note)
        vehicle.observe(imc.PlanControl, self._note_reply)
        vehicle.observe(imc.SimulatedState, self._measure)
        inject(vehicle)
        vehicle.run(end - FAULT)
        self.descriptions = {entity.label: entity.description for entity in vehicle.entities}
        self.loops = vehicle.task("Control.Path.VectorField")._loops.mask
        vehicle.close()

    def _after(self, message):
        return message.timestamp - self.vehicle.start_time - FAULT

    def _note(self, state):
        if self._after(state) > 0.0:
            self.modes.append(Mode(state.op_mode))
            self.errors.append(state.last_error)

    def _note_reply(self, reply):
        if reply.dst == CCU and reply.type == imc.PlanControl.Type.FAILURE:
            self.failed.append(self._after(reply))

    def _measure(self, state):
        self.depths.append(state.z)


@pytest.fixture(scope="module")
def fly():
    """Flies a plan on from the fault, up to which all are the same."""
    state = cache(lambda plan: underway("lauv-noptilus-1", PLANS[plan], FAULT, BLIND))
    return lambda folder, inject, end, plan="legs": Flight(state(plan), folder, inject, end)


@pytest.mark.parametrize("fault", ENDS)
def test_a_fault_ends_the_plan_in_error_and_the_vehicle_comes_up(fault, fly, tmp_path):
    inject, error, seconds = ENDS[fault]
    flight = fly(tmp_path, inject, END)
    assert flight.failed
    assert 0.0 <= flight.failed[0] <= seconds
    assert Mode.ERROR in flight.modes
    assert Mode.MANEUVER not in flight.modes[flight.modes.index(Mode.ERROR) :]
    assert error in flight.errors
    assert flight.depths[-1] < max(0.3, flight.depths[-200]), "it is at the surface, or has risen in the last 2 s"


def test_a_maneuver_whose_task_fails_ends_the_plan_at_once(fly, tmp_path):
    flight = fly(tmp_path, broken("Maneuver.Goto"), 30.0)
    assert flight.failed[0] < 0.1
    assert set(flight.modes) <= {Mode.MANEUVER, Mode.SERVICE}
    assert flight.errors[-1] == "Goto maneuver error: its task has failed: RuntimeError: broken"


def test_a_plan_ends_whose_engine_fails_and_restarts(fly, tmp_path):
    flight = fly(tmp_path, broken("Plan.Engine"), END)
    assert 1.0 <= flight.failed[0] <= 1.1, "the console that started it hears of it after the restart"
    assert flight.modes[-1] == Mode.SERVICE
    assert flight.loops == 0
    assert flight.depths[-1] < max(0.3, flight.depths[-200])


@pytest.mark.heavy
@pytest.mark.parametrize("fault", [broken("Maneuver.Idle"), silent("Maneuver.Idle")])
def test_no_loop_stays_enabled_after_a_plan_whose_last_maneuver_was_steering(fault, fly, tmp_path):
    """A restarted task does not know of the loops; one that is silent does not disable them."""
    flight = fly(tmp_path, fault, 60.0, "station")
    assert flight.modes[-1] == Mode.SERVICE
    assert flight.loops == 0


@pytest.mark.parametrize("fault", GOES_ON)
def test_a_fault_that_the_vehicle_can_bear_is_said(fault, fly, tmp_path):
    inject, label, description = GOES_ON[fault]
    flight = fly(tmp_path, inject, END if fault != "battery silent" else 41.0)
    assert set(flight.modes) == {Mode.MANEUVER}
    assert not flight.failed
    assert flight.descriptions[label] == description


def test_all_faults_are_in_the_docs():
    page = (Path(__file__).parents[3] / "docs" / "mission.md").read_text(encoding="utf-8")
    rows = set(re.findall(r"^\| ([\w ]+) \|", page, re.MULTILINE))
    assert {*ENDS, *GOES_ON} <= rows
