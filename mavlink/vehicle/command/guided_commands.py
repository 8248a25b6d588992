"""Single orders that become plans: go there, come home, take off, land, circle, be steered."""

import math
from collections.abc import Callable, Sequence

import imc
from autonomy.plans import sequential_plan
from mavlink import FLAVORS
from mavlink.missions import BadItem, Item, MissionCommand, MissionResult, plan_of
from mavlink.vehicle.command.hold_and_abort import VehicleControl
from mavlink.vehicle.command.request import DONE, CommandResult, Finish, MavResult
from mavlink.vehicle.mission import OnReply, PlanReply

DEGREES = 1e7
GLOBAL, RELATIVE = 0, 3  # MAV_FRAME
SPLASH = 1.0  # m above the surface that still mean the surface
RESULTS = {
    MissionResult.UNSUPPORTED_FRAME: MavResult.UNSUPPORTED_FRAME,
    MissionResult.ERROR: MavResult.TEMPORARILY_REJECTED,
}
POSITION_UNKNOWN = CommandResult(MavResult.TEMPORARILY_REJECTED, "The position is unknown")
LatLon = tuple[float, float]
NO_PLACE: LatLon = (math.nan, math.nan)


def go_to(
    control: VehicleControl, place: LatLon, frame: int | None, z: float, speed: float, finish: Finish, now: float
) -> CommandResult | None:
    """Go to a place and keep station there; without one only change the depth or altitude."""
    found = control.model.state_and_position()
    if found is None:
        return POSITION_UNKNOWN
    if any(map(math.isinf, place)):
        return CommandResult(MavResult.DENIED, "Goto denied: the position is not on earth")
    if not _given(place):
        place = found[1].lat, found[1].lon
    frame, z = _level(control, frame, z, found[1].relative)
    there = _item(MissionCommand.NAV_WAYPOINT, frame, place, z)
    stay = there._replace(command=MissionCommand.NAV_LOITER_UNLIM)
    return _send(control, "goto", [*_speed(speed), there, stay], finish, now, _closely(control))


def execute_item(
    control: VehicleControl,
    command: MissionCommand,
    order: Sequence[float],
    frame: int | None,
    finish: Finish,
    now: float,
) -> CommandResult | None:
    """Carry out an item that a station sends as an order: a stay of some time or turns. `order` has its parameters."""
    found = control.model.state_and_position()
    if found is None:
        return POSITION_UNKNOWN
    place = order[4], order[5]
    if not _given(place) or place == (0.0, 0.0):
        place = found[1].lat, found[1].lon
    frame, z = _level(control, frame, order[6], found[1].relative)
    numbers = {f"param{number}": value for number, value in enumerate(order[:4], 1) if not math.isnan(value)}
    return _send(control, "goto", [_item(command, frame, place, z)._replace(**numbers)], finish, now)


def apply_guided_speed(control: VehicleControl, finish: Finish, now: float) -> CommandResult | None:
    """Do what the vehicle does for a ground station at the speed that has been chosen."""
    plan = control.plans.started
    if (
        plan is None
        or plan.plan_id != control.model.active_guided_plan_id
        or control.model.active_guided_plan_id not in ("goto", "orbit", "return", "land")
    ):
        return DONE
    maneuvers = tuple(
        each.replace(data=each.data.replace(speed=control.model.guided_speed, speed_units=imc.SpeedUnits.METERS_PS))
        if isinstance(each, imc.PlanManeuver) and each.data is not None and hasattr(each.data, "speed")
        else each
        for each in plan.maneuvers
    )
    control.plans.start(plan.replace(maneuvers=maneuvers), _judge(f"change the speed of {plan.plan_id}", finish), now)
    return None


def return_home(control: VehicleControl, finish: Finish, now: float) -> CommandResult | None:
    """Come home: an AUV to the surface there and a boat keep station, an aircraft lands."""
    if control.model.home is None:
        return CommandResult(MavResult.TEMPORARILY_REJECTED, "Home is not known yet")
    home = control.model.home.lat, control.model.home.lon
    command = MissionCommand.NAV_LOITER_UNLIM if control.model.kind.afloat else MissionCommand.NAV_RETURN_TO_LAUNCH
    return _send(control, "return", [_item(command, RELATIVE, home, 0.0)], finish, now, _closely(control))


def take_off(control: VehicleControl, frame: int | None, z: float, finish: Finish, now: float) -> CommandResult | None:
    """Climb to an altitude above home, or to one in the frame of COMMAND_INT; without one to the usual altitude."""
    if control.model.needs_no_takeoff:
        return CommandResult(MavResult.DENIED, "Takeoff denied: the vehicle is in the air")
    if not math.isfinite(z):
        frame, z = RELATIVE, control.model.options.takeoff_altitude
    frame = RELATIVE if frame is None else frame
    return _send(control, "takeoff", [_item(MissionCommand.NAV_TAKEOFF, frame, (0.0, 0.0), z)], finish, now)


