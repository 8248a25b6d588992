"""A virtual run of a shipped vehicle in two logs: before its plan, and with it."""

import subprocess
import sys
from pathlib import Path

SECONDS = 40


def record_run(folder: Path) -> tuple[Path, Path]:
    """The folders of both logs."""
    command = [sys.executable, "-m", "shoal.cli", "run", "lauv-noptilus-1", "-p", "Simulation", "--clock", "virtual"]
    subprocess.run([*command, "--for", str(SECONDS), "--log-dir", str(folder)], check=True, capture_output=True)
    before, dive = sorted(folder.glob("*/*/*"))
    return before, dive
