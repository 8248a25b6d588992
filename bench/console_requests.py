"""Cost of the 1,000th request of a console or ground station: each handler is asked at 45 Hz with large payloads.

A shipped vehicle runs in virtual time; measured is the processor time of each 1/45 s with a request in it. A console
must not delay EstimatedState by more than 0.1 s. A station asks over TCP, and reads the answers or, "blocked", none.
Usage: python bench/console_requests.py [PROFILE [HANDLER]]
"""

import itertools
import math
import socket
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import imc
from mavlink import Fields, encode, load_dialect, mavlink_system_id
from mavlink.vehicle.files.ftp_messages import LAYOUT, FtpOpcode
from runtime.kernel import SECOND, VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import Vehicle, build
from tasks.transports.mavlink import MAVLink
from tests.outside import free_port

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


ITEMS = 9  # with them a station stays below the 500 messages per second of which more are dropped
DIALECT = load_dialect()
TAKEOFF_ALTITUDE = b"MIS_TAKEOFF_ALT"


def upload(number: int) -> Iterable[tuple[str, Fields]]:
    """A whole mission, without waiting for the vehicle to ask for each item."""
    yield "MISSION_COUNT", {"count": ITEMS}
    for seq in range(ITEMS):
        place = {"x": 411_850_000 + 100 * seq + number, "y": -87_062_000, "z": -2.0, "param4": float("nan")}
        yield "MISSION_ITEM_INT", {"seq": seq, "frame": 6, "command": 16, "autocontinue": 1, **place}


def file_request(number: int, opcode: int, data: bytes = b"", offset: int = 0, size: int = 239) -> tuple[str, Fields]:
    payload = LAYOUT.pack(2 * number % 65536, 0, opcode, len(data) or size, 0, 0, offset) + data
    return "FILE_TRANSFER_PROTOCOL", {"payload": payload}