def land(control: VehicleControl, place: LatLon, finish: Finish, now: float) -> CommandResult | None:
    """Land here or at a place; an AUV comes to the surface."""
    if control.model.state_and_position() is None:
        return POSITION_UNKNOWN
    given = place if _given(place) and place != (0.0, 0.0) else (0.0, 0.0)
    return _send(control, "land", [_item(MissionCommand.NAV_LAND, RELATIVE, given, 0.0)], finish, now)


def orbit(
    control: VehicleControl,
    place: LatLon,
    level: tuple[int | None, float],
    radius: float,
    speed: float,
    finish: Finish,
    now: float,
) -> CommandResult | None:
    """Circle around a place, or around here, until something else is asked for; a negative radius: counterclockwise."""
    found, settings = control.model.state_and_position(), control.model.conversion_settings("orbit")
    if found is None:
        return POSITION_UNKNOWN
    if not _given(place):
        place = found[1].lat, found[1].lon
    radius = radius if math.isfinite(radius) and radius else settings.radius
    frame, z = _level(control, *level, found[1].relative)
    items = [
        *_speed(speed),
        _item(MissionCommand.NAV_LOITER_TURNS, frame, place, z)._replace(param1=1.0, param3=radius),
    ]

    def forever(plan: imc.PlanSpecification) -> imc.PlanSpecification:
        *before, last = plan.maneuvers
        assert isinstance(last, imc.PlanManeuver)
        assert isinstance(last.data, imc.Loiter)
        return plan.replace(maneuvers=(*before, last.replace(data=last.data.replace(duration=0))))

    return _send(control, "orbit", items, finish, now, forever)


def start_manual_control(control: VehicleControl, finish: Finish, now: float) -> CommandResult | None:
    """Let ground stations steer, until another mode is chosen."""
    if not control.model.kind.afloat:
        return CommandResult(MavResult.DENIED, "Mode TELEOPERATION denied: an aircraft is not steered by hand here")
    plan = sequential_plan("steered", {"1": imc.Teleoperation(custom=f"src={control.imc_id}")})
    control.plans.start(plan, _judge("be steered", finish), now)
    return None


def _send(
    control: VehicleControl,
    name: str,
    items: Sequence[Item],
    finish: Finish,
    now: float,
    change: Callable[[imc.PlanSpecification], imc.PlanSpecification] = lambda plan: plan,
) -> CommandResult | None:
    """Start a plan of items; the order is answered when the vehicle has accepted or rejected it."""
    try:
        plan = plan_of(items, FLAVORS["generic"], control.model.conversion_settings(name)).plan
    except BadItem as bad:
        return CommandResult(RESULTS.get(bad.result, MavResult.DENIED), f"{name.capitalize()} denied: {bad.reason}")
    control.plans.start(change(plan), _judge(name, finish), now)
    return None


def _closely(control: VehicleControl) -> Callable[[imc.PlanSpecification], imc.PlanSpecification]:
    """A plan whose last maneuver, if it keeps station, does so as a hold does."""

    def change(plan: imc.PlanSpecification) -> imc.PlanSpecification:
        *before, last = plan.maneuvers
        if not (isinstance(last, imc.PlanManeuver) and isinstance(last.data, imc.StationKeeping)):
            return plan
        return plan.replace(maneuvers=(*before, last.replace(data=control.model.with_hold_radius(last.data))))

    return change


def discard_result(reply: CommandResult) -> None:
    """The answer to an errand that no station has asked for."""


def _judge(name: str, finish: Finish) -> OnReply:
    def judge(outcome: PlanReply) -> None:
        finish(DONE if outcome.done else CommandResult(MavResult.FAILED, f"Cannot {name}: {outcome.reason}"))

    return judge


def _item(command: MissionCommand, frame: int, place: LatLon, z: float) -> Item:
    lat, lon = (round(math.degrees(angle) * DEGREES) for angle in place)
    return Item(frame, command, x=lat, y=lon, z=z)


def _speed(speed: float) -> list[Item]:
    """An item that sets a speed, if one is given."""
    return [Item(RELATIVE, MissionCommand.DO_CHANGE_SPEED, param2=speed)] if speed > 0.0 else []


def _level(control: VehicleControl, frame: int | None, z: float, present: float) -> tuple[int, float]:
    """Frame and z of an order: without z, as high as now; altitudes of COMMAND_LONG are above the sea."""
    afloat = control.model.kind.afloat
    if math.isnan(z):
        return RELATIVE, min(0.0, present) if afloat else present
    frame = GLOBAL if frame is None else frame
    return frame, 0.0 if afloat and 0.0 < z <= SPLASH else z


def _given(place: LatLon) -> bool:
    return all(map(math.isfinite, place))
