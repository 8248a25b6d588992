"""Files that unpack to gigabytes, or that are full of false beginnings, cost neither memory nor minutes."""

import base64
import gzip
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

import imc

PACKED_BOMB = (
    "c-nJ{%CIzaj8qGb<l}sFpE17Af#CoH1BU{GL4&WG(*o6%Tn*Dl<wxa*zPv|G{7Htcpc5c@7O;vlteVRvDmf>*bn=TAxmpBF_}1}+2>|5%?Ck"
)
"""1 GiB of zeros by bzip2, which takes 6 s: base64.b85encode(zlib.compress(bz2.compress(bytes(1 << 30)), 9))."""
CHILD = """
import sys
from click.testing import CliRunner
from shoal.cli import main
from tests.command import shoal

for line in sys.stdin.read().splitlines():
    done = shoal(*line.split())
    last = (done.output.strip().splitlines() or [""])[-1]
    trouble = "" if done.exception is None or isinstance(done.exception, SystemExit) else repr(done.exception)
    print(done.exit_code, trouble, last)
print(next(int(line.split()[1]) >> 10 for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def commands(folder: Path, *lines: str) -> list[str]:
    """Run commands in another process; exit status and last line of each. It may take 500 MiB."""
    done = subprocess.run(
        [sys.executable, "-c", CHILD], input="\n".join(lines), capture_output=True, text=True, check=True, cwd=folder
    )
    *results, peak = done.stdout.splitlines()
    assert int(peak) < 500
    return results


@pytest.mark.heavy
def test_bzip2_bomb(tmp_path: Path) -> None:
    bomb = zlib.decompress(base64.b85decode(PACKED_BOMB))
    (tmp_path / "bomb").mkdir()
    (tmp_path / "bomb" / "Data.lsf.bz2").write_bytes(bomb)
    assert len(bomb) < 1000
    lines = ("log info bomb", "log doctor bomb --repair clean", "log merge bomb bomb -o both", "log diff bomb bomb")
    results = commands(tmp_path, *lines, "log cut bomb part --to 5s", "log export bomb out --format csv", "log ls bomb")
    assert [result.split()[0] for result in results] == ["2", "2", "2", "2", "2", "2", "0"]
    assert "it unpacks to more than 1000 times its size" in results[0]
    assert all("Error" in result and result[2] == " " for result in results[:6])
    assert "no message in it" in results[6]


@pytest.mark.heavy
def test_bombs_as_definitions(tmp_path: Path) -> None:
    folder = tmp_path / "log"
    folder.mkdir()
    (folder / "Data.lsf").write_bytes(imc.encode(imc.Heartbeat(timestamp=1e9)))
    for elements in (b"<a/>" * 25_000_000, b"<a/>" * 500_000):
        (folder / "IMC.xml.gz").write_bytes(gzip.compress(b'<messages name="IMC" version="5">' + elements, 1))
        for result in commands(tmp_path, "log info log", "replay log"):
            assert result.startswith("2  Error: the definitions of the log are bad")
            assert "more than" in result


@pytest.mark.parametrize(
    ("suffix", "data"),
    [
        (".gz", b"\x1f\x8b\x08\0\0\0\0\0\0\xff" * 400_000),
        (".gz", (b"\x1f\x8b\x08\0\0\0\0\0\0\xff" + b"\x00\xff\xff\x00\x00") * 300_000),
        (".bz2", b"BZh91AY&SY" * 400_000),
        (".z", b"\x78\x9c" * 2_000_000),
    ],
)
def test_false_members_take_linear_time(tmp_path: Path, suffix: str, data: bytes) -> None:
    """Counted in bytes read, since a busy machine makes times longer."""
    from imc.lsf import COMPRESSIONS
    from imc.lsf.gzip_members import unpack_members

    form = next(form for form in COMPRESSIONS.values() if form.suffix == suffix)
    path = tmp_path / f"Data.lsf{suffix}"
    path.write_bytes(data)
    attempts = 0

    def counted() -> object:
        nonlocal attempts
        attempts += 1
        return form.unpacker()

    with path.open("rb") as file:
        for _ in unpack_members(file, form._replace(unpacker=counted)):
            pass
    assert attempts < len(data) / 100
