"""Flips random bytes in an indexed log and in its index, as failing disks do, and counts silent wrong rows.

`python bench/flips.py` makes the log of a shipped profile, packs it in all four ways and tries 1000 flips. Each flip is
seen by a program with the old index, and then taken back. Reading must give the true rows, or report damage.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import imc
from imc.lsf import COMPRESSIONS, LsfWriter, index_file
from imc.lsf.writer import BLOCK

FORMS = ("none", *COMPRESSIONS)


def packets_of_profile(folder: Path, profile: str = "lauv-noptilus-1", seconds: float = 20.0) -> bytes:
    """The packets in the log of a virtual run."""
    command = [sys.executable, "-m", "shoal.cli", "run", profile, "-p", "Simulation", "--clock", "virtual"]
    command += ["--for", f"{seconds}s", "--log-dir", "log"]
    subprocess.run(command, check=True, cwd=folder, capture_output=True)
    log = min(folder.glob("log/**/Data.lsf.gz"))
    return b"".join(packet for _, packet in imc.Log(log).packets())


def write(path: Path, data: bytes, form: str) -> Path:
    """Write packets as a log packed in one of FORMS."""
    path.parent.mkdir(parents=True)
    writer = LsfWriter(path.with_name("Data.lsf" + ("" if form == "none" else COMPRESSIONS[form].suffix)), form)
    for begin in range(0, len(data), BLOCK):
        writer.write(data[begin : begin + BLOCK])
    writer.close()
    return writer.path


def rows_of(log: imc.Log) -> dict[str, bytes]:
    """All rows by type, and some messages read one by one."""
    rows = {name: log[name].tobytes() for name in ("EstimatedState", "ServoPosition", "EulerAngles", "EntityState")}
    rows["objects"] = b"".join(map(imc.encode, log.objects("GpsFix")))
    rows["messages"] = b"".join(map(imc.encode, log.messages("Rpm", "LogBookEntry")))
    return rows


def flips(path: Path, count: int, seed: int) -> Iterator[str]:
    """Try flips; what came of each: "equal", "reported" or "silent: ..."."""
    chance, stamp = random.Random(seed), index_file.file_state(path)
    # A disk that loses bits changes neither the times nor, most often, the ends of a file.
    with patch.object(index_file, "file_state", lambda _: stamp), patch("imc.lsf.log.WORTH_KEEPING", 1):
        truth = rows_of(imc.Log(path))
        (index,) = index_file.path_in_cache(path)
        indexed = index.read_bytes()
        for number in range(count):
            index.write_bytes(indexed)
            target = index if number % 10 == 9 else path
            good = target.read_bytes()
            place, bit = chance.randrange(len(good)), 1 << chance.randrange(8)
            target.write_bytes(good[:place] + bytes((good[place] ^ bit,)) + good[place + 1 :])
            log = imc.Log(path)
            found = rows_of(log)
            wrong = [name for name in truth if found[name] != truth[name]]
            if not wrong:
                yield "equal"
            elif log.losses:
                yield "reported"
            else:
                yield f"silent: {', '.join(wrong)}, bit {bit} of byte {place} of {target.name}"
            target.write_bytes(good)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--profile", default="lauv-noptilus-1")
    arguments = parser.parse_args()
    silent = 0
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = f"{folder}/cache"
        data = packets_of_profile(Path(folder), arguments.profile)
        for number, form in enumerate(FORMS):
            path = write(Path(folder, form, "Data.lsf"), data, form)
            results = list(flips(path, arguments.count // len(FORMS), arguments.seed + number))
            counts = Counter(result.partition(":")[0] for result in results)
            print(f"{form:6} {sum(counts.values())} flips: {dict(counts)}", flush=True)
            silent += counts["silent"]
            print("".join(f"  {result}\n" for result in results if result.startswith("silent")), end="")
    print(f"{silent} silent wrong rows")
    sys.exit(silent > 0)


if __name__ == "__main__":
    main()
