"""A hand on a running vehicle, as a library: a real vehicle in a process of its own."""

import asyncio
import os
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import pytest

import imc
import shoal
from shoal.network import AsyncRemoteVehicle, NetworkLink, NoAnswer, Refused, RemoteVehicle, VehicleLost, make_network
from tests.outside import TOO_LARGE, largest_file
from tests.shoal.network.running import Running, running

NAME = "lauv-noptilus-1"
NETWORKS = ["udp", *(pytest.param(name, marks=pytest.mark.heavy) for name in ("zenoh", "tcp", "both"))]
SERVICE = imc.VehicleState.OpMode.SERVICE


def idle(name: str, seconds: int) -> imc.PlanSpecification:
    step = imc.PlanManeuver(maneuver_id="wait", data=imc.IdleManeuver(duration=seconds))
    return imc.PlanSpecification(plan_id=name, start_man_id="wait", maneuvers=(step,))


@pytest.fixture(scope="module", params=[*NETWORKS[:-1], pytest.param("both", marks=pytest.mark.campaign)])
def process(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("vehicle"), network=request.param) as found:
        yield found


@pytest.fixture(params=NETWORKS)
def doomed(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Running]:
    with running(tmp_path, network=request.param) as found:
        yield found


@pytest.fixture
def vehicle(process: Running) -> Iterator[RemoteVehicle]:
    with shoal.connect(NAME) as found:
        ready(found)
        yield found


def ready(vehicle: RemoteVehicle) -> None:
    """Wait until it boots, and stop what a failed test has left."""
    for state in vehicle.messages(imc.VehicleState):
        if state.op_mode == SERVICE:
            return
        if state.op_mode == imc.VehicleState.OpMode.MANEUVER:
            with suppress(Refused):  # it has just ended
                vehicle.plan.stop()


@pytest.mark.heavy
def test_what_it_says(vehicle: RemoteVehicle) -> None:
    assert (vehicle.name, vehicle.id) == (NAME, 0x001A)
    assert vehicle.latest(imc.EstimatedState).lat == pytest.approx(0.7188, abs=1e-3)
    heading = vehicle.latest(imc.EntityState, entity="Path Control")
    assert heading.state == imc.EntityState.State.NORMAL
    times = [state.timestamp for _, state in zip(range(5), vehicle.messages(imc.EstimatedState), strict=False)]
    assert times == sorted(set(times))
    for found in vehicle.messages(imc.EntityState, imc.Heartbeat, where="Heartbeat.src == 26 or state == BOOT"):
        assert isinstance(found, imc.Heartbeat)
        break


@pytest.mark.heavy
def test_a_plan_from_the_file_to_its_end(vehicle: RemoteVehicle) -> None:
    plan = idle("short", 2)
    vehicle.plan.put(plan)
    assert "short" in [stored.name for stored in vehicle.plan.list()]
    assert vehicle.plan.get("short") == plan
    seen: list[str] = []
    outcome = vehicle.plan.start("short", progress=lambda state: seen.append(state.plan_id))
    assert outcome is not None
    assert (outcome.completed, outcome.reason) == (True, "plan completed")
    assert "short" in seen
    assert vehicle.plan.start(idle("long", 600), wait=False) is None
    assert vehicle.plan.status().plan_id == "long"
    vehicle.plan.stop()
    for name in ("short", "long"):
        vehicle.plan.delete(name)
    assert vehicle.plan.list() == []


def test_a_plan_that_somebody_stops_ends_with_the_reason(vehicle: RemoteVehicle, process: Running) -> None:
    async def act() -> object:
        async with shoal.connect(NAME) as there:
            flight = asyncio.create_task(there.plan.start(idle("stopped", 600)))
            async for state in there.messages(imc.PlanControlState, where="state == EXECUTING"):
                assert state.plan_id == "stopped"
                break
            async with shoal.connect(NAME) as other:
                await other.plan.stop()
            return await flight

    outcome = asyncio.run(act())
    assert (getattr(outcome, "completed", None), getattr(outcome, "reason", "")) == (False, "plan was stopped")


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        (lambda v: v.plan.start("nope"), "undefined plan"),
        (lambda v: v.plan.get("nope"), "nope: undefined plan"),
        (lambda v: v.plan.delete("nope"), "nope: undefined plan"),
        (lambda v: v.plan.stop(), "no plan is running, request ignored"),
        (lambda v: v.param.get("Path Contrl"), "no entity 'Path Contrl'; did you mean 'Path Control'?"),
        (lambda v: v.param.set("Path Control", {"Corridor -- Widt": "2"}), "has no parameter 'Corridor -- Widt'"),
        (lambda v: v.param.set("Path Control", {"Corridor -- Width": "abc"}), "'abc' is not a number"),
    ],
)
def test_a_vehicle_that_says_no_says_why(vehicle: RemoteVehicle, act: object, reason: str) -> None:
    assert callable(act)
    with pytest.raises(Refused) as refusal:
        act(vehicle)
    assert reason in str(refusal.value)


