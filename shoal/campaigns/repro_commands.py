"""Commands for a data set that work when they are pasted in this folder."""

import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from shoal.campaigns.jobs import WALL_LIMIT
from shoal.campaigns.results import CampaignResults

_LONGEST = 1 << 20


def rerun_command(data: CampaignResults, run: int) -> str:
    """Command that repeats a run."""
    return shlex.join(
        ["shoal", "campaign", "rerun", str(data.folder), "--run", str(run), *_code_options(data.metadata)]
    )


def scenario_test_command(data: CampaignResults, scenario: Path) -> str:
    """Command that runs a scenario that a search has written."""
    return shlex.join(["shoal", "test", str(scenario), *_code_options(data.metadata)])


def resume_command(data: CampaignResults, runs: int) -> str:
    """Command for the remaining `runs`. Paths are those of the data set, also if they are not on this computer."""
    about = data.metadata
    given = [word for place, value in about["fixed"].items() for word in ("--set", f"{place}={_inline_yaml(value)}")]
    if (logs := about.get("logs", "none")) != "none":
        given += ["--logs", logs]
    if (limit := about.get("wall limit", WALL_LIMIT)) != WALL_LIMIT:
        given += ["--wall-limit", f"{limit:.15g} s"]
    study = _relative_path(Path(about["file"]))
    return shlex.join(
        ["shoal", "campaign", study, "--runs", str(runs), *given, *_code_options(about), "-o", str(data.folder)]
    )


def missing_paths(data: CampaignResults) -> list[str]:
    """Paths that `resume_command` needs and that are not on this computer: of the study's file, and of folders."""
    return [path for path in (str(data.metadata["file"]), *data.metadata.get("code", ())) if not Path(path).exists()]


def _code_options(about: Mapping[str, Any]) -> list[str]:
    """Options for the folders with the user's tasks; none for the current one, which is searched anyway."""
    folders = [_relative_path(Path(folder)) for folder in about.get("code", ())]
    return [word for folder in folders for word in ("--code", folder)] if folders != ["."] else []


def _relative_path(path: Path) -> str:
    """A path from the current folder if it is below it."""
    here = Path.cwd()
    return os.path.relpath(path, here) if path.is_relative_to(here) else str(path)


def _inline_yaml(value: object) -> str:
    text: str = yaml.safe_dump(value, default_flow_style=True, width=_LONGEST, allow_unicode=True)
    return text.removesuffix("...\n").strip()
