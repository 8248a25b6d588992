"""Plans on shipped vehicles: as DUNE flies them, and what is said where one goes wrong."""

import math

import pytest
from lean import BLIND, UNLOGGED

import imc
from shoal.missions import Mission, parse_plan, prepare
from support.wgs84 import displacement

HEAD = "origin: 41.185°, -8.7062°\nspeed: 1.2 m/s\ndepth: 0\nmaneuvers:\n"
ORIGIN = math.radians(41.185), math.radians(-8.7062)
CCU, OTHER = 0x4000, 0x4001
Op, Type = imc.PlanControl.Op, imc.PlanControl.Type


class Flown:
    """A plan flown by the simulated vehicle of a profile; messages of the types `kept` are kept."""

    def __init__(self, text, folder, *kept, profile="lauv-noptilus-1", limit=200.0, feed=(), logged=False):
        lean = (*([] if logged else [UNLOGGED]), *([BLIND] if profile == "lauv-noptilus-1" else []))
        self.vehicle = prepare(profile, overrides=lean, log_root=folder / "log", state_folder=folder / "db").vehicle
        self.kept = {kind: [] for kind in (*kept, imc.PlanControl)}
        for kind, messages in self.kept.items():
            self.vehicle.observe(kind, messages.append)
        mission = Mission(self.vehicle, parse_plan(HEAD + text))
        for at, message in feed:
            self.vehicle.kernel.at(self.vehicle.kernel.now_ns + round(at * 1e9), self._say, message)
        self.report = mission.fly(limit)

    def _say(self, message):
        """Publish it as its source; without one, as a task of the vehicle that gives no destination."""
        if message.src == 0xFFFF:
            self.vehicle.task_by_label("GPS").publish(message)
            return
        packet = imc.encode_with_header(message, self.vehicle.kernel.now_ns * 1e-9, message.src, 3, message.dst, 0xFF)
        self.vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    def legs(self):
        """Start and end of each path: m north and east, rounded."""
        first = {}
        for state in self.kept[imc.PathControlState]:
            first.setdefault(state.path_ref, state)
        return [(_offset(s.start_lat, s.start_lon), _offset(s.end_lat, s.end_lon)) for s in first.values()]

    def replies(self, system):
        """Request id, type and text of the replies to a system."""
        found = [m for m in self.kept[imc.PlanControl] if m.dst == system and m.type != Type.REQUEST]
        return [(m.request_id, Type(m.type).name, m.info) for m in found]


def _offset(lat, lon):
    north, east, _ = displacement(*ORIGIN, 0.0, lat, lon, 0.0)
    return round(north), round(east)


@pytest.mark.heavy
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter"])
def test_each_row_ends_beyond_its_area(profile, tmp_path):
    rows = "{north: 20, width: 20, length: 40, hstep: 20, coff: 10, alternation: 100, flags: [CURVE_RIGHT]}"
    flown = Flown(f"  - rows: {rows}", tmp_path, imc.PathControlState, profile=profile, limit=400.0)
    assert flown.report.completed
    assert [end for _, end in flown.legs()] == [(10, 0), (20, 0), (70, 0), (60, 20), (10, 20)]


@pytest.mark.heavy
def test_a_leg_begins_where_the_path_before_ended(tmp_path):
    text = """
  - loiter: {north: 20, radius: 15, duration: 10}
  - goto: {north: 60}
  - yo_yo: {north: 100, depth: 1, amplitude: 0.5, pitch: 10°}
  - goto: {north: 130}
  - idle: {duration: 3}
  - goto: {north: 160}"""
    flown = Flown(text, tmp_path, imc.PathControlState)
    assert flown.report.completed
    starts, ends = zip(*flown.legs(), strict=True)
    assert ends == ((20, 0), (60, 0), (100, 0), (130, 0), (160, 0))
    assert starts[1:4] == ends[:3]  # also after a circle, and after loops that YoYo adds
    assert starts[4] != ends[3]  # the vehicle has drifted for 3 s


