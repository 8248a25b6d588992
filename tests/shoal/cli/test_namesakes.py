"""Two vehicles of one name, or of one id: both are shown, both are aborted, and nothing else is commanded."""

import asyncio
import contextlib

import pytest
from click.testing import Result

import imc
from tests.command import shoal
from tests.shoal.network.station import OWN, Station, discovery_ports, living


class Vehicle(Station):
    """Confirms an abort, unless it is `mute`."""

    mute = False

    def aborted(self) -> bool:
        return any(isinstance(message, imc.Abort) and message.dst == self.system for message in self.heard)

    late: "Vehicle | None" = None
    """Announces itself first when this vehicle has heard an abort, and before it confirms that."""

    def listen(self) -> None:
        super().listen()
        if not self.aborted():
            return
        if self.late is not None:
            self.late.announce()
            self.late = None
        elif not self.mute:
            self.send(self.packet(imc.Aborted()))


def command(
    monkeypatch: pytest.MonkeyPatch,
    *words: str,
    name: str = "station",
    system: int = OWN,
    mute: bool = False,
    is_late: bool = False,
) -> tuple[Result, list[bool]]:
    """The result of a command while `station` and a second vehicle are there; whether they have heard an abort."""
    ports = discovery_ports()
    monkeypatch.setenv("SHOAL_DISCOVERY", f"{ports[0]}-{ports[-1]}")
    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 1.0)

    async def act() -> tuple[Result, list[bool]]:
        both = Vehicle(ports), Vehicle(ports[:-1], name=name, system=system)
        both[1].mute = mute
        if is_late:
            both[0].late = both[1]
        async with contextlib.AsyncExitStack() as stack:
            for vehicle in both:
                announces = not (is_late and vehicle is both[1])
                await stack.enter_async_context(living(vehicle, announces=announces))
            result = await asyncio.to_thread(shoal, *words, "--connect", "udp")
            for vehicle in both:
                vehicle.listen()  # the command may have ended between two of its looks
        return result, [vehicle.aborted() for vehicle in both]

    return asyncio.run(act())


def test_an_abort_is_for_all_vehicles_of_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    result, heard = command(monkeypatch, "abort", "station", system=OWN + 1)
    assert (result.exit_code, result.stdout, heard) == (0, "all of them have aborted\n", [True, True])
    assert result.stderr.startswith("station: several vehicles have this name, with the ids 0x0B01, 0x0B02 (at ")


@pytest.mark.heavy
def test_one_of_two_that_does_not_confirm_the_abort_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    result, heard = command(monkeypatch, "abort", "station", system=OWN + 1, mute=True)
    assert (result.exit_code, heard) == (1, [True, True])
    assert "Abort was sent to all, but 0x0B02: station does not answer Abort" in result.stderr
    assert "0x0B01: station" not in result.stderr


@pytest.mark.heavy
@pytest.mark.parametrize("name", ["station", "other"])
def test_an_abort_is_for_all_vehicles_of_the_id(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over UDP they cannot be distinguished: one of them may not have confirmed it."""
    result, heard = command(monkeypatch, "abort", "station", name=name)
    assert (result.exit_code, heard) == (1, [True, True]), result.output
    assert "Abort was sent to all, but" in result.stderr


def test_an_abort_is_for_one_that_appears_before_it_is_confirmed(monkeypatch: pytest.MonkeyPatch) -> None:
    result, heard = command(monkeypatch, "abort", "station", is_late=True)
    assert (result.exit_code, heard) == (1, [True, True]), result.output
    assert "Abort was sent to all, but" in result.stderr


def test_spy_shows_all_vehicles_of_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    result, _ = command(monkeypatch, "spy", "station", "Heartbeat", "--for", "0.5s", "--json", system=OWN + 1)
    assert result.exit_code == 0, result.output
    assert {f'"src": {OWN}' in line for line in result.stdout.splitlines()} == {True, False}
    assert "several vehicles have this name" in result.stderr