PARAMETERS = b"@PARAM/param.pck"
HEIGHT = 0.0  # m, at which a vessel and a multirotor can go; relative to home
NOWHERE = {"param5": math.nan, "param6": math.nan, "param7": math.nan}
OFFSHORE = {"y": -87_060_000, "z": HEIGHT}
TARGET = {"lon_int": -87_060_000, "alt": HEIGHT, "type_mask": 0x0DF8}
HOLD, RETURN, OFFBOARD, BY_HAND = ((main | sub << 8) << 16 for main, sub in ((4, 3), (4, 5), (6, 0), (3, 0)))
MODES = HOLD, RETURN, OFFBOARD, BY_HAND  # PX4's numbers
STATIONS: dict[str, Callable[[int], Iterable[tuple[str, Fields]]]] = {
    "HEARTBEAT": lambda i: [("HEARTBEAT", {"type": 6})],
    "MISSION_COUNT and items": upload,
    "MISSION_COUNT alone": lambda i: [("MISSION_COUNT", {"count": 65_535})],
    "MISSION_REQUEST_LIST": lambda i: [
        ("MISSION_REQUEST_LIST", {}),
        *(("MISSION_REQUEST_INT", {"seq": seq}) for seq in range(ITEMS)),
    ],
    "MISSION_CLEAR_ALL": lambda i: [("MISSION_CLEAR_ALL", {})],
    "MISSION_SET_CURRENT": lambda i: [("MISSION_SET_CURRENT", {"seq": i % ITEMS})],
    "PARAM_REQUEST_LIST": lambda i: [("PARAM_REQUEST_LIST", {})],
    "PARAM_REQUEST_READ": lambda i: [("PARAM_REQUEST_READ", {"param_index": i % 300})],
    "PARAM_REQUEST_READ unknown": lambda i: [("PARAM_REQUEST_READ", {"param_index": -1, "param_id": b"P%d" % i})],
    "PARAM_SET": lambda i: [
        ("PARAM_SET", {"param_id": TAKEOFF_ALTITUDE, "param_value": 10.0 + i % 9, "param_type": 9})
    ],
    "PARAM_SET bad": lambda i: [
        ("PARAM_SET", {"param_id": TAKEOFF_ALTITUDE, "param_value": -1.0 - i, "param_type": 9})
    ],
    "FTP list": lambda i: [file_request(i, FtpOpcode.LIST, b"/")],
    "FTP open": lambda i: [file_request(i, FtpOpcode.OPEN, PARAMETERS)],
    "FTP open unknown": lambda i: [file_request(i, FtpOpcode.OPEN, b"/nothing/%d" % i + b"x" * 200)],
    "FTP open and burst": lambda i: [
        file_request(2 * i, FtpOpcode.OPEN, b"/parameters.json.xz"),
        file_request(2 * i + 1, FtpOpcode.BURST),
    ],
    "FTP checksum": lambda i: [file_request(i, FtpOpcode.CHECKSUM, PARAMETERS)],
    "LOG_REQUEST_LIST": lambda i: [("LOG_REQUEST_LIST", {"end": 0xFFFF})],
    "LOG_REQUEST_DATA": lambda i: [("LOG_REQUEST_DATA", {"id": 0, "ofs": 90 * i, "count": 0xFFFFFFFF})],
    "COMMAND_LONG reposition": lambda i: [("COMMAND_LONG", {"command": 192, "param5": 41.185, "param6": -8.706})],
    "COMMAND_INT reposition": lambda i: [
        ("COMMAND_INT", {"command": 192, "frame": 6, "x": 411_850_000 + 10 * i, "y": -87_060_000, "z": HEIGHT})
    ],
    "COMMAND_LONG arm and disarm": lambda i: [("COMMAND_LONG", {"command": 400, "param1": i % 2, "param2": 21196})],
    "COMMAND_LONG takeoff": lambda i: [("COMMAND_LONG", {"command": 22, "param7": math.nan})],
    "COMMAND_LONG speed": lambda i: [("COMMAND_LONG", {"command": 178, "param1": 1, "param2": 1.0 + i % 3 / 10})],
    "COMMAND_LONG speed bad": lambda i: [("COMMAND_LONG", {"command": 178, "param1": 1, "param2": 1e3 + i})],
    "COMMAND_LONG orbit": lambda i: [("COMMAND_LONG", {"command": 34, "param1": 30.0 + i % 9, **NOWHERE})],
    "COMMAND_LONG terminate": lambda i: [("COMMAND_LONG", {"command": 185, "param1": 1})],
    "COMMAND_LONG relay": lambda i: [("COMMAND_LONG", {"command": 181, "param1": i % 3, "param2": i % 2})],
    "COMMAND_LONG mission start": lambda i: [*(upload(0) if not i % 50 else ()), ("COMMAND_LONG", {"command": 300})],
    "SET_MODE": lambda i: [("SET_MODE", {"base_mode": 1, "custom_mode": MODES[i % len(MODES)]})],
    "MISSION_ITEM_INT guided": lambda i: [
        ("MISSION_ITEM_INT", {"current": 2, "frame": 6, "command": 16, "x": 411_850_000 + 10 * i, **OFFSHORE})
    ],
    "SET_POSITION_TARGET": lambda i: [
        *([("SET_MODE", {"base_mode": 1, "custom_mode": OFFBOARD})] if i == 1 else ()),
        ("SET_POSITION_TARGET_GLOBAL_INT", {"coordinate_frame": 6, "lat_int": 411_850_000 + 10 * i, **TARGET}),
    ],
    "SET_POSITION_TARGET bad": lambda i: [("SET_POSITION_TARGET_GLOBAL_INT", {"coordinate_frame": 6, "type_mask": 7})],
    "MANUAL_CONTROL": lambda i: [
        *([("SET_MODE", {"base_mode": 1, "custom_mode": BY_HAND})] if not i else ()),
        ("MANUAL_CONTROL", {"x": 100 + i % 500, "z": 500, "r": i % 300, "buttons": i % 65536}),
    ],
    "COMMAND_LONG unknown": lambda i: [("COMMAND_LONG", {"command": 30_000 + i})],
}

