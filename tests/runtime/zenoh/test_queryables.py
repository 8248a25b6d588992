"""What a zenoh program gets from a shipped vehicle without waiting for it: last messages, replies, states, life."""

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest

import imc
from tests.outside import slowness
from tests.runtime.zenoh.processes import Network, Process
from tests.runtime.zenoh.vehicles import NAME, SYSTEM, Vehicle, wait_until

CONSOLE = 0x4123
QUERY, DB = imc.EntityList.Op.QUERY, imc.PlanDB


def asker(network: Network) -> Process:
    process = network.asker()
    assert process.line() == {"opened": True}
    return process


def ask(process: Process, message: imc.Message, **fields: object) -> Any:
    """The vehicle's reply to a request, sent as a query."""
    name = type(message).__name__
    request = {"abbrev": name, "src": CONSOLE, "dst": SYSTEM, **fields}
    return process.ask(f"get imc/{NAME}/@q/{name} {json.dumps(request)}")


@pytest.mark.heavy
def test_a_vehicle_answers_queries_and_a_late_joiner_has_its_state_at_once(network: Network, tmp_path: Path) -> None:
    vehicle = Vehicle(network, tmp_path)
    wait_until(lambda: list(tmp_path.rglob("*_dive")), vehicle)  # its plan has begun
    process = asker(network)

    # The last message, of one entity or of any.
    for key in ("@q/EstimatedState", "@q/EstimatedState/Navigation", "@q/EstimatedState/*"):
        answer = process.ask(f"get imc/{NAME}/{key}")
        (reply,) = answer["replies"]
        assert (reply["abbrev"], reply["src"]) == ("EstimatedState", SYSTEM)
        assert reply["key"] == f"imc/{NAME}/{key.replace('*', 'Navigation')}"
        assert answer["seconds"] < 1.0 * slowness()
    everything = process.ask(f"get imc/{NAME}/@q/**")["replies"]
    assert len({reply["key"] for reply in everything}) == len(everything) > 50
    assert {"EntityState", "Heartbeat", "PlanControlState", "VehicleState"} <= {r["abbrev"] for r in everything}
    assert process.ask(f"get imc/{NAME}/@q/SmsRequest")["replies"] == []

    # Requests.
    (reply,) = ask(process, imc.PlanDB(), type=DB.Type.REQUEST, op=DB.Op.GET_STATE, request_id=77)["replies"]
    assert (reply["abbrev"], reply["dst"], reply["type"]) == ("PlanDB", CONSOLE, DB.Type.SUCCESS)
    (reply,) = ask(process, imc.PlanDB(), type=DB.Type.REQUEST, op=DB.Op.GET, plan_id="none")["replies"]
    assert (reply["type"], reply["info"]) == (DB.Type.FAILURE, "undefined plan")
    answer = ask(process, imc.QueryEntityParameters(), name="Navigation")
    (reply,) = answer["replies"]
    assert (reply["abbrev"], reply["name"]) == ("EntityParameters", "Navigation")
    assert answer["seconds"] < 1.0 * slowness()
    (reply,) = ask(process, imc.EntityList(), op=QUERY)["replies"]
    assert "Navigation=" in reply["list"]

    # A command without a reply comes back; what is not accepted is refused with its reason, and takes no later reply.
    set_, hdop = imc.SetEntityParameters(), "GPS Maximum HDOP"
    for value in ("banana", "4.5", "banana", "banana", "5.5"):
        answer = ask(
            process, set_, name="Navigation", params=[{"abbrev": "EntityParameter", "name": hdop, "value": value}]
        )
        assert answer["seconds"] < 1.0 * slowness()
        if value == "banana":
            assert answer["replies"] == []
            assert f"{hdop} = 'banana' from 0x4123: " in answer["errors"][0]
        else:
            assert value in answer["replies"][0]["text"]
    (reply,) = ask(process, imc.SaveEntityParameters(), name="Navigation")["replies"]
    assert reply["abbrev"] == "SaveEntityParameters"
    for message, fields, reason in (
        (imc.QueryEntityParameters(), {"name": "NoSuch"}, f"no task of {NAME} has the entity label 'NoSuch'"),
        (imc.QueryEntityInfo(), {"dst_ent": 253}, f"{NAME} has no answer to this QueryEntityInfo"),
        (imc.EstimatedState(), {}, "EstimatedState is no request"),
        (imc.PlanDB(), {"dst": 0x1234}, "is addressed (dst) to 0x1234; this is 0x001A"),
        (imc.PlanDB(), {"type": DB.Type.SUCCESS}, "the type of a PlanDB that asks is REQUEST (0)"),
    ):
        answer = ask(process, message, **fields)
        assert answer["replies"] == []
        assert reason in answer["errors"][0]
        assert answer["seconds"] < 1.0 * slowness()

    # What is no request is refused with its reason.
    for key, request, reason in (
        ("PlanDB", {"abbrev": "PlanControl", "src": CONSOLE}, "belongs to"),
        ("PlanDB", {"abbrev": "PlanDB", "src": SYSTEM}, "source"),
        ("PlanDB", {"abbrev": "PlanDB"}, "source"),
    ):
        answer = process.ask(f"get imc/{NAME}/@q/{key} {json.dumps(request)}")
        assert answer["replies"] == []
        assert reason in answer["errors"][0]
        assert answer["seconds"] < 1.0 * slowness()

    # So is one that forgot its packet.
    answer = process.ask(f"get imc/{NAME}/@q/QueryEntityParameters")
    assert (answer["replies"], len(answer["errors"])) == ([], 1)
    assert "send its packet as the payload" in answer["errors"][0]

    # A late joiner has the states before they are published again.
    for message in ("EntityList", "VehicleState", "PlanControlState", "PlanDBState", "EntityParameters"):
        heard = process.ask(f"late imc/{NAME}/{message}/* 0.4")["heard"]
        assert heard, message
        assert heard[0]["after"] < 0.35 * slowness()
        if message == "EntityParameters":
            assert {"Navigation", "Daemon"} <= {one["name"] for one in heard}

    # A change is in the state of the next one, as soon as it is published: perhaps just after the reply.
    ask(process, imc.PlanDB(), type=DB.Type.REQUEST, op=DB.Op.DEL, plan_id="dive")
    process.until(lambda answer: "dive" not in answer["replies"][0]["text"], f"get imc/{NAME}/@q/PlanDBState")
    (state,) = process.ask(f"late imc/{NAME}/PlanDBState/* 0.4")["heard"]
    assert "dive" not in state["text"]
    (reply,) = ask(process, imc.Abort())["replies"]
    assert reply["abbrev"] == "Abort"


