"""Real shells with their scripts complete what is typed into them."""

import os
import pty
import select
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from shoal.cli.recent_vehicles import remember_vehicles
from tests.outside import until

SHELLS = {
    "bash": ("bash --norc --noprofile -i", "source script"),
    "zsh": ("zsh -f -i", "autoload -U compinit; compinit -u; source script"),
    "fish": ("fish --no-config --private", "source script"),
}
SHOAL = """#!/bin/sh
if [ -n "$_SHOAL_COMPLETE" ]; then
    "{python}" -c 'from shoal.cli import main; main(prog_name="shoal")'
    touch answered
else
    printf '%s\\n' "$@" > given.part
    mv given.part given
fi
"""
Complete = Callable[[str], list[str]]
pytestmark = pytest.mark.heavy


@pytest.fixture(params=SHELLS)
def complete(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Complete]:
    """The arguments that a command is given if a line is typed, Tab and Enter."""
    shell = str(request.param)
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} is installed")  # a machine needs bash only
    for name, value in {"HOME": tmp_path, "XDG_CACHE_HOME": tmp_path / "cache", "TERM": "xterm"}.items():
        monkeypatch.setenv(name, str(value))
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    remember_vehicles(["alfa", "bravo"])
    Path("shoal").write_text(SHOAL.format(python=sys.executable))
    Path("shoal").chmod(0o755)
    script = subprocess.run(["shoal"], env={**os.environ, "_SHOAL_COMPLETE": f"{shell}_source"}, stdout=subprocess.PIPE)
    Path("script").write_bytes(script.stdout)
    command, setup = SHELLS[shell]
    process, terminal = pty.fork()
    if process == 0:
        os.execvp(command.split()[0], command.split())
    shown = bytearray()

    def is_there(file: str) -> bool:
        while select.select([terminal], [], [], 0.05)[0]:
            shown.extend(os.read(terminal, 65536))
        return Path(file).exists()

    def type_keys(keys: str, file: str) -> None:
        Path(file).unlink(missing_ok=True)
        os.write(terminal, keys.encode())
        until(lambda: is_there(file), 60.0, told=lambda: bytes(shown))

    def completed(line: str) -> list[str]:
        type_keys(f"{line}\t", "answered")
        type_keys("\r", "given")
        return Path("given").read_text().splitlines()

    try:
        type_keys(f"{setup}; touch ready\r", "ready")
        yield completed
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        os.close(terminal)


def test_a_shell_completes_vehicles_profiles_messages_fields_and_values(complete: Complete) -> None:
    assert complete("shoal che") == ["check"]
    assert complete("shoal run lauv-n") == ["run", "lauv-noptilus-1"]
    assert complete("shoal spy alfa,br") == ["spy", "alfa,bravo"]
    assert complete("shoal spy x LogBookEn") == ["spy", "x", "LogBookEntry"]
    assert complete("shoal spy x EstimatedState --fields lat,de") == [
        *("spy", "x", "EstimatedState", "--fields", "lat,depth")
    ]
    assert complete("shoal send x PlanControl pl") == ["send", "x", "PlanControl", "plan_id="]
    assert complete("shoal send x PlanControl type=REQUEST op=STA") == [
        *("send", "x", "PlanControl", "type=REQUEST", "op=START")
    ]
