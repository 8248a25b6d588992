"""Messages of a user's own: typed, subscribed, logged with their definitions, and refused where nobody knows them."""

import json
import os
import re
import shutil
from pathlib import Path

import pytest

import imc
from runtime import Task, consume, periodic
from runtime.testing import simulate
from shoal import connect
from shoal.network import Refused
from tests.shoal.cli.installed import shoal
from tests.shoal.network.running import running

DEFINITIONS = """name: IMC
version: 5.4.31
messages:
  WhaleCall:
    id: 30001
    name: Whale Call
    fields:
      level: {type: fp32_t, name: Sound Pressure Level, unit: dB}
"""
TASKS = '''"""Listens for whales."""

from pathlib import Path

import imc
from runtime import Task, consume, periodic

WhaleCall = imc.load(Path(__file__).with_name("own.yaml"), over=imc.builtin())["WhaleCall"]


class Hydrophone(Task):
    """Hears a whale each second."""

    @periodic(1.0)
    def listen(self) -> None:
        self.publish(WhaleCall(level=120.0))


class Counter(Task):
    """Counts whales."""

    @consume
    def count(self, call: WhaleCall) -> None:
        self.publish(imc.Temperature(value=call.level))
'''
VEHICLE = "lauv-noptilus-1"
PROFILE = """[Require lauv-noptilus-1.ini]
[General]
Messages = own.yaml
[whales.Hydrophone]
Enabled = Kinematic
[whales.Counter]
Enabled = Kinematic
"""


@pytest.fixture
def project(tmp_path):
    for name, text in (("own.yaml", DEFINITIONS), ("whales.py", TASKS), ("my.ini", PROFILE)):
        (tmp_path / name).write_text(text)
    return tmp_path


def run(project):
    return shoal("run", "./my.ini", "-p", "Kinematic", "--clock", "virtual", "--for", "3s", cwd=project)


@pytest.mark.heavy
def test_own_messages_are_received_and_logged_with_their_definitions(project):
    status, _, err = run(project)
    assert (status, "error" in err) == (0, False)
    folder = next(project.glob("log/*/*/*"))
    log = imc.Log(folder)
    messages = list(log)
    calls = [message for message in messages if type(message).__name__ == "WhaleCall"]
    assert [call.level for call in calls] == [120.0] * 3
    (hydrophone,) = {call.src_ent for call in calls}
    warm = [message for message in messages if isinstance(message, imc.Temperature) and message.value > 100.0]
    assert [message.value for message in warm] == [120.0] * 3
    assert hydrophone not in {message.src_ent for message in warm}, "another task publishes it"
    assert log.schema["WhaleCall"].ID == 30001
    assert shoal("check", "my.ini", cwd=project)[:2] == (0, "my.ini: nothing wrong\n")
    status, out, err = shoal("resim", str(folder), "--task", "whales.Counter", "--code", ".", cwd=project)
    assert (status, "0 bytes of difference" in out) == (0, True), err
    status, out, _ = shoal("message", "WhaleCall", "--messages", "own.yaml", cwd=project)
    assert (status, "id 30001" in out, "level" in out) == (0, True, True)


@pytest.mark.heavy
def test_a_run_with_a_task_that_consumes_own_messages_can_be_rewound(project):
    (project / "my.ini").write_text(PROFILE.replace("Kinematic", "Simulation"))
    words = ("run", "./my.ini", "-p", "Simulation", "--clock", "virtual", "--for", "6s")
    assert shoal(*words, cwd=project)[0] == 0
    log = min(project.glob("log/*/*/*"))
    status, out, err = shoal("rewind", log, "--at", "2s", "--for", "2s", "--code", ".", cwd=project)
    assert status == 0, out + err
    (again,) = project.glob("log/*/*/000002")
    assert [type(m).__name__ for m in imc.Log(again)].count("WhaleCall") == 2


