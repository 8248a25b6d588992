"""The bottom and the maximum depth hold whatever is asked of a simulated vehicle, and it stops where it touches."""

import math
import re
import tempfile
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import pytest
from lean import BLIND, UNLOGGED

import imc
from shoal.missions import Mission, parse_plan, prepare
from support.wgs84 import displace, displacement
from world import read_world

OWN, CCU = 0x001A, 0x4001
LIMIT = 200.0  # s
YOYO = "  - yo_yo: {north: 60, east: 30, depth: 6, amplitude: 3, pitch: 15°}"
STEERED = "  - teleoperation: {}"
DOWN = "Thrust=127;Pitch=-127"
SINKING = "Simulators.StreamVelocity:Default Speed Down=0.04"
OFF = "General:Absolute Minimum Altitude=-10"  # nothing holds the vehicle off the bottom
PATIENT = ["Control.AUV.Speed:Stuck Timeout=100", "Control.AUV.Attitude:Maximum Pitch Error=0"]  # nor does it give up


def deep(depth):
    """A flat bottom."""
    return ["Bathymetry:Data=", f"World:Out Of Bounds Depth={depth}"]


@dataclass
class Dive:
    """What happened: reason of the end; true states, ten a second; depths of the water; pitches of the YoYo; log."""

    reason: str = ""
    states: list[imc.SimulatedState] = field(default_factory=list[imc.SimulatedState])
    water: list[float] = field(default_factory=list[float])
    pitches: list[float] = field(default_factory=list[float])
    said: list[str] = field(default_factory=list[str])
    log: list[str] = field(default_factory=list[str])

    @property
    def deepest(self) -> float:
        return max(state.z for state in self.states)

    @property
    def clearance(self) -> float:
        """The least distance to the bottom (m)."""
        return min(depth - state.z for depth, state in zip(self.water, self.states, strict=True))

    @property
    def turns(self) -> int:
        signs = [pitch > 0.0 for pitch in self.pitches if pitch]
        return sum(a is not b for a, b in pairwise(signs))


def dive(maneuvers, overrides=(), *, steer=(), silent="", at=0.0, profile="lauv-noptilus-1", seconds=LIMIT):
    """Fly maneuvers; `steer` are times (s) and RemoteActions or others; a task falls `silent` `at` a time (s)."""
    plan = parse_plan(f"plan: floor\norigin: 41.185°, -8.7062°\nspeed: 1.4 m/s\nmaneuvers:\n{maneuvers}")
    result = Dive()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        lean = (UNLOGGED, BLIND) if profile == "lauv-noptilus-1" else (UNLOGGED,)
        made = prepare(profile, overrides=(*lean, *overrides), log_root=root / "log", state_folder=root / "db")
        vehicle, value = made.vehicle, made.vehicle.profile.value
        begin, sea = vehicle.start_time, read_world(value).seabed

        def look(state):
            if round((state.timestamp - begin) * 100.0) % 10 == 0:
                north, east, _ = displacement(*sea.reference, 0.0, state.lat, state.lon, 0.0)
                result.states.append(state)
                result.water.append(sea.depth(north + state.x, east + state.y))

        def describe(state):
            if state.src_ent == attitude and state.description not in result.said:
                result.said.append(state.description)

        yoyo = [task.entity.id for task in vehicle.tasks if task.name == "Maneuver.YoYo"]
        attitude = next((t.entity.id for t in vehicle.tasks if t.name == "Control.AUV.Attitude"), None)
        vehicle.observe(imc.SimulatedState, look)
        vehicle.observe(imc.DesiredPitch, lambda m: result.pitches.append(m.value) if m.src_ent in yoyo else None)
        vehicle.observe(imc.LogBookEntry, lambda m: result.log.append(m.text))
        vehicle.observe(imc.EntityState, describe)

        async def happen(script):
            while True:
                await script.sleep(0.2)
                elapsed = script.now - begin
                if silent and elapsed >= at:
                    vehicle.task(silent).cancel_callbacks()
                for order in [order for since, order in steer if elapsed >= since][-1:]:
                    message = imc.RemoteActions(actions=order) if isinstance(order, str) else order
                    packet = imc.encode_with_header(message, script.now, CCU, 0, OWN, 0xFF)
                    vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

        vehicle.kernel.soon(vehicle.daemon.start_script, happen)
        result.reason = Mission(vehicle, plan).fly(seconds).reason
    assert all(math.isfinite(s.x + s.y + s.z + s.u + s.v + s.w + s.p + s.q + s.r + s.theta) for s in result.states)
    return result


def grounded(log):
    return [text for text in log if "grounded" in text]


@pytest.mark.heavy
def test_a_yoyo_turns_above_a_bottom_that_is_too_near():
    run = dive(YOYO)
    assert run.reason == "plan completed; YoYo1: depth 2.4 m instead of 9 m"
    assert run.clearance > 1.2
    assert run.deepest > 1.5, "it uses the water that there is"
    assert 3 <= run.turns <= 10
    assert len(run.pitches) <= 5 * (run.turns + 2), "no more steps than the turns need"


@pytest.mark.heavy
def test_a_yoyo_reaches_its_depths_where_there_is_water():
    run = dive("  - yo_yo: {north: 120, depth: 6, amplitude: 3, pitch: 15°}", deep(12))
    dived = next(i for i, state in enumerate(run.states) if state.z > 8.0)
    assert run.deepest == pytest.approx(9.0, abs=0.4)
    assert min(state.z for state in run.states[dived:]) == pytest.approx(3.0, abs=0.4)


