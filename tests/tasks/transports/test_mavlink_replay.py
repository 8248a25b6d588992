"""A log that is replayed to ground stations: they see its vehicle, survive jumps, and command nothing."""

import math
from itertools import pairwise
from pathlib import Path

import pytest

import imc
from imc import coordinates
from mavlink import Tlog, load_dialect
from mavlink.vehicle.command.vehicle_commands import COMMANDS
from runtime import State, Task, consume
from runtime.testing import simulate
from shoal.logs.edit.tlog_import import import_tlog
from support import wgs84
from tasks.transports.mavlink_links.logged_vehicle import REFUSAL, LoggedPlans, identify_log_owner
from tasks.transports.mavlink_replay import MAVLinkReplay
from tests.tasks.transports.mavlink_playback import position, record, show

LOGS = Path(__file__).parents[2] / "data" / "logs"
DENIED, REFUSED_MISSION, ARMED = 2, 14, 128
SUBMARINE, BOAT, HEXACOPTER, COPTER = 12, 11, 13, 2
AUTO, MISSION_STATE_ACTIVE = 3, 3


class Ear(Task):
    """Records what the replay's own system asks of others."""

    def start(self):
        self.asked = []

    @consume
    def hear(self, message: imc.PlanControl | imc.PlanDB | imc.VehicleCommand | imc.RemoteActions):
        self.asked.append(message)


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    return record(tmp_path_factory.mktemp("dive"), "lauv-noptilus-1", 60.0)


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    return record(tmp_path_factory.mktemp("flight"), "hexa-00", 40.0)


def at(log, kind, elapsed):
    """The last message of a kind at a time of the log."""
    start = next(iter(imc.Log(log))).timestamp
    return [m for m in imc.Log(log).messages(kind) if m.timestamp <= start + elapsed][-1]


def metres_between(state, values):
    lat, lon, _ = coordinates.absolute_position(state)
    place = math.radians(values["lat"] / 1e7), math.radians(values["lon"] / 1e7)
    return math.hypot(*wgs84.displacement(lat, lon, 0.0, *place, 0.0)[:2])


@pytest.mark.heavy
def test_a_station_sees_what_the_vehicle_was_and_did(dive):
    async def watch(station, player):
        await station.meet()
        await station.script.sleep(30.0 - player.elapsed)
        state = at(dive, "EstimatedState", player.elapsed)
        place = await station.expect("GLOBAL_POSITION_INT", lambda v: v["time_boot_ms"] >= 30_000)
        assert metres_between(state, place) < 1.0
        assert place["relative_alt"] / -1e3 == pytest.approx(state.depth, abs=0.3)
        attitude = await station.expect("ATTITUDE")
        assert math.remainder(attitude["yaw"] - state.psi, math.tau) == pytest.approx(0.0, abs=0.2)
        status = await station.expect("SYS_STATUS")
        assert status["voltage_battery"] / 1e3 == pytest.approx(at(dive, "Voltage", 30.0).value, abs=0.05)
        heartbeat = await station.expect("HEARTBEAT")
        assert (heartbeat["type"], heartbeat["custom_mode"]) == (SUBMARINE, AUTO)
        assert heartbeat["base_mode"] & ARMED
        progress = await station.expect("MISSION_CURRENT")
        assert (progress["mission_state"], progress["total"]) == (MISSION_STATE_ACTIVE, len(await items(station)) - 1)
        time = await station.expect("SYSTEM_TIME")
        assert time["time_unix_usec"] / 1e6 == pytest.approx(state.timestamp, abs=5.0)

    show(dive, watch)


async def items(station):
    station.send("MISSION_REQUEST_LIST", target_system=26, target_component=1)
    count = (await station.expect("MISSION_COUNT"))["count"]
    found = []
    for seq in range(count):
        station.send("MISSION_REQUEST_INT", target_system=26, target_component=1, seq=seq)
        found.append(await station.expect("MISSION_ITEM_INT"))
    return found


@pytest.mark.heavy
def test_a_copter_is_what_its_configuration_says(flight):
    assert identify_log_owner(flight).kind == "hexacopter"
    home = next(imc.Log(flight).messages("EstimatedState"))

    async def watch(station, player):
        await station.meet()
        await station.script.sleep(25.0 - player.elapsed)
        heartbeat = await station.expect("HEARTBEAT")
        assert heartbeat["type"] == HEXACOPTER
        assert heartbeat["base_mode"] & ARMED
        place = await station.expect("GLOBAL_POSITION_INT", lambda v: v["time_boot_ms"] >= 25_000)
        state = at(flight, "EstimatedState", player.elapsed)
        assert place["relative_alt"] / 1e3 == pytest.approx(state.height - state.z - home.height, abs=1.0)
        assert place["relative_alt"] > 2000

    show(flight, watch)


