"""The command as users of an installed Shoal run it: in a process and a folder of their own."""

import atexit
import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

ENVIRONMENT = {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONSAFEPATH": "1"}
PATIENCE = 120.0  # s
SHOAL = [sys.executable, "-m", "shoal.cli"]
PARENT = """
import json, os, sys
from importlib import import_module

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.cli import COMMANDS, main

for module, _ in COMMANDS.values():
    import_module(module)
build(load_profile("lauv-noptilus-1"), {"Kinematic"}, clock=VirtualClock(0)).vehicle.close()
for line in sys.stdin:
    words, folder, *files = json.loads(line)
    child = os.fork()
    if child == 0:
        os.chdir(folder)
        for number, path in enumerate((os.devnull, *files)):
            os.dup2(os.open(path, os.O_RDWR), number)
        sys.argv[1:] = words
        main()
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@cache
def parent() -> "subprocess.Popen[str]":
    """A process that has imported Shoal, which takes longer than most commands; each command is a child of it."""
    command, pipe = [sys.executable, "-c", PARENT], subprocess.PIPE
    environment = {**os.environ, **ENVIRONMENT}
    started = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment, start_new_session=True)
    atexit.register(started.communicate)
    return started


def forget(process: "subprocess.Popen[str]") -> None:
    """End the process with its child: the next command must not get the answer of one that hangs."""
    parent.cache_clear()
    atexit.unregister(process.communicate)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


class Done(NamedTuple):
    """What came of a command."""

    returncode: int
    stdout: str
    stderr: str


def shoal(*words: object, cwd: Path, **environment: str) -> Done:
    """Run the command with the current folder off the search path."""
    if environment:
        command, whole = [*SHOAL, *map(str, words)], {**os.environ, **ENVIRONMENT, **environment}
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=PATIENCE, env=whole)
        return Done(done.returncode, done.stdout, done.stderr)
    process = parent()
    assert process.stdin is not None
    assert process.stdout is not None
    with tempfile.NamedTemporaryFile("r") as out, tempfile.NamedTemporaryFile("r") as err:
        try:
            process.stdin.write(json.dumps([[*map(str, words)], str(cwd), out.name, err.name]) + "\n")
            process.stdin.flush()
            is_done, _, _ = select.select([process.stdout], [], [], PATIENCE)
            answer = process.stdout.readline() if is_done else ""
            assert answer, f"{words}: no end within {PATIENCE:g} s; {out.read()}{err.read()}"
        except BaseException:
            forget(process)
            raise
        return Done(int(answer), out.read(), err.read())