Ask = Callable[[int], object]


def console(vehicle: Vehicle, make: Callable[[int], imc.Message]) -> Ask:
    """A console of IMC that asks."""

    def ask(number: int) -> None:
        request = make(number)
        now = vehicle.kernel.now_ns / SECOND
        packet = imc.encode_with_header(request, now, CONSOLE, 0, vehicle.system, request.dst_ent)
        vehicle.bus.deliver(vehicle.bus.decode(packet), packet)

    return ask


def station(vehicle: Vehicle, make: Callable[[int], Iterable[tuple[str, Fields]]], *, reads: bool) -> Ask:
    """A ground station that asks over TCP, as far as its line takes it."""
    port, sequence = free_port(), itertools.count()
    vehicle.add(MAVLink, "Transports.MAVLink", links=[f"tcpin://127.0.0.1:{port}?flavor=px4"])
    target = {"target_system": mavlink_system_id(vehicle.system), "target_component": 1}
    lines: list[socket.socket] = []

    def ask(number: int) -> None:
        if not lines:
            lines.append(socket.create_connection(("127.0.0.1", port)))
            lines[0].setblocking(False)
        frames: list[bytes] = []
        for name, fields in make(number):
            definition = DIALECT.by_name[name]
            addressed = {key: value for key, value in target.items() if key in {f.name for f in definition.fields}}
            payload = definition.pack({**addressed, **fields})
            frames.append(encode(definition, payload, next(sequence) % 256, 255, 190))
        with suppress(OSError):  # its line is full, or the vehicle has cut it off
            lines[0].sendall(b"".join(frames))
        with suppress(OSError):  # its line is full, or the vehicle has cut it off
            while reads and lines[0].recv(1 << 16):
                pass

    return ask


def measure(profile: str, open_console: Callable[[Vehicle], Ask], folder: Path) -> tuple[list[float], int]:
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
    ask = open_console(vehicle)
    vehicle.start()
    vehicle.run(20.0)

    def count(_: imc.Message) -> None:
        lines[0] += 1

    vehicle.observe(imc.LogBookEntry, count)
    for number in range(REQUESTS):
        began = time.process_time()
        ask(number)
        vehicle.run(1.0 / RATE)
        spent.append(time.process_time() - began)
    vehicle.close()
    return spent, lines[0]


def consoles() -> Iterable[tuple[str, Callable[[Vehicle], Ask]]]:
    """All that are measured, with their names."""
    for name, make in HANDLERS.items():
        yield name, lambda vehicle, make=make: console(vehicle, make)
    for name, frames in STATIONS.items():
        yield name, lambda vehicle, frames=frames: station(vehicle, frames, reads=True)
        yield f"{name}, blocked", lambda vehicle, frames=frames: station(vehicle, frames, reads=False)


def main() -> int:
    profile = sys.argv[1] if len(sys.argv) > 1 else "lauv-noptilus-1"
    worst = 0.0
    print(f"{'handler':34} first 100  last 100   longest   log book lines  ({profile}, ms per 1/45 s)")
    for name, open_console in consoles():
        if len(sys.argv) > 2 and sys.argv[2] not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                spent, lines = measure(profile, open_console, Path(folder))
            except Exception as error:
                print(f"{name:34} {type(error).__name__}: {str(error)[:90]}")
                worst = 9.0
                continue
        first, last = (1000.0 * statistics.median(part) for part in (spent[:100], spent[-100:]))
        print(f"{name:34} {first:9.2f} {last:9.2f} {1000.0 * max(spent):9.1f} {lines:9d}", flush=True)
        worst = max(worst, *spent)
    return int(worst > 0.1)


if __name__ == "__main__":
    sys.exit(main())