@pytest.mark.heavy
@pytest.mark.parametrize("network", ["udp", pytest.param("zenoh", marks=pytest.mark.heavy)])
def test_own_messages_of_a_running_vehicle(project, network):
    answering = TASKS.replace("@consume\n", "@consume(others=True)\n")
    answering = answering.replace("Temperature(value=call.level)", "Turbidity(value=call.level, dst=call.src)")
    (project / "whales.py").write_text(answering)
    over_udp = "[Transports.UDP]\nTransports+= WhaleCall\n"
    (project / "my.ini").write_text(PROFILE.replace("Kinematic", "Simulation") + over_udp)

    def asked(*words):
        status, out, err = shoal(*words, "--messages", "own.yaml", "--json", cwd=project, **where)
        assert status == 0, err
        return [json.loads(line) for line in out.splitlines()]

    with running(project, network=network, profile="my") as vehicle:
        where = {name: os.environ[name] for name in ("SHOAL_CONNECT", "SHOAL_DISCOVERY")}
        (call,) = asked("spy", VEHICLE, "WhaleCall", "--where", "WhaleCall.level > 100", "--count", 1)
        assert (call["abbrev"], call["level"], call["entity"]) == ("WhaleCall", 120.0, "Hydrophone")
        (reply,) = asked("send", VEHICLE, "WhaleCall", "level=90", "--wait", "1s")
        assert (reply["abbrev"], reply["value"]) == ("Turbidity", 90.0)
        status, out, err = shoal(
            "spy", VEHICLE, "--entities", "Hydrophone", "--for", "2.5s", "--json", cwd=project, **where
        )
        assert (status, {json.loads(line)["id"] for line in out.splitlines()}) == (0, {30001})
        assert err.count("there is no message with id 30001 here: name its definition with --messages") == 1
        own = imc.load(project / "own.yaml", over=imc.builtin())
        with connect(VEHICLE, messages=own) as there:
            assert next(there.messages(own["WhaleCall"], where="level > 100")).level == 120.0
        another_way = "defines WhaleCall (id 30001) in another way: use the same file here and in [General] Messages"
        unknown = "has no message WhaleCall (id 30002): name its file in [General] Messages there"
        for old, new, reason in (("Level", "Depth", ""), ("level", "loud", another_way), ("30001", "30002", unknown)):
            (project / "other.yaml").write_text(DEFINITIONS.replace(old, new))
            words = "send", VEHICLE, "WhaleCall", f"{'loud' if new == 'loud' else 'level'}=1"
            status, out, err = shoal(*words, "--messages", "other.yaml", cwd=project, **where)
            refused = f"Error: {VEHICLE} {reason}\n" if reason else ""
            assert (status, out == "", err) == (int(reason != ""), reason != "", refused)
        program = imc.load(project / "other.yaml", over=imc.builtin())
        with (
            connect(VEHICLE, messages=program) as there,
            pytest.raises(Refused, match=re.escape(unknown)),
        ):
            there.send(program["WhaleCall"]())
        with connect(VEHICLE) as there:
            there.send(imc.Unknown(id=30002, payload=b"?"))
            vehicle.until("dropped: there is no message with id 30002 here, see [General] Messages")


def test_a_program_that_names_a_file_for_a_schema_is_reported(project):
    with (
        pytest.raises(TypeError, match="not a schema such as"),
        connect(VEHICLE, messages="own.yaml"),
    ):
        pass


@pytest.mark.parametrize("words", [("spy", "x", "WhaleCall"), ("send", "x", "WhaleCall", "level=3")])
def test_an_own_message_without_its_file_is_an_error_that_tells_how_to_name_it(project, words):
    status, _, err = shoal(*words, cwd=project)
    assert status == 2
    assert "there is no message 'WhaleCall'" in err
    assert "a message of your own needs --messages FILE, the file of [General] Messages" in err
    (project / "own.yaml").write_text(DEFINITIONS.replace("30001", "350"))
    status, _, err = shoal(*words, "--messages", "own.yaml", cwd=project)
    assert (status, "WhaleCall (id 350) collides with EstimatedState" in err) == (2, True)