@pytest.mark.heavy
def test_a_yoyo_between_altitudes_turns_below_the_surface_too():
    run = dive("  - yo_yo: {north: 80, altitude: 6, amplitude: 3, pitch: 15°}", deep(7))
    assert run.reason == "plan completed"
    assert run.turns >= 3
    assert 2.0 < run.clearance < 3.2


@pytest.mark.heavy
def test_a_yoyo_that_is_too_slow_to_dive_says_so():
    run = dive("  - yo_yo: {north: 30, depth: 6, amplitude: 6, pitch: 15°, speed: 0.3 m/s}", deep(30), seconds=600)
    assert re.fullmatch(r"plan completed; YoYo1: depth \d\.\d m instead of 12 m", run.reason)
    assert float(run.reason.split()[4]) == pytest.approx(run.deepest, abs=0.2)


@pytest.mark.heavy
@pytest.mark.parametrize("yoyo", [YOYO, "  - yo_yo: {north: 100, east: 30, depth: 2, amplitude: 2, pitch: 15°}"])
def test_a_yoyo_does_not_brake_before_the_surface(yoyo):
    run = dive(yoyo, deep(30) if yoyo is not YOYO else ())
    assert run.reason.startswith("plan completed")
    assert not [text for text in run.log if "braking" in text]


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("overrides", "floor"),
    [
        (deep(12), 12.0),
        ([*deep(12), "Control.AUV.Attitude:Maximum Pitch Reference=30", SINKING], 12.0),
        ([*deep(120), "General:Absolute Maximum Depth=10"], 11.0),
    ],
    ids=["bottom", "steep and with a current", "maximum depth"],
)
def test_teleoperation_pitched_down_stays_above_bottom_and_maximum_depth(overrides, floor):
    run = dive(STEERED, [*overrides, "Control.AUV.RemoteOperation:Pitch Reference=30"], steer=[(8.0, DOWN)], seconds=60)
    assert floor - 1.6 < run.deepest < floor - 0.9
    assert grounded(run.log) == []
    assert any("kept off the" in text for text in run.said)
    last = [state.z for state in run.states[-100:]]
    assert max(last) - min(last) < 0.3, "held, not bouncing"


@pytest.mark.heavy
def test_a_dislodge_does_not_dive():
    run = dive("  - goto: {north: 20, east: 30, depth: 2}\n  - dislodge: {rpm: 1500, timeout: 60s}")
    assert run.reason == "plan completed"
    assert run.clearance > 1.5


@pytest.mark.heavy
@pytest.mark.parametrize(("z", "unit"), [(1e6, imc.ZUnits.DEPTH), (-9.0, imc.ZUnits.ALTITUDE), (5.0, imc.ZUnits.NONE)])
def test_a_reference_to_follow_does_not_lead_to_the_bottom(z, unit):
    has = imc.Reference.Flags
    lat, lon, _ = displace(math.radians(41.185), math.radians(-8.7062), 0.0, 50.0, 60.0)
    speed, depth = imc.DesiredSpeed(value=1e4), imc.DesiredZ(value=z, z_units=unit)
    there = imc.Reference(lat=lat, lon=lon, speed=speed, z=depth, flags=has.LOCATION | has.SPEED | has.Z)
    above = there.replace(z=imc.DesiredZ(value=1.5, z_units=imc.ZUnits.DEPTH))
    follow = "  - follow_reference: {control_src: 65535, control_ent: 255}"
    run = dive(follow, steer=[(8.0, above), (20.0, there)], seconds=50)
    assert max(math.hypot(state.x, state.y) for state in run.states) > 40.0
    assert run.clearance > 1.0


@pytest.mark.heavy
@pytest.mark.parametrize("maneuver", [YOYO, "  - goto: {north: 60, east: 30, depth: 6}"])
def test_without_an_altimeter_the_bottom_seen_last_counts_for_a_minute(maneuver):
    legs = f"{maneuver}\n{maneuver.replace('60, east: 30', '0, east: 60')}\n{maneuver}"
    run = dive(legs, silent="Simulators.Environment", at=8.0)
    assert run.reason == "vehicle errors: Attitude: altitude has been unknown for too long"
    assert "altitude has been unknown for too long" in run.said
    assert run.clearance > 0.6


@pytest.mark.heavy
def test_a_vehicle_that_touches_the_bottom_stops_there_and_the_log_says_so():
    run = dive(STEERED, [OFF, *PATIENT], steer=[(8.0, DOWN), (45.0, "Thrust=127;Pitch=127")], seconds=60)
    assert 0.05 < run.clearance < 0.06, "half the height of the hull"
    first = next(
        i for i, (water, state) in enumerate(zip(run.water, run.states, strict=True)) if water - state.z < 0.06
    )
    speed = [math.hypot(state.u, state.v) for state in run.states]
    assert speed[first - 5] > 1.0
    assert min(speed[first : first + 10]) < 0.2
    words = grounded(run.log)
    assert words[0] == f"grounded in {run.water[first]:.1f} m of water"
    assert words[-1] == "no longer grounded"
    assert words[::2] == [text for text in words if text.startswith("grounded in")]
    assert len(words) <= 6, "once for each contact"


@pytest.mark.heavy
def test_a_boat_runs_aground_before_the_shore():
    shore = ["Bathymetry:Data=0 0 4, 20 0 1, 40 0 -2", "World:Sounding Radius=30"]
    run = dive("  - goto: {north: 80, depth: 0}", shore, profile="otter", seconds=90)
    assert run.clearance == pytest.approx(0.195, abs=0.05), "its draft"
    assert run.states[-1].x == pytest.approx(max(state.x for state in run.states), abs=0.1)
    assert 15.0 < run.states[-1].x < 30.0
    assert grounded(run.log)[0] == "grounded in 0.2 m of water"
