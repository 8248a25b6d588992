"""Commands for a data set that work when they are pasted in this folder."""

import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from shoal.campaigns.dataset import DataSet
from shoal.campaigns.jobs import WALL_LIMIT

_LONGEST = 1 << 20


def rerun_command(data: DataSet, run: int) -> str:
    """Does a run again."""
    return shlex.join(["shoal", "campaign", "rerun", str(data.folder), "--run", str(run), *_code(data.about)])


def test_command(data: DataSet, scenario: Path) -> str:
    """Runs a scenario that a search has written."""
    return shlex.join(["shoal", "test", str(scenario), *_code(data.about)])


def rest_command(data: DataSet, runs: int) -> str:
    """Does what is left of `runs`. Paths are those of the data set, also if they are not on this computer."""
    about = data.about
    given = [word for place, value in about["fixed"].items() for word in ("--set", f"{place}={_yaml(value)}")]
    if (logs := about.get("logs", "none")) != "none":
        given += ["--logs", logs]
    if (limit := about.get("wall limit", WALL_LIMIT)) != WALL_LIMIT:
        given += ["--wall-limit", f"{limit:.15g} s"]
    study = _near(Path(about["file"]))
    return shlex.join(["shoal", "campaign", study, "--runs", str(runs), *given, *_code(about), "-o", str(data.folder)])


def strange_paths(data: DataSet) -> list[str]:
    """Paths that `rest_command` needs and that are not on this computer: of the study's file, and of folders."""
    return [path for path in (str(data.about["file"]), *data.about.get("code", ())) if not Path(path).exists()]


def _code(about: Mapping[str, Any]) -> list[str]:
    """Options for the folders with the user's tasks; none for the current one, which is searched anyway."""
    folders = [_near(Path(folder)) for folder in about.get("code", ())]
    return [word for folder in folders for word in ("--code", folder)] if folders != ["."] else []


def _near(path: Path) -> str:
    """A path from the current folder if it is below it."""
    here = Path.cwd()
    return os.path.relpath(path, here) if path.is_relative_to(here) else str(path)


def _yaml(value: object) -> str:
    text: str = yaml.safe_dump(value, default_flow_style=True, width=_LONGEST, allow_unicode=True)
    return text.removesuffix("...\n").strip()