@pytest.mark.heavy
def test_a_run_with_own_messages_can_be_rewound_elsewhere(project):
    assert run(project)[0] == 0
    elsewhere = project / "elsewhere"
    elsewhere.mkdir()
    shutil.copytree(next(project.glob("log/*/*/*")), elsewhere / "received")
    status, _, err = shoal("rewind", "received", "--at", "1.5s", "--code", "..", cwd=elsewhere)
    assert status == 0, err
    again = imc.Log(next(elsewhere.glob("log/*/*/*")))
    assert [call.level for call in again if type(call).__name__ == "WhaleCall"] == [120.0]


@pytest.mark.heavy
def test_the_messages_of_a_log_are_those_in_it_whatever_is_in_the_present_folder(project):
    assert run(project)[0] == 0
    elsewhere = project / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "own.yaml").write_text(DEFINITIONS.replace("WhaleCall", "SealCall"))
    log = str(next(project.glob("log/*/*/*")))
    status, out, err = shoal("resim", log, "--task", "whales.Counter", "--code", "..", cwd=elsewhere)
    assert (status, "0 bytes of difference" in out, err) == (0, True, "")


@pytest.mark.heavy
def test_a_replay_logs_own_messages_with_their_definitions(project):
    assert run(project)[0] == 0
    log = next(project.glob("log/*/*/*"))
    status, _, err = shoal("replay", log, "--clock", "virtual", "--log-dir", "again", cwd=project)
    assert status == 0, err
    again = next(project.glob("again/*/*/*"))
    calls, played = (
        [call.level for call in imc.Log(folder) if type(call).__name__ == "WhaleCall"] for folder in (log, again)
    )
    assert played == calls
    assert set(played) == {120.0}


@pytest.mark.heavy
def test_a_message_that_the_vehicle_does_not_have_is_an_error(project):
    (project / "my.ini").write_text(PROFILE.replace("Messages = own.yaml\n", "").replace("[General]\n", ""))
    status, _, err = run(project)
    assert status != 0
    assert "my.ini:4: error: whales.Counter: WhaleCall (id 30001) is not a message of this vehicle: add its file" in err
    (project / "my.ini").write_text(
        (project / "my.ini").read_text().replace("Counter]\nEnabled = Kinematic", "Counter]")
    )
    status, _, err = run(project)
    assert status == 1
    assert "WhaleCall (id 30001) is not a message of this vehicle: add its file to [General] Messages" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DEFINITIONS.replace("30001", "350"), "WhaleCall (id 350) collides with EstimatedState"),
        (DEFINITIONS.replace("fp32_t", "fp31_t"), "own.yaml:8"),
        (None, "there is no file 'own.yaml'"),
    ],
)
def test_definitions_that_are_wrong_are_named(project, text, words):
    (project / "own.yaml").unlink() if text is None else (project / "own.yaml").write_text(text)
    (project / "whales.py").write_text(TASKS.replace('Path(__file__).with_name("own.yaml")', '"other.yaml"'))
    (project / "other.yaml").write_text(DEFINITIONS)
    status, _, err = run(project)
    assert status != 0
    assert "my.ini:3: error: [General] Messages: " in err
    assert words in err


def test_own_messages_in_simulate(tmp_path):
    path = Path(tmp_path / "own.yaml")
    path.write_text(DEFINITIONS)
    own = imc.load(path, over=imc.builtin())
    call = own["WhaleCall"]
    assert imc.load(path, over=imc.builtin())["WhaleCall"] is call
    assert own["EstimatedState"] is imc.EstimatedState

    class Echo(Task):
        """Answers a whale."""

        @consume
        def answer(self, heard: call) -> None:
            self.publish(call(level=heard.level + 1.0))

        @periodic(1.0)
        def idle(self) -> None: ...

    run = simulate(Echo, feed=[call(timestamp=0.5, level=100.0)], messages=own)
    assert [message.level for message in run.of(call)] == [101.0]
    with pytest.raises(imc.SchemaError, match=r"WhaleCall .id 30001. is not a message of this vehicle"):
        simulate(Echo, feed=[])
