"""Missions of the fully simulated vehicle with faults and currents, and the checks of each."""

import math
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from flying import CCU, DEPTH, OWN, control, goto, place, plan_of
from hypothesis import strategies as st
from lean import UNLOGGED

import imc
from shoal.missions import prepare

BEGIN, ABORT, END = 12.0, 60.0, 120.0  # s; all events of a mission happen before ABORT
DEEPEST, OVERSHOOT, SURFACE = 6.0, 1.0, 0.5  # m
RISING = 0.2  # m in 20 s
SILENT = (
    "", "", "Simulators.DVL", "Simulators.DepthSensor", "Simulators.IMU/AHRS", "Simulators.GPS",
    "Simulators.Servos", "Simulators.Motor", "Navigation.AUV.Navigation", "Control.AUV.Attitude", "Control.AUV.Speed",
    "Control.AUV.Allocator", "Control.Path.VectorField", "Maneuver.Goto", "Maneuver.YoYo", "Plan.Engine",
    "Supervisors.Vehicle", "Monitors.Entities", "Simulators.Environment", "Control.AUV.Brakes",
    "Maneuver.StationKeeping",
)  # fmt: skip
Mode = imc.VehicleState.OpMode


@dataclass(frozen=True)
class Sailing:
    """A plan, which task fails when (s), the velocity of the water (m/s), when (s) to abort and to end.

    A sensor fails by becoming silent, any other task by an exception, after which it is restarted.
    """

    plan: imc.PlanSpecification
    silent: str = ""
    silent_at: float = ABORT
    north: float = 0.0
    east: float = 0.0
    down: float = 0.0
    abort_at: float = ABORT
    seed: int = 0
    until: float = END


@dataclass
class Voyage:
    """The result: time (s) and depth (m), time and mode of the vehicle, replies, packets, failed tasks."""

    depths: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    modes: list[tuple[float, int]] = field(default_factory=list[tuple[float, int]])
    replies: list[str] = field(default_factory=list[str])
    packets: list[bytes] = field(default_factory=list[bytes])
    failures: list[str] = field(default_factory=list[str])


@st.composite
def sailings(draw):
    """One or two maneuvers in a current, with a fault."""
    depth, speed = st.sampled_from((0.0, 2.0, 4.0, 5.0)), st.sampled_from((0.8, 1.5))
    near = st.floats(-60.0, 60.0).map(round)
    legs = st.builds(goto, near, near, depth, speed)
    zigzag = st.builds(
        lambda north, east, z: imc.YoYo(
            **place(north, east), z=z, z_units=DEPTH, amplitude=1.0, pitch=math.radians(15.0), speed=1.5
        ),
        near, near, st.sampled_from((2.0, 4.0)),
    )  # fmt: skip
    bottom = st.builds(lambda n, e: goto(n, e).replace(z=3.0, z_units=imc.ZUnits.ALTITUDE), near, near)
    stations = st.builds(
        lambda n, e, z: imc.StationKeeping(**place(n, e), z=z, z_units=DEPTH, radius=15.0, speed=1.2), near, near, depth
    )
    items = draw(st.lists(st.one_of(legs, zigzag, bottom, stations), min_size=1, max_size=2))
    water = st.sampled_from((-0.5, -0.2, 0.0, 0.0, 0.3, 1.0))
    return Sailing(
        plan_of(*items),
        draw(st.sampled_from(SILENT)),
        float(draw(st.integers(14, 59))),
        draw(water),
        draw(water),
        draw(st.sampled_from((-0.05, 0.0, 0.0, 0.05))),
        float(draw(st.integers(14, 60))),
        draw(st.integers(0, 3)),
    )


def sail(sailing: Sailing) -> Voyage:
    """Fly it with the full simulation. Exceptions of tasks are raised."""
    voyage = Voyage()
    water = {"North": sailing.north, "East": sailing.east, "Down": sailing.down}
    overrides = [f"Simulators.StreamVelocity:Default Speed {name}={value}" for name, value in water.items()]
    overrides.append(UNLOGGED)
    overrides.append(f"General:Absolute Maximum Depth={DEEPEST}")
    overrides.append(f"Monitors.OperationalLimits:Initial Setting - Maximum Depth={DEEPEST}")
    with tempfile.TemporaryDirectory() as folder:
        made = prepare(
            "lauv-noptilus-1",
            overrides=overrides,
            seed=sailing.seed,
            log_root=Path(folder) / "log",
            state_folder=Path(folder) / "db",
        )
        vehicle = made.vehicle
        vehicle.keep_going = True
        begin = vehicle.start_time

        def note_mode(state):
            voyage.modes.append((state.timestamp - begin, state.op_mode))

        def note_reply(reply):
            if reply.dst == CCU:
                voyage.replies.append(reply.info)

        vehicle.observe(imc.SimulatedState, lambda m: voyage.depths.append((m.timestamp - begin, m.z)))
        vehicle.observe(imc.VehicleState, note_mode)
        vehicle.observe(imc.PlanControl, note_reply)
        vehicle.observe(imc.Message, lambda _, packet: voyage.packets.append(packet), packets=True)

        async def happen(script):
            await script.sleep(BEGIN)
            request = control(imc.PlanControl.Op.START, -1.0, sailing.plan.plan_id, 1, arg=sailing.plan)
            vehicle.bus.deliver_and_send(*_packed(request, script.now), None)
            for at, what in sorted([(sailing.silent_at, sailing.silent), (sailing.abort_at, "Abort")]):
                await script.sleep(begin + at - script.now)
                if what == "Abort":
                    vehicle.bus.deliver_and_send(*_packed(imc.Abort(src=CCU, dst=OWN), script.now), None)
                elif what.startswith("Simulators."):
                    vehicle.task(what).cancel_callbacks()
                elif what:
                    vehicle.kernel.after(0.0, _break).owner = vehicle.task(what)

        vehicle.start()
        vehicle.kernel.soon(vehicle.daemon.start_script, happen)
        try:
            vehicle.run(sailing.until)
        finally:
            vehicle.close()
        voyage.failures = sorted(vehicle.failures)
    return voyage


def _break() -> None:
    raise RuntimeError("broken on purpose")


def _packed(message: imc.Message, now: float) -> tuple[imc.Message, bytes]:
    packet = imc.encode_with_header(message, now, message.src, message.src_ent, message.dst, message.dst_ent)
    return imc.decode(packet), packet


def check_voyage(sailing: Sailing, voyage: Voyage) -> None:
    """Check all rules. Raises AssertionError."""
    assert set(voyage.failures) <= {sailing.silent}
    assert all(math.isfinite(depth) for _, depth in voyage.depths)
    time, depth = max(voyage.depths, key=lambda item: item[1])
    assert depth <= DEEPEST + OVERSHOOT, f"{depth:.1f} m deep at {time:.1f} s"
    if sailing.silent != "Supervisors.Vehicle":
        after = [mode for time, mode in voyage.modes if time > sailing.abort_at + 0.1]
        assert set(after) <= {Mode.ERROR, Mode.SERVICE}
        before = next(depth for time, depth in voyage.depths if time >= END - 20.0)
        assert voyage.depths[-1][1] <= max(SURFACE, before - RISING), f"still at {voyage.depths[-1][1]:.1f} m"
    if sailing.silent != "Plan.Engine":
        assert voyage.replies, "no reply to the START"