@pytest.mark.heavy
def test_births_and_deaths_are_seen_within_a_second(network: Network, tmp_path: Path) -> None:
    first = Vehicle(network, tmp_path / "first")
    wait_until(first.swims, first)
    process = asker(network)
    assert process.ask("watch imc/*/@alive/**") == {"watching": "imc/*/@alive/**"}
    token = f"imc/{NAME}/@alive/{SYSTEM:04x}/main"
    assert process.line() == {"token": token, "born": True}
    for how in (signal.SIGTERM, signal.SIGKILL):
        first.popen.send_signal(how)
        first.popen.wait()
        died = time.monotonic()
        assert process.line() == {"token": token, "born": False}
        assert time.monotonic() - died < 1.0 * slowness()
        if how == signal.SIGTERM:
            first = Vehicle(network, tmp_path / "second")
            wait_until(first.swims, first)
            assert process.line() == {"token": token, "born": True}


@pytest.mark.heavy
def test_a_process_that_is_stopped_is_given_up_in_seconds_and_known_again_when_it_goes_on(
    network: Network, tmp_path: Path
) -> None:
    vehicle = Vehicle(network, tmp_path)
    wait_until(vehicle.swims, vehicle)
    process = asker(network)
    process.ask("watch imc/*/@alive/**")
    token = f"imc/{NAME}/@alive/{SYSTEM:04x}/main"
    assert process.line() == {"token": token, "born": True}
    vehicle.popen.send_signal(signal.SIGSTOP)
    stopped = time.monotonic()
    assert process.line() == {"token": token, "born": False}
    assert 2.0 < time.monotonic() - stopped < 8.0 * slowness()
    vehicle.popen.send_signal(signal.SIGCONT)
    assert process.line() == {"token": token, "born": True}
