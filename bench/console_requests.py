"""What the 1,000th request of a console costs: each handler is asked at 45 Hz with large payloads.

A shipped vehicle runs in virtual time; measured is the processor time of each 1/45 s with a request in it. A console
must not delay EstimatedState by more than 0.1 s. Usage: python bench/console_requests.py [PROFILE [HANDLER]]
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import imc
from runtime.kernel import SECOND, VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build

CONSOLE, RATE, REQUESTS = 0x4000, 45.0, 1000
LONG = "x" * 30_000
REQUEST, PLAN = imc.PlanControl.Type.REQUEST, imc.PlanControl.Op


def plan(number: int, maneuvers: int = 400) -> imc.PlanSpecification:
    each = [
        imc.PlanManeuver(
            maneuver_id=f"m{i}", data=imc.Goto(lat=0.7188, lon=-0.15195 + i * 1e-7, z=1.0, z_units=1, speed=1.2)
        )
        for i in range(maneuvers)
    ]
    ways = [imc.PlanTransition(source_man=f"m{i}", dest_man=f"m{i + 1}") for i in range(maneuvers - 1)]
    return imc.PlanSpecification(
        plan_id=f"p{number}", start_man_id="m0", maneuvers=tuple(each), transitions=tuple(ways)
    )


def control(number: int, op: int, arg: imc.Message | None = None) -> imc.Message:
    return imc.PlanControl(type=REQUEST, op=op, request_id=number, plan_id=f"p{number}", arg=arg)


def parameters(value: str) -> tuple[imc.EntityParameter, ...]:
    return tuple(imc.EntityParameter(name="Corridor -- Width", value=value) for _ in range(800))


BEACONS = tuple(imc.LblBeacon(beacon=f"b{number}") for number in range(800))


HANDLERS: dict[str, Callable[[int], imc.Message]] = {
    "nothing": lambda i: imc.Heartbeat(),
    "PlanDB SET": lambda i: imc.PlanDB(type=0, op=imc.PlanDB.Op.SET, request_id=i, plan_id=f"p{i}", arg=plan(i)),
    "PlanDB GET unknown": lambda i: imc.PlanDB(type=0, op=imc.PlanDB.Op.GET, request_id=i, plan_id=LONG),
    "PlanControl START": lambda i: control(i, PLAN.START, plan(i)),
    "PlanControl START unknown": lambda i: control(i, PLAN.START),
    "PlanControl LOAD": lambda i: control(i, PLAN.LOAD, plan(i)),
    "PlanControl GET": lambda i: control(i, PLAN.GET),
    "PlanControl STOP": lambda i: control(i, PLAN.STOP),
    "PlanGeneration": lambda i: imc.PlanGeneration(cmd=1, op=0, plan_id="sk", params=f"duration={i};x={LONG}"),
    "QueryEntityParameters": lambda i: imc.QueryEntityParameters(name="UDP", visibility="developer", scope="global"),
    "QueryEntityParameters bad": lambda i: imc.QueryEntityParameters(name="UDP", visibility=LONG, scope=f"{i}"),
    "QueryTypedEntityParameters": lambda i: imc.QueryTypedEntityParameters(op=0, request_id=i, entity_name="UDP"),
    "SetEntityParameters": lambda i: imc.SetEntityParameters(name="Path Control", params=parameters(f"{5 + i % 9}")),
    "SetEntityParameters bad": lambda i: imc.SetEntityParameters(name="Path Control", params=parameters(f"-{i}")),
    "PushEntityParameters": lambda i: imc.PushEntityParameters(name="Path Control"),
    "PopEntityParameters": lambda i: imc.PopEntityParameters(name="Path Control"),
    "SaveEntityParameters": lambda i: imc.SaveEntityParameters(name="Path Control"),
    "EntityList": lambda i: imc.EntityList(op=imc.EntityList.Op.QUERY),
    "QueryEntityInfo": lambda i: imc.QueryEntityInfo(id=i % 60),
    "QueryEntityState": lambda i: imc.QueryEntityState(),
    "LogBookControl GET": lambda i: imc.LogBookControl(command=imc.LogBookControl.Command.GET),
    "LogBookControl CLEAR": lambda i: imc.LogBookControl(command=imc.LogBookControl.Command.CLEAR),
    "LoggingControl name": lambda i: imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_CURRENT_NAME),
    "LoggingControl start": lambda i: imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_START, name=f"n{i}"),
    "PowerChannelControl": lambda i: imc.PowerChannelControl(name=LONG, op=1),
    "PowerOperation": lambda i: imc.PowerOperation(op=0),
    "LblConfig": lambda i: imc.LblConfig(op=imc.LblConfig.Op.SET_CFG, beacons=BEACONS),
    "OperationalLimits": lambda i: imc.OperationalLimits(mask=1, max_depth=10.0 + i % 7),
    "RemoteActionsRequest": lambda i: imc.RemoteActionsRequest(op=1),
    "CacheControl": lambda i: imc.CacheControl(op=2, snapshot=LONG),
    "MessagePart": lambda i: imc.MessagePart(uid=i % 256, frag_number=i % 2, num_frags=255, data=b"x" * 50_000),
    "Announce": lambda i: imc.Announce(
        sys_name=f"s{i}", services=";".join(f"imc+udp://10.0.{j}.1:6001/" for j in range(255))
    ),
    "TextMessage": lambda i: imc.TextMessage(text=LONG),
}


def measure(profile: str, make: Callable[[int], imc.Message], folder: Path) -> tuple[list[float], int]:
    """The processor seconds of each step with a request, and how many lines of the log book came with them."""
    loaded = load_profile(profile)
    made = build(
        loaded,
        loaded.parse_modes("Simulation"),
        clock=VirtualClock(loaded.start_time_ns),
        log_root=folder / "log",
        state_folder=folder / "db",
    )
    vehicle, lines, spent = made.vehicle, [0], []
    vehicle.start()
    vehicle.run(20.0)

    def count(_: imc.Message) -> None:
        lines[0] += 1

    vehicle.observe(imc.LogBookEntry, count)
    for number in range(REQUESTS):
        request = make(number)
        now = vehicle.kernel.now_ns / SECOND
        packet = imc.encode_with_header(request, now, CONSOLE, 0, vehicle.system, request.dst_ent)
        began = time.process_time()
        vehicle.bus.deliver(vehicle.bus.decode(packet), packet)
        vehicle.run(1.0 / RATE)
        spent.append(time.process_time() - began)
    vehicle.close()
    return spent, lines[0]


def main() -> int:
    profile = sys.argv[1] if len(sys.argv) > 1 else "lauv-noptilus-1"
    worst = 0.0
    print(f"{'handler':28} first 100  last 100   longest   log book lines  ({profile}, ms per 1/45 s)")
    for name, make in HANDLERS.items():
        if len(sys.argv) > 2 and sys.argv[2] not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                spent, lines = measure(profile, make, Path(folder))
            except Exception as error:
                print(f"{name:28} {type(error).__name__}: {str(error)[:90]}")
                worst = 9.0
                continue
        first, last = (1000.0 * statistics.median(part) for part in (spent[:100], spent[-100:]))
        print(f"{name:28} {first:9.2f} {last:9.2f} {1000.0 * max(spent):9.1f} {lines:9d}", flush=True)
        worst = max(worst, *spent)
    return int(worst > 0.1)


if __name__ == "__main__":
    sys.exit(main())
