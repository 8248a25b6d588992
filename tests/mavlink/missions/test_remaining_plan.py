"""What is left of the plan of a mission from a maneuver on."""

from mission_samples import BOAT, COPTER, PX4, SUBMARINE, bare, item, maneuvers, waypoint

import imc
from autonomy.plans import parse_graph, remaining_plan
from mavlink.missions import MissionCommand, plan_of

C = MissionCommand
ALL = {imc.builtin()[name].ID for name in imc.builtin().allowed_messages("Maneuver")}


def names(plan):
    return [maneuver.maneuver_id for maneuver in plan.maneuvers]


def test_a_plan_continues_at_any_item():
    plan, table = plan_of([waypoint(10, 0, -1, 5), waypoint(20, 0, -2), waypoint(30, 0, -3)], PX4, SUBMARINE)
    rest = remaining_plan(plan, table.maneuver_at(1))
    assert (rest.start_man_id, names(rest)) == ("Goto1", ["Goto1", "Goto2"])
    assert [(t.source_man, t.dest_man) for t in rest.transitions] == [("Goto1", "Goto2")]
    assert rest.maneuvers[1] == plan.maneuvers[3]
    assert parse_graph(rest, ALL).start == "Goto1"
    assert remaining_plan(plan, "Goto0") == plan


def test_a_camera_that_is_on_is_switched_on_again():
    items = [bare(C.IMAGE_START_CAPTURE), waypoint(1), bare(C.IMAGE_STOP_CAPTURE), waypoint(2), waypoint(3)]
    plan, _ = plan_of(items, PX4, BOAT)
    for name, values in (("Goto1", ["true"]), ("Goto3", ["true", "false"]), ("Goto4", ["false"])):
        actions = remaining_plan(plan, name).maneuvers[0].start_actions
        assert [entry.value for action in actions for entry in action.params] == values


def test_an_aircraft_on_the_ground_takes_off_first():
    items = [item(C.NAV_TAKEOFF, 0, 0, 10), waypoint(10, 0, 20), waypoint(20, 0, 20)]
    plan, _ = plan_of(items, PX4, COPTER)
    assert names(remaining_plan(plan, "Goto2")) == ["Goto2"]
    rest = remaining_plan(plan, "Goto2", takeoff=True)
    assert (rest.start_man_id, names(rest)) == ("Takeoff0", ["Takeoff0", "Goto2"])
    assert [(t.source_man, t.dest_man) for t in rest.transitions] == [("Takeoff0", "Goto2")]
    assert remaining_plan(plan, "Takeoff0", takeoff=True) == plan
    assert list(maneuvers(items, COPTER)) == names(plan)