@pytest.mark.heavy
def test_parameters(vehicle: RemoteVehicle) -> None:
    assert vehicle.param.entity_ids()["Daemon"] == 0
    before = vehicle.param.get("Path Control")["Corridor -- Width"]
    assert vehicle.param.set("Path Control", {"Corridor -- Width": "3.5"}) == {"Corridor -- Width": "3.5"}
    assert vehicle.param.list()["Path Control"]["Corridor -- Width"] == "3.5"
    vehicle.param.save("Path Control")
    vehicle.param.set("Path Control", {"Corridor -- Width": before})


def test_numbers_are_values_of_parameters(vehicle: RemoteVehicle) -> None:
    accepted = vehicle.param.set("Path Control", {"Corridor -- Width": 2, "Course Control": False})
    assert accepted == {"Corridor -- Width": "2.0", "Course Control": "false"}


def test_a_notebook_opens_in_one_cell_and_closes_in_another(process: Running) -> None:
    connection = shoal.connect(NAME, endpoints=os.environ["SHOAL_CONNECT"])
    vehicle = connection.open()
    ready(vehicle)
    states = vehicle.messages(imc.EstimatedState)
    next(states)
    connection.close()
    connection.close()
    for ask in (vehicle.plan.list, vehicle.abort, lambda: next(vehicle.messages(imc.EstimatedState))):
        with pytest.raises(shoal.NetworkError, match="has been closed"):
            ask()
    states.close()


def test_a_question_in_the_middle_of_progress_is_refused_instead_of_waiting_for_ever(vehicle: RemoteVehicle) -> None:
    with pytest.raises(shoal.NetworkError, match="`progress` cannot ask the vehicle"):
        vehicle.plan.start(idle("asking", 1), progress=lambda _: vehicle.plan.list())


def test_sentences_show_names_without_control_characters(vehicle: RemoteVehicle) -> None:
    vehicle.plan.put(idle("a\x1b[2J", 1))
    with pytest.raises(Refused) as refusal:
        vehicle.plan.get("zzz")
    assert str(refusal.value).isprintable()
    vehicle.plan.delete("a\x1b[2J")


def test_names_and_classes_in_place_of_messages_are_refused_and_harm_nothing(vehicle: RemoteVehicle) -> None:
    name, kind = cast(Any, "EstimatedState"), cast(Any, imc.Heartbeat)
    for ask in (vehicle.messages, vehicle.latest, lambda answer: vehicle.request(imc.Heartbeat(), answer)):
        with pytest.raises(TypeError, match="'EstimatedState' is not a type of message"):
            list(ask(name))
    for given in (kind, name):
        with pytest.raises(TypeError, match="is not a message"):
            vehicle.send(given)
    assert "Daemon=0" in vehicle.request(imc.EntityList(op=imc.EntityList.Op.QUERY), imc.EntityList).list


@pytest.mark.heavy
def test_requests_of_any_kind(vehicle: RemoteVehicle) -> None:
    query = imc.EntityList(op=imc.EntityList.Op.QUERY)
    assert "Daemon=0" in vehicle.request(query, imc.EntityList).list
    with pytest.raises(NoAnswer, match="does not answer Sms"):
        vehicle.request(imc.Sms(number="1"), imc.SmsStatus, timeout=0.5)
    with pytest.raises(NoAnswer, match=r"its 30\d\d bytes go in 3 pieces|shows why"):
        vehicle.request(imc.Sms(number="1", contents="x" * 3000), imc.SmsStatus, timeout=0.5)
    with pytest.raises(ValueError, match="has no field 'deth'"):
        next(vehicle.messages(imc.EstimatedState, where="deth > 2"))


