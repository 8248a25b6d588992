"""`shoal ls` of systems that are no vehicles of Shoal, and may be hostile."""

import asyncio
import contextlib
import json
from pathlib import Path

import pytest
from click.testing import Result

import imc
from shoal.network.system_table import NetworkSystem
from tests.command import shoal
from tests.outside import NO_FILE, until
from tests.shoal.network.running import running
from tests.shoal.network.station import OWN, Station, discovery_ports, living

NO_GPS = ("Sensors.GPS:Enabled=Always", "Sensors.GPS:Serial Port - Device=/dev/no-gps", "Simulators.GPS:Enabled=Never")


class Taciturn(Station):
    """Tells the state of its entity only if it is asked, once."""

    def listen(self) -> None:
        before = len(self.heard)
        super().listen()
        if any(isinstance(message, imc.QueryEntityState) for message in self.heard[before:]):
            self.send(self.packet(imc.EntityState(state=imc.EntityState.State.FAULT, description="wet")))


def ls(monkeypatch: pytest.MonkeyPatch, *options: str, name: str = "other") -> Result:
    """The command while two stations with one id are there."""
    ports = discovery_ports()
    monkeypatch.setenv("SHOAL_DISCOVERY", f"{ports[0]}-{ports[-1]}")

    async def act() -> Result:
        async with contextlib.AsyncExitStack() as stack:
            for station in (Station(ports), Station(ports[:-1], name=name)):
                await stack.enter_async_context(living(station))
            return await asyncio.to_thread(shoal, "ls", "--connect", "udp", *options)

    return asyncio.run(act())


@pytest.mark.heavy
def test_two_vehicles_of_one_id_are_reported_of(monkeypatch: pytest.MonkeyPatch) -> None:
    words = f"its id 0x{OWN:04X} is also that of "
    found = {
        system["name"]: system["clash"] for system in json.loads(ls(monkeypatch, "--json", "--for", "0.8s").stdout)
    }
    assert found["station"].startswith(f"{words}other at ")
    assert found["other"].startswith(f"{words}station at ")
    lines = ls(monkeypatch, "--watch", "--for", "1s").stdout.splitlines()
    assert any(f" station here; {words}other at " in line for line in lines), lines


@pytest.mark.heavy
def test_states_of_entities_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """They come once a second, or later; who asks need not wait."""
    ports = discovery_ports()
    monkeypatch.setenv("SHOAL_DISCOVERY", f"{ports[0]}-{ports[-1]}")
    monkeypatch.setattr("shoal.cli.ls.LONGEST", 60.0)
    station = Taciturn(ports)
    also = [station.packet(imc.VehicleState()), station.packet(imc.EstimatedState())]

    async def act() -> Result:
        async with living(station, also=also):
            return await asyncio.to_thread(shoal, "ls", "--connect", "udp", "--json")

    assert json.loads(asyncio.run(act()).stdout)[0]["errors"] == ["0"]
    assert [type(message) for message in station.heard].count(imc.QueryEntityState) == 1


def test_a_stranger_does_not_write_to_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(NetworkSystem, "addresses", ["at \x1b[2J"])
    assert "\\x1b[2J" in ls(monkeypatch, "--for", "0.3s").stderr
    assert "\x1b" not in ls(monkeypatch, "--for", "0.3s").stderr


@pytest.mark.heavy
def test_a_long_wait_for_a_program_that_does_not_answer_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.search_report.EXPLAINED", 0.1)
    ports = discovery_ports()
    monkeypatch.setenv("SHOAL_DISCOVERY", f"{ports[0]}-{ports[-1]}")
    late = Station(ports)

    async def act() -> Result:
        asyncio.get_running_loop().call_later(0.5, late.announce)
        return await asyncio.to_thread(shoal, "ls", "--connect", "udp")

    with contextlib.closing(late):
        result = asyncio.run(act())
    explained = "no answer yet; waiting up to 11 s, since DUNE announces itself every 10 s\n"
    assert (result.exit_code, result.stderr, "station" in result.stdout) == (0, explained, True)


@pytest.mark.heavy
def test_errors_are_those_of_all_entities(tmp_path: Path) -> None:
    """VehicleState names only those that a monitor watches; this vehicle has none, as with `-p Hardware`."""
    settings = [word for setting in NO_GPS for word in ("--set", setting)]
    with running(tmp_path, *settings, "--set", "Monitors.Entities:Enabled=Never", network="udp"):
        until(lambda: "GPS" in json.loads(shoal("ls", "--json").stdout or "[{}]")[0].get("errors", ()))
        found = json.loads(shoal("link", "--for", "1s", "--json").stdout)
    texts = [finding["text"] for finding in found["findings"]]
    assert f"GPS is not well: /dev/no-gps: {NO_FILE}" in texts


def test_a_vehicle_on_a_busy_computer_that_answers_after_another_is_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its socket has received the announcement, so it is there; without a program at any port, nobody waits."""
    ports = discovery_ports()
    monkeypatch.setenv("SHOAL_DISCOVERY", f"{ports[0]}-{ports[-1]}")
    prompt, busy = Station(ports), Station(ports[:-1], name="busy", system=OWN + 1)
    also = [prompt.packet(message) for message in (imc.VehicleState(), imc.EstimatedState(), imc.EntityState())]

    async def answer_late() -> None:
        while not busy.heard:
            busy.listen()
            await asyncio.sleep(0.02)
        await asyncio.sleep(0.7)
        busy.announce()

    async def act() -> Result:
        async with living(prompt, also=also):
            answer = asyncio.create_task(answer_late())
            result = await asyncio.to_thread(shoal, "ls", "--connect", "udp", "--json")
            await answer
        return result

    with contextlib.closing(busy):
        found = [system["name"] for system in json.loads(asyncio.run(act()).stdout)]
    assert found == ["busy", "station"]
