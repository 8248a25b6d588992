"""The task on its sockets: links, peers, parameters over the bus, texts."""

import re
import socket
import subprocess
import sys

import pytest

import imc
from runtime import State
from runtime.kernel import ScaledClock, WallClock
from runtime.testing import simulate
from tasks.transports.mavlink import MAVLink
from tasks.transports.mavlink_links import base_link, ground_links
from tasks.transports.mavlink_replay import MAVLinkReplay
from tests.outside import IN_USE, free_port, free_ports
from tests.tasks.transports.mavlink_station import HOST, STATE, Station, Winch, mavlink, sail


def test_bad_link_is_a_fault_and_the_others_go_on():
    async def script(control):
        station = Station(control, port)
        await station.meet()
        entity = mavlink(control).entity
        assert entity.state is State.FAULT
        assert "'nonsense': not SCHEME" in entity.description

    port = free_port()
    run = sail(script, "nonsense", f"udpout:{HOST}:{port}:px4")
    assert sum("nonsense" in text for text in run.log) == 1


def test_ports_in_use_are_an_error_until_one_is_free(monkeypatch):
    async def script(control):
        await control.sleep(2.0)
        entity = mavlink(control).entity
        assert entity.state is State.ERROR
        assert f"udpin:{HOST}:{port}:px4: {IN_USE}, as are the next" in entity.description
        taken.close()
        await control.sleep(2.0)
        assert entity.state is State.NORMAL
        station = Station(control)
        await station.meet((HOST, port))

    monkeypatch.setattr(base_link, "PORTS_TRIED", 1)
    taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taken.bind((HOST, 0))
    port = taken.getsockname()[1]
    sail(script, f"udpin:{HOST}:{port}:px4")
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).bind((HOST, port))


def test_stations_on_a_listening_link_come_and_go():
    async def script(control):
        stations = [Station(control, system=system) for system in (255, 254, 253)]
        for station in stations:
            station.vehicle = (HOST, port)
            station.send("HEARTBEAT", type=6)
        task = mavlink(control)
        for station in stations[:2]:
            await station.expect("HEARTBEAT")
        await control.sleep(2.0)
        assert stations[2].take() == []
        assert task.link_set.drop_counts["rejected"] >= 1
        assert "2 in contact" in task.entity.description
        for _ in range(40):
            stations[0].send("HEARTBEAT", type=6)
            await control.sleep(1.0)
        stations[1].take()
        stations[1].inbox.clear()
        stations[2].send("HEARTBEAT", type=6)
        await stations[2].expect("HEARTBEAT")
        assert stations[1].take() == []
        for station in (stations[0], stations[2]):
            station.take()
            first = station.sequence[0]
            assert station.sequence == [(first + i) % 256 for i in range(len(station.sequence))]

    port = free_port()
    sail(script, f"udpin:{HOST}:{port}:ardupilot", maximum_peers=2)


def test_station_may_start_late_and_start_again():
    async def script(control):
        await control.sleep(5.0)
        for _ in range(2):
            station = Station(control, port)
            await station.meet()
            station.order(512, 148)
            assert (await station.expect("COMMAND_ACK"))["result"] == 0
            station.socket.close()
            await control.sleep(40.0)

    port = free_port()
    sail(script, f"udpout:{HOST}:{port}:px4")


@pytest.mark.heavy
def test_a_station_of_a_scaled_vehicle_has_its_own_seconds():
    async def script(control):
        station = Station(control)
        await station.meet((HOST, port))
        names = [message.name for message in await station.quiet(20.0)]
        assert 1 <= names.count("HEARTBEAT") <= 2
        assert len(mavlink(control).link_set.links[0].sessions) == 1, "it was silent for 1 s"

    port = free_port()
    sail(script, f"udpin:{HOST}:{port}:px4", clock=ScaledClock(20.0), peer_timeout=2.0)


@pytest.mark.heavy
def test_rubbish_and_floods_are_counted_and_nobody_else_suffers():
    async def script(control):
        good, bad = Station(control), Station(control, system=254)
        await good.meet((HOST, port))
        await bad.meet((HOST, port))
        task = mavlink(control)
        for rubbish in (b"", b"\xfd", b"\xfd\xff" * 500, b"\xfe" * 300, bytes(8000), b"GET / HTTP/1.1\r\n\r\n"):
            bad.socket.sendto(rubbish, bad.vehicle)
        bad.order(400, 1, target=99)
        await good.quiet(1.0)
        assert task.link_set.drop_counts["malformed"] >= 6
        assert task.link_set.drop_counts["foreign"] == 1
        for _ in range(15):
            for _ in range(100):
                bad.order(400, 2)
            good.order(512, 148)
            assert (await good.expect("COMMAND_ACK"))["result"] == 0
        assert task.link_set.drop_counts["dropped"] > 0
        bad.take()
        await good.quiet(1.1)
        for name in ("malformed", "foreign", "dropped"):
            assert f"{name} {task.link_set.drop_counts[name]}" in task.entity.description
        assert task.entity.state is State.NORMAL

    port = free_port()
    run = sail(script, f"udpin:{HOST}:{port}:px4", clock=WallClock())
    (told,) = [text for text in run.log if "frames dropped" in text]  # a busy computer is told of, too
    assert re.search(rf"frames dropped, a station may send 500 per second: \d+ of {HOST}:\d+$", told)