@pytest.mark.heavy
@pytest.mark.parametrize("flags", ["[WAIT_AT_SURFACE]", "[STATION_KEEP]"])
def test_popup_goes_up_and_down_where_it_is_also_in_shallow_water(flags, tmp_path):
    """The water is 4 m deep, the vehicle keeps 2.5 m above the bottom."""
    text = f"  - pop_up: {{north: 40, depth: 3, flags: {flags}, duration: 5}}"
    flown = Flown(text, tmp_path, imc.PathControlState, imc.LogBookEntry, imc.EstimatedState)
    assert flown.report.completed
    assert flown.report.reason.startswith("plan completed; PopUp1: depth 1.")
    up, down = (end for _, end in flown.legs()[1:])
    assert up[0] < 36  # 5 s before the point
    assert down not in (up, (40, 0))
    assert any("instead of 3 m" in entry.text for entry in flown.kept[imc.LogBookEntry])
    depths = [state.depth for state in flown.kept[imc.EstimatedState]]
    assert min(depths[len(depths) // 2 :]) < 0.3
    assert depths[-1] > 1.0


def test_a_depth_that_is_not_reached_is_said(tmp_path):
    flown = Flown("  - goto: {north: 25, depth: 10}", tmp_path, imc.LogBookEntry)
    assert flown.report.completed
    assert flown.report.reason.startswith("plan completed; Goto1: depth ")
    assert flown.report.reason.endswith(" m instead of 10 m")


@pytest.mark.parametrize(
    ("profile", "text", "reason"),
    [
        (
            "lauv-noptilus-1",
            "  - goto: {north: 60, depth: 50}",
            "Goto1: maneuver depth beyond limits: 50 m, the vehicle goes down to 49 m",
        ),
        (
            "lauv-noptilus-1",
            "  - goto: {north: 40}\n    on_start: {DVLL: {Active: true}}",
            "Goto1: the vehicle has no entity 'DVLL' (did you mean 'DVL'?)",
        ),
        (
            "lauv-noptilus-1",
            "  - goto: {north: 40}\n    on_end: {DVL: {Execution Frequence: 2}}",
            "Goto1: DVL has no parameter 'Execution Frequence' (did you mean 'Execution Frequency'?)",
        ),
        (
            "otter",
            "  - goto: {north: 40}\n    on_start: {GPS: {Execution Frequency: fast}}",
            "Goto1: GPS: Execution Frequency: 'fast' is not a number (expects real, 0.1 to 100, Hz)",
        ),
        (
            "caravel",
            "  - goto: {north: 40, depth: 1}",
            "Goto1: maneuver depth beyond limits, the vehicle stays at the surface",
        ),
        (
            "lauv-noptilus-1",
            "  - idle:\n    then: end\n  - idle:\n    id: A\n    then: B\n  - idle:\n    id: B\n    then: A",
            "A: maneuver cannot be reached from IdleManeuver1",
        ),
    ],
)
def test_a_plan_that_cannot_be_flown_is_refused(profile, text, reason, tmp_path):
    flown = Flown(text, tmp_path, profile=profile)
    assert (flown.report.outcome, flown.report.reason) == ("FAILURE", reason)
    assert flown.report.maneuvers == []


def test_what_is_not_there_is_not_active(tmp_path):
    """Consoles write this for each payload."""
    actions = "{Sidescan: {Active: false}, DVL: {Active: true}}"
    assert Flown(f"  - goto: {{north: 20}}\n    on_start: {actions}", tmp_path).report.completed


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "hexa-00"])
def test_maneuvers_that_end_each_other_at_once_fail_their_plan(profile, tmp_path):
    text = """
  - idle: {duration: 3}
  - idle: {duration: 60}
    id: A
    then: [{to: B, when: EstimatedState.depth < 10}]
  - idle: {duration: 60}
    id: B
    then: [{to: A, when: EstimatedState.depth < 10}]"""
    report = Flown(text, tmp_path, profile=profile).report
    assert (report.outcome, report.reason) == ("FAILURE", "A -> B -> A: these maneuvers end each other at once")


def test_a_plan_may_end_on_a_condition(tmp_path):
    report = Flown("  - goto: {north: 80}\n    then: [{to: end, when: EstimatedState.x > 20}]", tmp_path).report
    assert (report.outcome, report.reason) == ("SUCCESS", "plan completed")
    assert report.distance < 40.0


@pytest.mark.heavy
def test_who_started_a_plan_hears_that_it_was_replaced_or_stopped(tmp_path):
    """Every START has one last reply, also if another console ends its plan."""
    plan = parse_plan(HEAD + "  - goto: {north: 300}\n    id: Far", "other")
    own = {"dst": 0x1A, "type": Type.REQUEST}
    feed = [
        (15.0, imc.PlanControl(**own, src=CCU, request_id=7, op=Op.START, plan_id="other", arg=plan)),
        (20.0, imc.PlanControl(**own, src=OTHER, request_id=8, op=Op.STOP)),
    ]
    flown = Flown("  - goto: {north: 300}", tmp_path, feed=feed)
    assert flown.report.reason == "replaced by another plan"
    feed[0] = (15.0, imc.PlanControl(**own, src=CCU, request_id=7, op=Op.GET))
    flown = Flown("  - goto: {north: 300}", tmp_path, feed=feed)
    assert flown.report.reason == "plan was stopped"
    assert flown.replies(CCU) == [(7, "SUCCESS", "OK")]
    assert flown.replies(OTHER) == [(8, "SUCCESS", "OK")]


