"""`shoal check`: lists the mistakes in profiles."""

import sys
from collections import Counter
from collections.abc import Collection
from pathlib import Path

import click
from rich.console import Console

from runtime.kernel import WallClock
from runtime.profile import Profile, available_profiles, load_profile
from runtime.vehicle import TaskImportError, all_tasks, build, config_warnings, find_task
from runtime.vehicle import check_profile as find_problems
from shoal.cli import WRONG_USE
from shoal.cli.completion import complete_profile
from shoal.cli.findings import STYLES
from shoal.cli.json_output import json_option, print_json, problem_to_dict
from shoal.cli.options import add_user_task_folders, code_option, config_dir_option, modes_option, overrides_option
from shoal.cli.plan_capability import plan_problem
from shoal.fleet import SYSTEM_ID, mavlink_id
from shoal.missions import fixed_wing_problem, motion_problem, motion_warning
from support.diagnostics import Problem, ProfileError


@click.command()
@click.argument("names", nargs=-1, metavar="[PROFILE]...", shell_complete=complete_profile)
@config_dir_option
@modes_option
@overrides_option
@code_option
@click.option("--strict", is_flag=True, help="Exit status 1 also for warnings.")
@json_option
def check(
    names: tuple[str, ...],
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
    strict: bool,
    as_json: bool,
) -> None:
    """Check PROFILEs for mistakes, by default all that are found.

    The exit status is 1 if there are errors, 2 if there is no such profile, section or mode.
    """
    add_user_task_folders(code, names)
    console = Console(highlight=False, emoji=False, soft_wrap=True, stderr=as_json, quiet=as_json)
    said: dict[str, list[Problem]] = {}
    counts: Counter[str] = Counter()
    wrong_use = False
    broken: list[TaskImportError] = []
    known = all_tasks(broken)
    speakers: dict[int, Profile] = {}
    for error in broken:
        counts["error"] += 1
        console.print(f"error: {error}", style=STYLES["error"], markup=False)
    for name in names or sorted(available_profiles(config_dir)):
        problems: list[Problem] = []
        try:
            profile = load_profile(name, config_dir, overrides=overrides, strict=False)
            problems += profile.file_problems
            selected = profile.parse_modes(profiles) if profiles else None
            problems = find_problems(profile, known, selected, find_task)
            problems += _further(_build_problems(profile, selected), problems)
            problems += _mavlink_id_conflict(profile, speakers, together=bool(names))
        except ProfileError as error:
            problems += error.problems
            wrong_use = True
        said[name] = problems
        for problem in problems:
            counts[problem.severity] += 1
            console.print(str(problem), style=STYLES[problem.severity], markup=False)
        if not problems:
            console.print(f"{name}: nothing wrong", markup=False)
    if as_json:
        found = {name: [problem_to_dict(problem) for problem in problems] for name, problems in said.items()}
        counted = {severity: counts[severity] for severity in STYLES}
        print_json({"profiles": found, "counts": counted, "broken_tasks": list(map(str, broken))})
    if counts:
        console.print(", ".join(f"{count} {severity}{'s' * (count > 1)}" for severity, count in counts.items()))
    if wrong_use:
        sys.exit(WRONG_USE)
    sys.exit(1 if counts["error"] or (strict and counts["warning"]) else 0)


def _further(found: list[Problem], known: list[Problem]) -> list[Problem]:
    """The problems that are not known: building reports the errors of values again, in other words."""
    lines = {(each.file, each.line) for each in known if each.severity == "error" and each.line}
    return [
        each
        for each in found
        if each not in known and not (each.severity == "error" and (each.file, each.line) in lines)
    ]


def _build_problems(profile: Profile, chosen: Collection[str] | None) -> list[Problem]:
    """Problems that building the vehicle shows in the chosen modes, or in each: values that tasks reject or doubt.

    A missing extra is an error only of chosen modes, since this computer need not run the others. What a mode lacks for
    plans is a note only where it is chosen.
    """
    found: list[Problem] = []
    for selected in [{mode} for mode in profile.selectable_modes] if chosen is None else [chosen]:
        try:
            made = build(profile, selected, clock=WallClock(), skip_missing_extras=chosen is None)
            try:
                found += config_warnings(made.vehicle, profile)
                stands = motion_problem(made, profile)
                found += [stands] if stands is not None else []
                if chosen is not None and (plan := plan_problem(made, profile)):
                    found.append(plan)
                if text := motion_warning(made, profile, selected):
                    found.append(Problem("warning", str(profile.path), 0, text))
            finally:
                made.vehicle.close()
            for reason, names in made.skipped.items():
                sections = [profile.config.sections[name] for name in names if find_task(name) is not None]
                found += [Problem("note", *section.origin, f"[{section.name}] {reason}") for section in sections]
        except ProfileError as error:
            found += error.problems
            enabled = [name for name in profile.config.sections if profile.is_task_enabled(name, selected)]
            wing = fixed_wing_problem(profile, enabled)
            found += [wing] if wing is not None else []
    return list(dict.fromkeys(found))


def _mavlink_id_conflict(profile: Profile, speakers: dict[int, Profile], *, together: bool) -> list[Problem]:
    """The other vehicle that has the same MAVLink id; `speakers` are the profiles before this one, by that id.

    It is a mistake of profiles that are named `together`. Of all that are found some never share a network, and
    MAVLink has 250 ids for them.
    """
    number = mavlink_id(profile, profile.system_id)
    first = speakers.setdefault(number, profile) if number is not None else profile
    if first.vehicle == profile.vehicle:
        return []
    section, option = SYSTEM_ID
    where = profile.config.sections[section]
    given = where.options.get(option)
    origin = given.origin if given is not None and given.history else where.origin
    words = f"{first.vehicle} and {profile.vehicle} have the same MAVLink id {number}"
    hint = f"set [{section}] {option} of one of them to another one"
    return [Problem("error" if together else "note", *origin, words, hint)]
