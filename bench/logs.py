"""Compares imc with imcpy on logs: all messages, first index, one type of an indexed log, one field of a large log.

Run it on a quiet machine: `python bench/logs.py` (200 MB of logs, two minutes), with `--large` also 1 GB and 2 GB.
Each pair runs alternately, and the best time counts; a ratio above 1 means that imc is faster. imcpy is timed reading
objects, since it has nothing else; its import needs pandas.
"""

import argparse
import gzip
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import perf_counter

import imcpy
from imcpy.lsf import LSFReader
from make_log import make

import imc
from imc.lsf import LsfWriter
from imc.lsf.index_file import path_in_cache
from imc.lsf.writer import BLOCK

Run = Callable[[Path], object]

MEMORY = """
import sys, imc

def peak():
    return int(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))) // 1024

log = imc.Log(sys.argv[1], keep_index=False)
log.counts()
print(f"2 GB: {peak()} MiB at most to open and index it,", end=" ")
rows = log["EstimatedState"]
print(f"{peak()} MiB with the {rows.nbytes >> 20} MiB of EstimatedState")
"""


def forget(log: Path) -> None:
    """Remove the indices of both."""
    for index in (*path_in_cache(log), log.with_suffix(".imcpy_idx")):
        index.unlink(missing_ok=True)


def our_columns(path: Path, crc: bool = True) -> int:
    """All messages: types with only numbers as arrays, the others as objects, not decoded yet."""
    log = imc.Log(path, crc=crc, keep_index=False)
    counts = log.counts()
    numbers = [name for name in counts if not set(log.schema[name].WIRE) & set("TRML")]
    arrays = log.arrays(*numbers)
    objects = [log.objects(name) for name in counts if name not in arrays]
    return sum(map(len, arrays.values())) + len(objects)


def our_columns_unchecked(path: Path) -> int:
    return our_columns(path, crc=False)


def our_messages(path: Path) -> int:
    return sum(1 for _ in imc.Log(path))


def their_messages(path: Path) -> int:
    return sum(1 for _ in LSFReader.read(str(path), use_index=False, save_index=False))


def our_index(path: Path) -> int:
    forget(path)
    return len(imc.Log(path))


def their_index(path: Path) -> int:
    forget(path)
    with LSFReader(str(path)) as reader:
        return len(reader.idx)


def our_field(path: Path) -> float:
    return float(imc.Log(path)["EstimatedState"]["depth"].sum())


def their_field(path: Path) -> float:
    return sum(message.depth for message in LSFReader.read(str(path), types=[imcpy.EstimatedState]))


def our_index_threaded(path: Path) -> int:
    forget(path)
    with ThreadPoolExecutor(2) as threads:
        return len(imc.Log(path, spread=threads.map))


def our_field_threaded(path: Path) -> float:
    with ThreadPoolExecutor(2) as threads:
        return float(imc.Log(path, spread=threads.map)["EstimatedState"]["depth"].sum())


def pack(plain: Path, packed: Path) -> None:
    """Compress a log as Shoal does."""
    writer = LsfWriter(packed)
    with plain.open("rb") as file:
        while block := file.read(BLOCK):
            writer.write(block)
    writer.close()


def seconds(run: Run, path: Path) -> float:
    """The time (s) it takes in a new process, without imports and without reading the definitions."""
    command = [sys.executable, __file__, "--time", run.__name__, str(path)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def compare(name: str, ours: Run, theirs: Run, path: Path, rounds: int, target: float) -> None:
    times = [(seconds(ours, path), seconds(theirs, path)) for _ in range(rounds)]
    best, their_best = map(min, zip(*times, strict=True))
    ratio = f"{their_best / best:6.1f} x   (wanted {target:g} x)"
    print(f"{name:44} {best:8.3f} s {their_best:8.3f} s   {ratio}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--mb", type=float, default=200.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--large", action="store_true", help="also 1 GB and 2 GB, needs 4 GB of disk")
    parser.add_argument("--time", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.time:
        imc.builtin()
        begin = perf_counter()
        globals()[arguments.time[0]](Path(arguments.time[1]))
        print(perf_counter() - begin)
        return
    rounds = arguments.rounds
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "Data.lsf"
        count = make(path, arguments.mb, arguments.seed)
        print(f"{count} messages, {path.stat().st_size / 1e6:.0f} MB{'':26} imc       imcpy")
        compare("all messages into columns, CRCs checked", our_columns, their_messages, path, rounds, 5)
        compare("all messages into columns, not checked", our_columns_unchecked, their_messages, path, rounds, 8)
        compare("all messages as objects", our_messages, their_messages, path, rounds, 1)
        compare("first index, CRCs checked, written", our_index, their_index, path, rounds, 8)
        compare("one type of an indexed log", our_field, their_field, path, rounds, 20)

        packed = Path(folder) / "packed" / "Data.lsf.gz"
        packed.parent.mkdir()
        with path.open("rb") as file, packed.open("wb") as out:
            for _ in range(800):
                out.write(gzip.compress(file.read(1 << 17), 1))
        begin = perf_counter()
        imc.Log(packed).counts()
        middle = perf_counter()
        imc.Log(packed)["EstimatedState"]
        end = perf_counter()
        print(f"gzip, 105 MB unpacked: first index {middle - begin:.2f} s, one type then {end - middle:.2f} s")
        forget(packed)
        packed.unlink()

        make(path, 300, arguments.seed)
        pack(path, packed)
        for name, index, field in (
            ("in order", our_index, our_field),
            ("2 threads", our_index_threaded, our_field_threaded),
        ):
            first = min(seconds(index, packed) for _ in range(rounds))
            then = min(seconds(field, packed) for _ in range(rounds))
            print(f"gzip, 300 MB unpacked {name}: first index {first:.2f} s, one type then {then:.2f} s", flush=True)
        forget(packed)
        forget(path)

        if arguments.large:
            make(path, 1000, arguments.seed)
            forget(path)
            for run in (our_index, their_index):
                seconds(run, path)
            our_field(path)
            compare("one field of an indexed log of 1 GB", our_field, their_field, path, rounds, 20)
            forget(path)
            make(path, 2000, arguments.seed)
            subprocess.run([sys.executable, "-c", MEMORY, str(path)], check=True)


if __name__ == "__main__":
    main()