@pytest.mark.parametrize("flavor", ["ardupilot", "px4"])
def test_orders_are_refused_with_the_reason_and_reach_nobody(dive, flavor):
    async def order(station, player):
        await station.meet()
        await station.script.sleep(5.0)
        for command in sorted(COMMANDS):
            station.order(command, 1.0, 4.0, 4.0)
            ack = await station.expect("COMMAND_ACK", lambda v, c=command: v["command"] == c)
            assert ack["result"] == DENIED, command
        target = {"target_system": 26, "target_component": 1}
        station.send("MISSION_COUNT", **target, count=2)
        assert (await station.expect("MISSION_ACK"))["type"] == REFUSED_MISSION
        station.send("MISSION_CLEAR_ALL", **target)
        assert (await station.expect("MISSION_ACK"))["type"] == REFUSED_MISSION
        await station.script.sleep(2.0)
        before = await station.expect("HEARTBEAT")
        for name, fields in (
            ("SET_MODE", {"target_system": 26, "base_mode": 1, "custom_mode": 19}),
            ("SET_POSITION_TARGET_GLOBAL_INT", target),
            ("MISSION_SET_CURRENT", target),
        ):
            await station.script.sleep(1.5)  # a text that repeats the last one within a second is left out
            station.take()
            station.inbox.clear()
            station.send(name, **fields)
            words = (await station.expect("STATUSTEXT"))["text"]
            assert REFUSAL.encode().startswith(words), name
        station.send("MANUAL_CONTROL", target=26, x=1000)
        assert (await station.expect("HEARTBEAT"))["custom_mode"] == before["custom_mode"]

    run = show(dive, order, Ear, flavor=flavor)
    assert run.tasks[-1].asked == []


@pytest.mark.heavy
def test_a_jump_shows_at_once_what_was_there_and_no_time_goes_back(dive):
    """Forward and back, by a console, by a station, and while it is paused."""

    async def jump(station, player):
        await station.meet()
        await station.script.sleep(2.0)
        boots = []
        for place, by in ((40.0, "console"), (5.0, "station"), (45.0, "paused")):
            if by == "station":
                station.send(
                    "PARAM_SET",
                    target_system=26,
                    target_component=1,
                    param_id=b"REPLAY_POSITION",
                    param_value=place,
                    param_type=9,
                )
            elif by == "console":
                player.publish(position(place))
            else:
                player.pause()
                player.publish(position(place))
            await station.script.sleep(0.2)
            assert player.elapsed == pytest.approx(place, abs=0.3)
            station.take()
            station.inbox.clear()
            seen = await station.quiet(5.0)
            first = next(m for m in seen if m.name == "GLOBAL_POSITION_INT")
            state = at(dive, "EstimatedState", place)
            assert metres_between(state, first.values) < 2.0, by
            assert first.values["relative_alt"] / -1e3 == pytest.approx(max(0.0, state.depth), abs=0.5), by
            boots += [m.values["time_boot_ms"] for m in seen if "time_boot_ms" in m.values]
            beats = [m.values for m in seen if m.name == "HEARTBEAT"]
            assert len(beats) >= 5, by
            active = [m.values["mission_state"] for m in seen if m.name == "MISSION_CURRENT"]
            plan = at(dive, "PlanControlState", place)
            assert (active[0] == MISSION_STATE_ACTIVE) == (plan.state == imc.PlanControlState.State.EXECUTING), by
            volts = [m.values["voltage_battery"] for m in seen if m.name == "SYS_STATUS"]
            assert all(0 < value < 0xFFFF for value in volts), by
            home = next(m.values for m in seen if m.name == "HOME_POSITION")
            assert home["altitude"] == 0
        assert boots[0] > 0
        assert all(b - a > -300 for a, b in pairwise(boots)), "a time went back"

    show(dive, jump)


def test_what_is_paused_stays_as_it_is(dive):
    async def wait(station, player):
        await station.meet()
        await station.script.sleep(20.0)
        player.pause()
        await station.quiet(1.0)
        before = await station.expect("GLOBAL_POSITION_INT")
        for _ in range(8):
            await station.script.sleep(9.0)
            station.send("HEARTBEAT", type=6)
            station.take()
            station.inbox.clear()
            after = await station.expect("GLOBAL_POSITION_INT")
            assert after["time_boot_ms"] > before["time_boot_ms"]
            assert after | {"time_boot_ms": 0} == before | {"time_boot_ms": 0}
            assert (await station.expect("HEARTBEAT"))["custom_mode"] == AUTO

    show(dive, wait)