def test_logs_are_copied_and_the_rest_of_a_broken_copy_too(vehicle: RemoteVehicle, tmp_path: Path) -> None:
    logs = vehicle.log.list()
    assert [log.name for log in logs] == sorted(log.name for log in logs)
    copy = vehicle.log.fetch(logs[0], tmp_path)
    assert copy == tmp_path / NAME / logs[0].name
    data = copy / "Data.lsf.gz"
    whole = data.read_bytes()
    assert len(whole) >= logs[0].files["Data.lsf.gz"] > 0
    assert imc.Log(data).counts()["LoggingControl"] >= 1
    data.unlink()
    half, steps = whole[: len(whole) // 2], []
    for part, resumes in ((half, True), (b"damaged" + half[7:], False), (half[:-7] + b"damaged", False)):
        data.unlink(missing_ok=True)
        (copy / "Data.lsf.gz.part").write_bytes(part)
        steps.clear()
        vehicle.log.fetch(logs[0], tmp_path, steps.append)
        assert (len(half) in steps) is resumes
        assert data.read_bytes()[: len(whole)] == whole


def test_a_file_that_differs_from_the_one_there_is_kept_aside_and_copied_again(
    vehicle: RemoteVehicle, tmp_path: Path
) -> None:
    log = vehicle.log.list()[0]
    assert log.changed["Data.lsf.gz"] > 1.7e9
    data = vehicle.log.fetch(log, tmp_path) / "Data.lsf.gz"
    whole, aside = data.read_bytes(), data.with_name("Data.lsf.gz.other")
    data.touch()  # a copy by other means has another date
    vehicle.log.fetch(log, tmp_path)
    assert not aside.exists()
    for ours in (b"damaged" + whole[7:], b"short", whole[:-7] + b"changed" + b"longer"):
        data.write_bytes(ours)
        os.utime(data, (1e9, 1e9))  # the vehicle may have written its own in this very second
        vehicle.log.fetch(log, tmp_path)
        assert data.read_bytes() == whole
        assert aside.read_bytes() == ours


def test_a_log_that_does_not_fit_on_our_disk_is_no_fault_of_the_server(vehicle: RemoteVehicle, tmp_path: Path) -> None:
    log = vehicle.log.list()[0]
    with largest_file(1000), pytest.raises(OSError, match=f"{TOO_LARGE}: '{tmp_path}/"):
        vehicle.log.fetch(log, tmp_path)


def test_an_abort_is_confirmed(vehicle: RemoteVehicle) -> None:
    vehicle.plan.start(idle("aborted", 600), wait=False)
    vehicle.abort()
    for state in vehicle.messages(imc.PlanControlState, where="plan_id == 'aborted' and state != EXECUTING"):
        assert state.last_outcome == imc.PlanControlState.LastOutcome.FAILURE
        break


def spoil(link: NetworkLink) -> None:
    """Let a link lose the first copy of every packet, and send the second one three times, the last a second later."""
    sent: Counter[bytes] = Counter()
    carry = link.send

    def send(system: str, message: imc.Message, packet: bytes) -> None:
        sent[packet] += 1
        if sent[packet] == 2:
            for delay in (0.0, 0.05, 1.0):
                asyncio.get_running_loop().call_later(delay, carry, system, message, packet)

    link.send = send


@pytest.mark.heavy
def test_commands_over_a_network_that_loses_and_repeats_packets(process: Running) -> None:
    async def act() -> None:
        network = make_network()
        for link in network.links:
            spoil(link)
        async with network:
            vehicle = AsyncRemoteVehicle(network, await network.find_system(NAME, 5.0))
            async for _ in vehicle.messages(imc.VehicleState, where="op_mode == SERVICE"):
                break
            book = network.listen(vehicle.system, (imc.LogBookEntry,))
            outcome = await vehicle.plan.start(idle("once", 2))
            assert outcome is not None
            assert outcome.completed, outcome.reason
            await asyncio.sleep(1.2)  # the last copy comes after the plan has ended
            assert (await vehicle.plan.status()).state == imc.PlanControlState.State.READY
            await vehicle.plan.delete("once")  # a second deletion would fail
            texts: list[str] = []
            with suppress(TimeoutError):
                while True:
                    _, entry = await book.next(0.1)
                    texts.append(getattr(entry, "text", ""))
            assert texts.count("wait: executing maneuver") == 1

    asyncio.run(act())


@pytest.mark.heavy
def test_a_vehicle_that_lists_its_consoles_is_commanded_with_the_id_of_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with running(tmp_path, "--set", "Transports.UDP:Consoles=0x4101", network="udp"):
        with shoal.connect(NAME) as stranger, pytest.raises(NoAnswer) as silence:
            stranger.plan.stop()
        assert f" rejected: not in [Transports.UDP] Consoles of {NAME}; " in str(silence.value)
        monkeypatch.setenv("SHOAL_CONSOLE", "0x4101")
        with shoal.connect(NAME) as console, pytest.raises(Refused, match="no plan is running"):
            console.plan.stop()


@pytest.mark.parametrize("text", ["26", "0x6000", "ground"])
def test_a_console_has_the_id_of_an_operator(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_CONSOLE", text)
    with pytest.raises(ValueError, match=f"SHOAL_CONSOLE: '{text}' is not the id of a console: 0x4000 to 0x5FFF"):
        make_network()


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("lauv-noptilus-2", "no vehicle 'lauv-noptilus-2' on the network; did you mean 'lauv-noptilus-1'?"),
        ("lauv*", "'lauv\\*' is not the name of one vehicle"),
        ("", "'' is not the name of one vehicle"),
    ],
)
def test_who_is_not_there(process: Running, name: str, reason: str) -> None:
    began = time.monotonic()
    with pytest.raises(shoal.NetworkError, match=reason), shoal.connect(name):
        pass
    assert time.monotonic() - began < 5.0


@pytest.mark.heavy
def test_a_vehicle_that_dies_in_the_middle(doomed: Running) -> None:
    async def act(there: AsyncRemoteVehicle) -> None:
        async for _ in there.messages(imc.PlanControlState, where="state == EXECUTING"):
            doomed.kill()
            break

    async def both() -> None:
        async with shoal.connect(NAME) as there:
            async for _ in there.messages(imc.VehicleState, where="op_mode == SERVICE"):
                break
            flight = asyncio.create_task(there.plan.start(idle("last", 600)))
            await act(there)
            with pytest.raises(VehicleLost, match="lauv-noptilus-1 is gone"):
                await flight

    asyncio.run(both())
    with pytest.raises(shoal.NetworkError, match="no vehicle is on the network"):
        shoal.connect(NAME).__enter__()
