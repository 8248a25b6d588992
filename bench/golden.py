"""The golden hash: the SHA-256 of the log of a minute of lauv-noptilus-1 in virtual time.

`--check` fails if it differs from the one in golden.txt; without it, golden.txt is written. The file names its
platform, because the last digit of a sine may differ on others.
"""

import gzip
import hashlib
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

FILE = Path(__file__).with_name("golden.txt")


def run() -> str:
    with tempfile.TemporaryDirectory() as folder:
        command = ["run", "lauv-noptilus-1", "-p", "Simulation", "--clock", "virtual", "--for", "60s"]
        command += ["--seed", "1", "--log-dir", "log"]
        subprocess.run([sys.executable, "-m", "shoal.cli", *command], check=True, cwd=folder, capture_output=True)
        logs = sorted(Path(folder).glob("log/*/*/*/Data.lsf.gz"))
        return hashlib.sha256(b"".join(gzip.decompress(log.read_bytes()) for log in logs)).hexdigest()


def main() -> int:
    found = run()
    if "--check" not in sys.argv[1:]:
        where = f"{platform.machine()}, {platform.libc_ver()[0]} {platform.libc_ver()[1]}"
        FILE.write_text(f"{found}\n{where}\n")
        return 0
    golden = FILE.read_text().split("\n")
    if found != golden[0]:
        print(f"{found} is not the golden {golden[0]}, made with {golden[1]}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