def test_a_flood_of_many_stations_is_dropped_unread_and_the_first_station_is_served():
    async def script(control):
        good = Station(control)
        await good.meet((HOST, port))
        flood = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(12)]
        task = mavlink(control)
        before = control.now
        for _ in range(200):
            for number in range(100):
                flood[number % len(flood)].sendto(b"\xfd" * 200, (HOST, port))
            await control.sleep(0.002)
        good.order(512, 148)
        assert (await good.expect("COMMAND_ACK"))["result"] == 0
        assert task.link_set.drop_counts["dropped"] > 500
        allowed = 500 + 500 * (control.now - before) + 50
        assert task.link_set.drop_counts["malformed"] / 200 <= allowed, "those without a session share one limit"
        for each in flood:
            each.close()

    port = free_port()
    sail(script, f"udpin:{HOST}:{port}:px4", clock=WallClock())


@pytest.mark.heavy
def test_a_link_beyond_this_computer_is_warned_of():
    async def script(control):
        await control.sleep(2.0)

    port, other = free_ports(2)
    run = sail(script, f"udpin:0.0.0.0:{port}:px4", f"udpin:127.0.0.1:{other}:px4", clock=WallClock())
    (told,) = run.log
    assert f"udpin:0.0.0.0:{port}:px4: MAVLink is not signed here" in told


@pytest.mark.heavy
def test_the_warning_names_the_port_that_is_free():
    async def script(control):
        await control.sleep(2.0)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("0.0.0.0", 0))
        port = taken.getsockname()[1]
        run = sail(script, f"udpin://0.0.0.0:{port}", clock=WallClock())
    moved, unsigned = run.log
    assert unsigned.partition(": MAVLink")[0] == moved.partition("connect to ")[2]


def test_arming_is_reported_at_once_on_all_links():
    async def script(control):
        one, other = Station(control, ports[0]), Station(control, ports[1])
        await one.meet()
        await other.meet()
        one.order(400, 1)
        began = control.now
        beat = await other.expect("HEARTBEAT", lambda values: values["base_mode"] & 128, seconds=0.3)
        assert control.now - began < 0.5
        assert (await one.expect("COMMAND_ACK"))["result"] == 0
        assert beat["autopilot"] == 3
        control.publish(imc.VehicleState(op_mode=imc.VehicleState.OpMode.ERROR))
        await other.expect("HEARTBEAT", lambda values: values["system_status"] == 5)

    ports = free_ports(2)
    sail(script, f"udpout:{HOST}:{ports[0]}:px4", f"udpout:{HOST}:{ports[1]}:ardupilot")


def test_parameters_go_over_the_bus_and_all_stations_see_them():
    async def script(control):
        one, other = Station(control, ports[0]), Station(control, ports[1])
        await one.meet()
        await other.meet()
        one.send("PARAM_SET", target_system=26, param_id=b"WINCH_SPEED", param_value=1.5, param_type=9)
        for station in (one, other):
            assert (await station.expect("PARAM_VALUE"))["param_value"] == 1.5
        one.send("PARAM_SET", target_system=26, param_id=b"WINCH_SPEED", param_value=4.5, param_type=9)
        text = await one.expect("STATUSTEXT")
        assert b"Speed: is above the limit of 2 m/s" in text["text"]
        for station in (one, other):
            assert (await station.expect("PARAM_VALUE"))["param_value"] == 1.5
        wish = imc.EntityParameter(name="Limit", value="3.0")
        winch = control.task.vehicle.task_by_label("Winch")
        winch.publish(imc.SetEntityParameters(name="Winch", params=(wish,)))
        for station in (one, other):
            value = await station.expect("PARAM_VALUE")
            assert (value["param_id"], value["param_value"]) == (b"WINCH_LIMIT", 3.0)
        winch.publish(imc.QueryEntityParameters(name="Winch"))
        assert "PARAM_VALUE" not in [m.name for m in await one.quiet(2.0)]

    ports = free_ports(2)
    run = sail(
        script,
        f"udpout:{HOST}:{ports[0]}:px4",
        f"udpout:{HOST}:{ports[1]}:ardupilot",
        tasks=[(Winch, {"entity_label": "Winch"})],
    )
    assert run.of(imc.SetEntityParameters)[0].dst == 26
    assert run.tasks[1].limit == 3.0


