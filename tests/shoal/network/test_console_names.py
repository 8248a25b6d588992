"""A vehicle knows the people who use it: consoles of Shoal announce a readable name, by each network."""

import getpass
import socket
import time
from pathlib import Path

import pytest

import imc
import shoal
from shoal.network.link import LONGEST_NAME, ConsoleIdentity
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
WHO = f"shoal-{getpass.getuser()}@{socket.gethostname()}"[:LONGEST_NAME] + "-4202"
PLACES = {"zenoh": "over zenoh", "tcp": "over tcp", "udp": "at 127.0.0.1", "both": ""}


@pytest.mark.heavy
@pytest.mark.parametrize("network", PLACES)
def test_the_log_of_a_vehicle_names_each_console_once(
    network: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHOAL_CONSOLE", "0x4202")
    with running(tmp_path, network=network) as process:
        with shoal.connect(NAME) as vehicle:
            process.until(f"new system within range: {WHO} (0x4202) {PLACES[network]}")
            assert vehicle.latest(imc.EstimatedState).src == 0x001A
        time.sleep(0.2)
        with shoal.connect(NAME) as vehicle:  # the same console comes again
            assert vehicle.param.get("Path Control")
        printed = process.log.read_text()
    assert printed.count("new system within range") == 1
    assert "is also used by" not in printed


def test_a_name_is_one_word_that_fits_into_keys_and_logs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "a pc " + 80 * "x")
    monkeypatch.setattr(getpass, "getuser", lambda: "Ana Maria")
    name = ConsoleIdentity.of_this_program(0x4A31).name
    assert name.startswith("shoal-Ana_Maria@a_pc_xxx")
    assert name.endswith("-4A31")
    assert len(name) <= 64


def test_a_computer_without_a_table_of_users_has_consoles_with_names(monkeypatch: pytest.MonkeyPatch) -> None:
    def nobody() -> str:
        raise KeyError("getpwuid(): uid not found: 1234")

    monkeypatch.setattr(getpass, "getuser", nobody)
    monkeypatch.setattr("os.getuid", lambda: 1234)
    assert ConsoleIdentity.of_this_program(0x4A31).name.startswith("shoal-1234@")