@pytest.mark.heavy
def test_a_wrong_request_of_another_console_does_not_end_a_mission(tmp_path):
    wrong = imc.PlanControl(src=CCU, dst=0x1A, type=Type.REQUEST, request_id=1, op=Op.START, plan_id="none")
    flown = Flown("  - goto: {north: 40}", tmp_path, feed=[(15.0, wrong)])
    assert flown.replies(CCU) == [(1, "FAILURE", "undefined plan")]
    assert flown.report.completed


@pytest.mark.heavy
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "caravel"])
def test_a_task_of_the_vehicle_need_not_address_its_requests(profile, tmp_path):
    """A stranger must: what another system sends to nobody is not obeyed."""
    stop = imc.PlanControl(type=Type.REQUEST, request_id=9, op=Op.STOP)
    flown = Flown("  - goto: {north: 300}", tmp_path, profile=profile, feed=[(15.0, stop)])
    assert flown.report.reason == "plan was stopped"
    flown = Flown("  - goto: {north: 40}", tmp_path, profile=profile, feed=[(15.0, stop.replace(src=0x1B))])
    assert flown.report.completed


def test_a_task_of_the_vehicle_may_abort_without_an_address(tmp_path):
    flown = Flown("  - goto: {north: 300}", tmp_path, imc.Aborted, feed=[(15.0, imc.Abort())])
    assert len(flown.kept[imc.Aborted]) == 1
    assert flown.report.reason.startswith("got abort request from system")


def test_requests_without_an_address_of_a_task_of_the_vehicle_are_answered(tmp_path):
    feed = [
        (5.0, imc.PlanDB(type=imc.PlanDB.Type.REQUEST, op=imc.PlanDB.Op.GET_STATE, request_id=5)),
        (6.0, imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_CURRENT_NAME)),
        (7.0, imc.SetEntityParameters(name="DVL", params=(imc.EntityParameter(name="Debug Level", value="Debug"),))),
        (12.0, imc.VehicleCommand(command=imc.VehicleCommand.Command.STOP_MANEUVER, request_id=6)),
    ]
    kinds = (imc.PlanDB, imc.LoggingControl, imc.EntityParameters, imc.VehicleCommand)
    flown = Flown("  - goto: {north: 40}", tmp_path, *kinds, feed=feed, logged=True)
    names, dbs, parameters, commands = (flown.kept[kind] for kind in (imc.LoggingControl, imc.PlanDB, *kinds[2:]))
    assert any(m.request_id == 5 and m.type == imc.PlanDB.Type.SUCCESS for m in dbs)
    assert any(m.op == imc.LoggingControl.Op.CURRENT_NAME for m in names)
    assert "DVL" in [m.name for m in parameters]
    assert any(m.request_id == 6 and m.type == imc.VehicleCommand.Type.SUCCESS for m in commands)


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("where", ["surface", "circle"])
def test_an_auv_comes_up_at_its_station_unless_it_shall_circle(where, tmp_path):
    """IMC: the vehicle comes to the surface and stays within the circle; DUNE stops its motor inside."""
    station = f"{{north: 60, depth: 3, radius: 15, duration: 120, custom: 'Under Water={where}'}}"
    station = station.replace(", custom: 'Under Water=surface'", "")
    kinds = imc.EstimatedState, imc.SetThrusterActuation, imc.PlanControlState
    flown = Flown(f"  - station_keeping: {station}", tmp_path, *kinds, limit=400)
    assert flown.report.completed
    states, thrusts = flown.kept[imc.EstimatedState], flown.kept[imc.SetThrusterActuation]
    end = max(m.timestamp for m in flown.kept[imc.PlanControlState] if m.man_id.startswith("StationKeeping"))
    assert max(state.depth for state in states) > 2.0
    depths = [state.depth for state in states if 5.0 < end - state.timestamp < 40.0]
    thrusts = [abs(m.value) for m in thrusts if 5.0 < end - m.timestamp < 40.0]
    if where == "surface":
        assert max(depths) < 0.5
        assert max(thrusts, default=0.0) < 0.01
    else:
        assert min(depths) > 1.0
        assert min(thrusts) > 0.1
