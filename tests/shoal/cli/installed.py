"""The command as users of an installed Shoal run it: in a folder of their own."""

import os
import subprocess
import sys
from pathlib import Path


def shoal(*words: object, cwd: Path) -> tuple[int, str, str]:
    """Run the command with the current folder off the search path; returns status, output and errors."""
    command = [sys.executable, "-m", "shoal.cli", *map(str, words)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONSAFEPATH": "1"}
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120, env=environment)
    return done.returncode, done.stdout, done.stderr
