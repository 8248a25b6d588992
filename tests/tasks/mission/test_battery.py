"""The battery of the AUV runs low and empty: see docs/mission.md."""

import math
import re

import pytest
from flying import CCU, OWN, control, plan_of
from lean import BLIND, UNLOGGED

import imc
from shoal.missions import prepare
from support import wgs84

Mode = imc.VehicleState.OpMode
START = 10.0  # s
PLACE = 41.05, -9.1  # °, in 120 m of water
LEAN = (
    UNLOGGED,
    BLIND,
    f"Simulators.GPS:Initial Position={PLACE[0]}, {PLACE[1]}",
)
LAT, LON, _ = wgs84.displace(*map(math.radians, PLACE), 0.0, 2000.0, 0.0)
PLAN = plan_of(imc.Goto(lat=LAT, lon=LON, z=5.0, z_units=imc.ZUnits.DEPTH, speed=1.4))
TRUSTED = "Simulators.Battery:Error Level=0"  # the battery does not say that it is low
EMPTY = 0.22  # %, enough for the first half of a minute of the dive


class Dive:
    """A dive of the AUV: true depths and speeds twice a second, voltages, modes, replies, and the log book."""

    def __init__(self, folder, *overrides, seconds):
        folders = {"log_root": folder / "log", "state_folder": folder / "db"}
        self.vehicle = vehicle = prepare("lauv-noptilus-1", overrides=(*LEAN, *overrides), **folders).vehicle
        vehicle.keep_going = True
        self.depths, self.speeds, self.volts, self.modes, self.replies, self.log = [], [], [], [], [], []
        vehicle.observe(imc.Voltage, lambda m: self.volts.append(m.value))
        vehicle.observe(imc.VehicleState, lambda m: self.modes.append(Mode(m.op_mode)))
        vehicle.observe(imc.PlanControl, lambda m: self.replies.append(m.info) if m.dst == CCU else None)
        vehicle.observe(imc.LogBookEntry, lambda m: self.log.append(m.text))
        vehicle.start()
        vehicle.run(START)
        start = control(imc.PlanControl.Op.START, -1.0, PLAN.plan_id, 1, arg=PLAN)
        packet = imc.encode_with_header(start, vehicle.kernel.now_ns * 1e-9, CCU, 3, OWN, 0xFF)
        vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)
        craft = vehicle.task("Simulators.VSIM").craft
        for _ in range(round(2 * (seconds - START))):
            vehicle.run(0.5)
            self.depths.append(craft.z)
            self.speeds.append(craft.u)
        self.actuations, self.failures = craft.actuations, vehicle.failures
        vehicle.close()


def test_a_plan_is_refused_with_the_reserve_of_the_battery(tmp_path):
    dive = Dive(tmp_path, "Monitors.FuelLevel:Initial Level=9.9", seconds=12.0)
    assert dive.replies == ["the battery is below its reserve of 10 %"]


def test_a_plan_is_refused_if_the_battery_itself_says_that_it_is_low(tmp_path):
    dive = Dive(tmp_path, "Simulators.Battery:Initial Level=5", seconds=12.0)
    assert dive.replies == ["the battery is below its reserve of 10 %"]
    assert "Batteries: fuel reserve: 9 %" in dive.log


def test_a_plan_that_would_need_the_reserve_is_refused(tmp_path):
    dive = Dive(tmp_path, "Monitors.FuelLevel:Initial Level=14", seconds=12.0)
    (reply,) = dive.replies
    assert re.fullmatch(r"the plan needs \d+ W h and the battery has 28 W h above its reserve", reply)


@pytest.mark.heavy
def test_a_plan_ends_at_the_reserve_and_the_vehicle_comes_up(tmp_path):
    endless = ("Plan.Engine:Fuel Prediction=false", "Monitors.FuelLevel:Initial Level=10.1")
    dive = Dive(tmp_path, *endless, seconds=100.0)
    assert dive.replies[-1] == "the battery is below its reserve of 10 %"
    assert any(text.startswith("fuel is running low: 10 %") for text in dive.log)
    assert dive.modes[-1] is Mode.SERVICE
    assert max(dive.depths) > 3.0
    assert dive.depths[-1] < dive.depths[-20] - 0.3


@pytest.mark.heavy
def test_an_empty_battery_moves_nothing_and_the_vehicle_drifts_up(tmp_path):
    dive = Dive(tmp_path, TRUSTED, f"Simulators.Battery:Initial Level={EMPTY}", seconds=100.0)
    assert not dive.failures
    assert dive.volts[0] > 20.0
    assert dive.volts[-1] == 0.0
    assert max(dive.speeds) > 1.2
    assert dive.speeds[-1] < 0.1
    assert dive.actuations == [0.0]
    assert max(dive.depths) > 3.0
    assert dive.depths[-1] < dive.depths[-20] - 0.3
    assert Mode.MANEUVER not in dive.modes[-10:]
    assert "no power: the battery is empty" in dive.log
    assert "the battery is below its reserve of 10 %" in dive.log or dive.modes[-1] is Mode.ERROR


@pytest.mark.parametrize("level", [0.01, 0.05])
def test_a_battery_that_cannot_deliver_the_power_does_not_fail(level, tmp_path):
    assert not Dive(tmp_path, TRUSTED, f"Simulators.Battery:Initial Level={level}", seconds=16.0).failures
