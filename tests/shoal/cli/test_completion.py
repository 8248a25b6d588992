"""What the shell completes without a vehicle: names that were found before, fields, profiles."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from shoal.cli import main
from shoal.cli.completion import complete_without_command
from shoal.cli.recent_vehicles import recent_vehicles, remember_vehicles


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "shoal" / "vehicles.txt"


def completed(*words: str) -> list[str]:
    complete = ShellComplete(main, {}, "shoal", "_SHOAL_COMPLETE")
    return [item.value for item in complete.get_completions(list(words[:-1]), words[-1])]


def test_vehicles_that_were_found_are_remembered_for_a_week(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert recent_vehicles() == []
    monkeypatch.setattr("time.time", lambda: 1e9)
    remember_vehicles(["alfa", "bad\nname"])
    monkeypatch.setattr("time.time", lambda: 1e9 + 6 * 86400.0)
    remember_vehicles(["bravo"])
    assert recent_vehicles() == ["bravo", "alfa"]
    assert completed("spy", "a") == ["alfa"]
    assert completed("plan", "alfa,b") == ["alfa,bravo"]
    monkeypatch.setattr("time.time", lambda: 1e9 + 8 * 86400.0)
    assert recent_vehicles() == ["bravo"]
    own_cache.write_bytes(b"\xff\xfe rubbish\nsoon alfa\n")
    assert recent_vehicles() == []


def test_a_cache_that_cannot_be_written_is_no_reason_to_fail(tmp_path: Path) -> None:
    (tmp_path / "shoal").write_text("a file in its place")
    remember_vehicles(["alfa"])
    assert recent_vehicles() == []


def test_a_user_without_a_home_remembers_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a container with a user id that no passwd knows: commands such as abort must end well all the same."""

    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    remember_vehicles(["alfa"])
    assert recent_vehicles() == []


def test_fields_and_the_names_of_their_values_are_completed() -> None:
    assert completed("send", "x", "PlanControl", "pl") == ["plan_id="]
    assert completed("send", "x", "PlanControl", "op=ST") == ["op=START", "op=STOP"]
    assert completed("send", "x", "NoMessage", "op") == []
    assert completed("spy", "x", "EstimatedState", "--fields", "lat,de") == ["lat,depth"]


@pytest.mark.parametrize("command", ["run", "check", "explain", "mission"])
def test_profiles_are_completed(command: str) -> None:
    assert "lauv-noptilus-1" in completed(command, "lauv")


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("shell", "shown"), [("bash", "plain,alfa"), ("zsh", "plain\nalfa\n_"), ("fish", "plain,alfa")]
)
def test_a_vehicle_is_completed_without_the_imports_of_a_command(shell: str, shown: str) -> None:
    remember_vehicles(["alfa"])
    code = "import sys, shoal.cli\ntry:\n    shoal.cli.main()\nfinally:\n    print(*sys.modules, file=sys.stderr)\n"
    words = {"COMP_WORDS": "shoal spy al", "COMP_CWORD": "al" if shell == "fish" else "2"}
    environment = {**os.environ, **words, "_SHOAL_COMPLETE": f"{shell}_complete"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip() == shown
    assert not {"imc", "numpy", "zenoh", "shoal.network", "rich"} & set(done.stderr.split())


@pytest.mark.heavy
@pytest.mark.parametrize(
    "line",
    [
        "send x PlanC",
        "send x plancontrol pl",
        "send x PlanControl type=REQUEST op=ST",
        "send x NoMessage op",
        "spy alfa EstimatedState Rp",
        "spy alfa EstimatedState --fields lat,de",
        "spy alfa --fields la",
        *(f"{command} lauv" for command in ("run", "check", "explain", "mission", "service")),
        "check otter lauv",
    ],
)
def test_names_are_those_that_the_command_completes_without_its_imports(line: str) -> None:
    *words, incomplete = line.split()
    code = (
        "import json, sys\nfrom shoal.cli.completion import complete_without_command as complete\n"
        "print(json.dumps([item.value for item in complete(sys.argv[1:-1], sys.argv[-1])]), *sys.modules)"
    )
    command = [sys.executable, "-c", code, *words, incomplete]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found, end = json.JSONDecoder().raw_decode(done.stdout)
    assert found == completed(*words, incomplete)
    assert not {"numpy", "zenoh", "rich", "asyncio", "yaml", "shoal.network", "runtime.vehicle"} & set(
        done.stdout[end:].split()
    )


@pytest.mark.parametrize("line", ["run --lo", "mission otter pl", "spy alfa --entity G", "send x -", "message Est"])
def test_only_the_command_knows_the_other_words(line: str) -> None:
    *words, incomplete = line.split()
    assert complete_without_command(words, incomplete) is None