def test_a_replay_that_begins_late_knows_home_and_mission(dive):
    first = next(imc.Log(dive).messages("EstimatedState"))

    async def watch(station, player):
        await station.meet()
        home = await station.expect("HOME_POSITION")
        assert home["latitude"] == pytest.approx(math.degrees(first.lat) * 1e7, abs=2)
        assert (await station.expect("MISSION_CURRENT"))["mission_state"] == MISSION_STATE_ACTIVE

    show(dive, watch, begin="50")


@pytest.mark.parametrize("kind", [imc.PlanDB, imc.PlanControl])
def test_a_plan_that_the_vehicle_rejected_is_none_of_its_plans(kind):
    def fetch(name):
        found = []
        plans.fetch(name, found.append, 0.0)
        return found[0][2]

    plans, ask, answer = LoggedPlans(None), kind.Type.REQUEST, {"src": 26, "dst": 0x4101}
    for number, outcome in enumerate((kind.Type.FAILURE, kind.Type.SUCCESS, kind.Type.IN_PROGRESS)):
        plan = imc.PlanSpecification(plan_id=outcome.name)
        plans.learn(kind(type=ask, request_id=number, arg=plan, src=0x4101, dst=26))
        assert fetch(outcome.name) is None, "not answered yet"
        plans.learn(kind(type=kind.Type.SUCCESS, request_id=number, src=26, dst=0x4102))
        plans.learn(kind(type=outcome, request_id=number, **answer))
        assert (fetch(outcome.name) == plan) == (outcome == kind.Type.SUCCESS)
    plans.learn(kind(type=kind.Type.SUCCESS, request_id=2, **answer))
    assert fetch("IN_PROGRESS") is not None, "it has succeeded in the end"


def test_a_log_of_dune_is_shown(dive):
    async def watch(station, player):
        await station.meet()
        heartbeat = await station.expect("HEARTBEAT")
        assert heartbeat["type"] == SUBMARINE
        place = await station.expect("GLOBAL_POSITION_INT")
        assert metres_between(at(LOGS / "dune-mission-cut", "EstimatedState", player.elapsed), place) < 1.0
        assert await station.expect("SYS_STATUS", lambda v: v["onboard_control_sensors_present"] & 0x20)

    show(LOGS / "dune-mission-cut", watch)


def test_an_imported_tlog_has_the_modes_and_places_of_the_recording(tmp_path):
    import_tlog(LOGS / "ardusub.tlog", tmp_path)
    recorded = list(Tlog(LOGS / "ardusub.tlog", load_dialect()).read(frozenset({"HEARTBEAT", "GLOBAL_POSITION_INT"})))
    own = [m.values for _, m in recorded if m.name == "HEARTBEAT" and (m.system, m.component) == (1, 1)]
    places = [m.values for _, m in recorded if m.name == "GLOBAL_POSITION_INT"]

    async def watch(station, player):
        await station.meet()
        heartbeat = await station.expect("HEARTBEAT", lambda v: v["custom_mode"] == own[0]["custom_mode"])
        assert (heartbeat["type"], heartbeat["base_mode"] & ARMED) == (SUBMARINE, own[0]["base_mode"] & ARMED)
        place = await station.expect("GLOBAL_POSITION_INT")
        assert min(abs(place["lat"] - p["lat"]) + abs(place["lon"] - p["lon"]) for p in places) < 30
        assert min(abs(place["relative_alt"] - min(0, p["relative_alt"])) for p in places) < 50

    run = show(tmp_path, watch)
    assert run.tasks[1].endpoint.model.system == 1


def test_another_log_is_another_vehicle(dive, flight):
    root = flight.parents[2]

    async def change(station, player):
        await station.meet()
        assert (await station.expect("HEARTBEAT"))["type"] == SUBMARINE
        player.vehicle.daemon.publish(
            imc.ReplayControl(op=imc.ReplayControl.Op.START, file=str(flight.relative_to(root)))
        )
        assert (await station.expect("HEARTBEAT", lambda v: v["type"] == HEXACOPTER))["autopilot"] == 3

    show(dive, change, log_root=root)


def test_without_a_player_there_is_nothing_to_show():
    run = simulate(MAVLinkReplay, seconds=3.0)
    assert (run.task.entity.state, run.task.entity.description) == (State.ERROR, "there is no task Transports.Replay")


@pytest.mark.parametrize("content", ["[Transports.MAVLink]\nVehicle Kind = spaceship\nSystem Id = -3\n", "[[[", "\0"])
def test_a_damaged_configuration_is_not_believed(dive, tmp_path, content):
    (tmp_path / "Data.lsf.gz").symlink_to(dive / "Data.lsf.gz")
    (tmp_path / "IMC.xml.gz").symlink_to(dive / "IMC.xml.gz")
    (tmp_path / "Config.ini").write_text(content)
    assert identify_log_owner(tmp_path) == identify_log_owner(dive)
