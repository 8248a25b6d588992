"""The tables of docs/mavlink-missions.md are those of the code."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from mission_samples import BOAT, COPTER, PLANE, PX4, SUBMARINE, item, waypoint

import imc
from mavlink.missions import COMMANDS, MANEUVERS, MOST_ITEMS, BadItem, MissionCommand, MissionResult, items_of, plan_of

PAGE = (Path(__file__).parents[3] / "docs/mavlink-missions.md").read_text()
CRAFT = [replace(craft, camera="Camera", aloft=True) for craft in (SUBMARINE, BOAT, COPTER, PLANE)]
NUMBERS = {
    MissionCommand.NAV_LOITER_TIME: (5,), MissionCommand.NAV_LOITER_TURNS: (5,), MissionCommand.NAV_DELAY: (5,),
    MissionCommand.CONDITION_DELAY: (5,), MissionCommand.DO_CHANGE_SPEED: (1, 1, -1),
}  # fmt: skip
VARIANTS = {"": {}, "with a hold time": {"param1": 5.0}, "with a negative radius": {"param3": -20.0}}


def table(head):
    """The rows of the table that begins with `head`."""
    body = re.search(rf"^\| {head} \|.*\n\|[-|]+\n((?:\|.*\n)+)", PAGE, re.MULTILINE).group(1)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in body.splitlines()]


def first_table():
    """Command, variant, and what the table says of each vehicle."""
    commands, rows = [], []
    for name, *cells in table("item"):
        commands = re.findall(r"`(\w+)`", name) or commands
        rows += [(command, name.partition("same, ")[2], cells) for command in commands]
    return rows


def made(command, variant, craft):
    """What the table should say."""
    z = 20.0 if craft.flies else 0.0
    number = MissionCommand[command]
    sample = item(number, 20, 0, z, *NUMBERS.get(number, ()))
    if variant == "as the first item":
        before, craft = [], replace(craft, aloft=False)
    else:
        before, sample = [waypoint(10, 0, z)], sample._replace(**VARIANTS[variant])
    try:
        plan, converted = plan_of([*before, sample], PX4, craft)
    except BadItem as bad:
        return "rejected" if bad.result == MissionResult.UNSUPPORTED else str(bad)
    kinds = {m.maneuver_id: type(m.data).__name__ for m in plan.maneuvers}
    return ", ".join(kinds[name] for name in converted.steps[-1]) or "none"


@pytest.mark.parametrize(("command", "variant", "cells"), first_table())
def test_items_become_the_maneuvers_of_the_table(command, variant, cells):
    assert [made(command, variant, craft) for craft in CRAFT] == cells


def test_all_commands_are_in_the_table():
    assert {command for command, *_ in first_table()} == {MissionCommand(number).name for number in COMMANDS}


def test_frames_are_those_of_the_table():
    def level(frame, craft):
        z = 40.0 if craft.flies or frame in (10, 11) else 0.0
        try:
            return imc.ZUnits(plan_of([waypoint(1, 0, z, frame=frame)], PX4, craft).plan.maneuvers[0].data.z_units).name
        except BadItem as bad:
            return "rejected" if bad.result == MissionResult.UNSUPPORTED_FRAME else str(bad)

    rows = table("frame")
    named = {int(number): cells for name, *cells in rows for number in re.findall(r"\d+", name)}
    assert rows[-1][0] == "all others"
    for frame in range(22):
        assert [level(frame, craft) for craft in CRAFT[:3]] == named.get(frame, rows[-1][1:])


PLACE = {"lat": 0.7, "lon": -0.15, "z": 2.0, "z_units": imc.ZUnits.DEPTH, "speed": 1.2}
SAMPLES = {
    "Loiter": {"radius": 20.0, "duration": 60},
    "IdleManeuver": {"duration": 5},
    "FollowPath": {"points": (imc.PathPoint(x=1.0),)},
    "Rows": {"length": 9.0, "width": 9.0, "hstep": 5.0},
    "RowsCoverage": {"length": 9.0, "width": 9.0, "range": 5},
}


def test_maneuvers_become_the_items_of_the_table():
    rows = table("maneuver")
    documented = {name for first, _ in rows for name in re.findall(r"`(\w+)`", first)}
    assert documented == {kind.__name__ for kind in MANEUVERS}
    for names, items in rows:
        for name in re.findall(r"`(\w+)`", names) or ["ScheduledGoto"]:
            kind = imc.builtin()[name]
            fields = {info.name for info in imc.fields(kind)}
            data = kind(**{k: v for k, v in {**PLACE, **SAMPLES.get(name, {})}.items() if k in fields})
            plan = imc.PlanSpecification(start_man_id="m", maneuvers=(imc.PlanManeuver(maneuver_id="m", data=data),))
            found = items_of(plan, PX4, SUBMARINE).items
            assert {MissionCommand(each.command).name for each in found} == {re.findall(r"`(\w+)`", items)[0]}


def test_results_and_numbers_are_those_of_the_code():
    for results, _ in table("result"):
        assert set(re.findall(r"[A-Z][A-Z_\d]+", results)) <= set(MissionResult.__members__)
    assert f"{MOST_ITEMS} waypoints" in PAGE
    with pytest.raises(BadItem):
        plan_of([waypoint(1, 0, -1, 5)] * (MOST_ITEMS // 2), PX4, SUBMARINE)
    assert plan_of([waypoint(1, 0, -1, 5)] * int(0.44 * MOST_ITEMS), PX4, SUBMARINE)
