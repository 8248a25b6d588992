"""A file whose data is lost, as a file system leaves it after a power cut, yields no message that the log never had."""

from collections import Counter
from pathlib import Path
from shutil import copy

import pytest

import imc
from tests.command import shoal

DUNE = Path(__file__).parents[2] / "data" / "logs" / "dune-idle"


def packets(folder: Path) -> Counter[bytes]:
    return packets_of(imc.Log(folder, keep_index=False))


def packets_of(log: imc.Log) -> Counter[bytes]:
    return Counter(imc.encode(message) for message in log.messages())


def damage(source: Path, folder: Path, share: float, filling: bytes, length: int | None) -> Path:
    """A copy of a log, of which bytes from a place on are replaced; `length` None: all."""
    data = (source / "Data.lsf.gz").read_bytes()
    place = int(share * len(data))
    lost = len(data) - place if length is None else min(length, len(data) - place)
    folder.mkdir()
    (folder / "Data.lsf.gz").write_bytes(data[:place] + filling * lost + data[place + lost :])
    if (source / "IMC.xml.gz").exists():
        copy(source / "IMC.xml.gz", folder)
    return folder


@pytest.mark.parametrize(("filling", "length"), [(b"\0", None), (b"\0", 4096), (b"\xff", None), (b"\xff", 512)])
def test_a_filling_in_place_of_data_unpacks_to_no_packet(tmp_path: Path, filling: bytes, length: int | None) -> None:
    whole = packets(DUNE)
    for tenth in range(1, 10):
        made = damage(DUNE, tmp_path / str(tenth), tenth / 10, filling, length)
        log = imc.Log(made, keep_index=False)
        found = packets_of(log)
        assert not found - whole
        assert len(found) > 100 * tenth
        assert "its data is lost from byte" in log.losses[-1].reason


@pytest.mark.heavy
def test_a_log_with_a_zero_filled_tail_has_no_copies_and_a_repaired_one_neither(tmp_path: Path) -> None:
    options = ["-p", "Simulation", "--clock", "virtual", "--for", "8s", "--log-dir", str(tmp_path / "log")]
    assert shoal("run", "lauv-noptilus-1", *options).exit_code == 0
    source = max(tmp_path.rglob("Data.lsf.gz"), key=lambda path: path.stat().st_size).parent
    whole = packets(source)
    for tenth in range(2, 10):
        made = damage(source, tmp_path / str(tenth), tenth / 10, b"\0", None)
        out = tmp_path / f"repaired {tenth}"
        said = shoal("log", "doctor", str(made), "--repair", str(out))
        assert "its data is lost from byte" in said.output, said.output
        for folder in (made, out):
            found = packets(folder)
            assert not found - whole
            assert len(found) > 0
