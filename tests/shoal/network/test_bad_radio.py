"""Commands over a radio that loses a fifth, delays, reorders and doubles: they do their work, or say why not."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.outside import slowness

SCENE = Path(__file__).parent / "bad_radio.py"
REPOSITORY = Path(__file__).parents[3]


@pytest.mark.heavy
def test_commands_over_a_bad_radio_work_or_say_why_not_and_a_cut_is_forgotten_in_5_s(
    namespace: list[str], tmp_path: Path
) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(REPOSITORY), *sys.path])}
    done = subprocess.run(
        [*namespace, sys.executable, str(SCENE), str(tmp_path)],
        capture_output=True, text=True, timeout=280, cwd=REPOSITORY, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout)
    assert seen["alive"] == [True, True]
    assert seen["good"] < 20.0
    assert any(system["mode"] and system["lat"] for system in json.loads(seen["ls"]["out"])), seen["ls"]
    commands = [result for name in ("put", "list", "start", "status", "get", "set") for result in seen[name]]
    for result in commands:
        assert result["seconds"] < 30.0
        assert result["status"] == 0 or (result["status"] == 1 and result["err"].startswith("Error: ")), result
    assert sum(result["status"] == 0 for result in commands) >= len(commands) / 2
    for result in seen["get"] + seen["set"]:
        assert "no parameters" not in result["err"]
        assert "not accepted" not in result["err"]
    assert seen["cut"]["status"] == 1
    assert "no vehicle" in seen["cut"]["err"] or "does not answer" in seen["cut"]["err"]
    assert seen["again"] < 5.0 * slowness()
    for result in seen["stop"]:
        assert result["status"] == 0 or "no plan is running" in result["err"], result