def test_own_rates_are_set_like_any_parameter():
    async def script(control):
        station = Station(control, port)
        await station.meet()
        control.publish(STATE)
        await station.expect("ATTITUDE")
        rate = next(e for e in mavlink(control).endpoint.parameters if e.declaration.name == "Attitude Rate")
        station.send("PARAM_SET", target_system=26, param_id=rate.id.encode(), param_value=50.0, param_type=9)
        assert (await station.expect("PARAM_VALUE"))["param_value"] == 50.0
        control.publish(STATE)
        assert sum(m.name == "ATTITUDE" for m in await station.quiet(2.0)) == pytest.approx(100, abs=3)

    port = free_port()
    sail(script, f"udpout:{HOST}:{port}:px4")


def test_log_book_and_detections_become_texts():
    async def script(control):
        station = Station(control, port)
        await station.meet()
        control.publish(STATE)
        for _ in range(10):
            control.publish(imc.EstimatedMugState(id=3, x=10.0, y=0.0))
            await control.sleep(0.1)
        control.publish(imc.LogBookEntry(type=imc.LogBookEntry.Type.DEBUG, text="quiet"))
        control.publish(imc.LogBookEntry(type=imc.LogBookEntry.Type.ERROR, text="leak"))
        assert (await station.expect("STATUSTEXT")) == {
            "severity": 5,
            "text": b"DETECT MUG 3 41.185090,-8.706000",
            "id": 0,
            "chunk_seq": 0,
        }
        leak = await station.expect("STATUSTEXT")
        assert (leak["severity"], leak["text"]) == (3, b"leak")
        await control.sleep(6.0)
        control.publish(imc.EstimatedMugState(id=3, x=1.0, y=-2.0))
        assert (await station.expect("STATUSTEXT"))["text"] == b"DETECT MUG 3 1.0 m north, -2.0 m east"

    port = free_port()
    sail(script, f"udpout:{HOST}:{port}:px4")


def test_forced_disarming_stops_the_plan():
    async def script(control):
        station = Station(control, port)
        await station.meet()
        control.publish(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER))
        await station.expect("HEARTBEAT", lambda values: values["base_mode"] & 128)
        station.order(400, 0)
        assert (await station.expect("COMMAND_ACK"))["result"] == 2
        station.order(400, 0, 21196)
        assert (await station.expect("COMMAND_ACK"))["result"] == 0

    port = free_port()
    run = sail(script, f"udpout:{HOST}:{port}:px4")
    (stop,) = run.of(imc.PlanControl)
    assert (stop.type, stop.op, stop.dst) == (imc.PlanControl.Type.REQUEST, imc.PlanControl.Op.STOP, 26)


@pytest.mark.parametrize(("system", "given", "expected"), [(26, 0, 26), (209, 0, 209), (0x7FF, 0, 5), (26, 77, 77)])
def test_system_id(system, given, expected):
    tasks = [(MAVLink, {"system_id": given, "links": [f"udpin:{HOST}:{free_port()}:px4"]})]
    assert simulate(tasks, system_id=system, seconds=0.0).task.endpoint.model.system == expected


def test_module_needs_no_pymavlink_until_the_task_starts():
    program = "import sys; sys.modules['pymavlink'] = None; import tasks.transports.mavlink"
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("part", ["SigningKeys", "LinkSet", "TelemetryLogs"])
def test_a_start_that_fails_is_reported_once_and_leaves_nothing_behind(part, monkeypatch, tmp_path, caplog):
    """It is tried again; what was not made yet is not missed when the task stops."""
    made, failures = getattr(ground_links, part), [OSError("no space left"), OSError("no space left")]

    def make(*arguments):
        if failures:
            raise failures.pop()
        return made(*arguments)

    monkeypatch.setattr(ground_links, part, make)
    run = simulate(
        MAVLink,
        links=[f"udpin:{HOST}:{free_port()}:px4"],
        tlog=True,
        feed=[imc.LoggingControl(op=imc.LoggingControl.Op.STARTED, name="a", timestamp=0.5)],
        seconds=6.0,
        keep_going=True,
        log_root=tmp_path,
    )
    assert sum("no space left" in text and "restarting in" in text for text in run.log) == 2, run.log
    assert "AttributeError" not in "\n".join([*run.log, caplog.text])
    assert [m.state for m in run.of(imc.EntityState)][-1] == State.NORMAL


def test_a_replay_that_shows_nothing_yet_ignores_that_the_vehicle_logs():
    logs = imc.LoggingControl(op=imc.LoggingControl.Op.STARTED, name="a", timestamp=0.5)
    run = simulate(MAVLinkReplay, feed=[logs], seconds=2.0)
    assert [m.description for m in run.of(imc.EntityState)][-1] == "there is no task Transports.Replay"
