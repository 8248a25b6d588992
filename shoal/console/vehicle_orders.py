"""Orders of the page to a vehicle, and whether the vehicle obeys them."""

import asyncio
import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress

import imc
from autonomy.plans import remaining_plan_at, sequential_plan
from shoal.console.vehicle_view import RUNNING, motors, position, word
from shoal.missions import PlanFileError, parse_plan
from shoal.network import AsyncRemoteVehicle, MessageListener, NetworkSystem

OBEYED = 2.0  # s in which a vehicle shows that it obeys
LOOK = 0.05  # s between two looks at its latest messages
NEXT_POSITION = 3.0  # s
LONGEST_PLAN = 65_536  # characters
STATION_SPEED = 1.0  # m/s
STATION_RADIUS = 15.0  # m
POP_UP_TIMEOUT = 300  # s
HOLD, SURFACE, REST = "console-hold", "console-surface", "console-rest"
"""Names of the plans that the page starts by a press of one key; the last is what a pause leaves of a plan."""
STOPPED = (imc.VehicleState.OpMode.SERVICE, imc.VehicleState.OpMode.ERROR, imc.VehicleState.OpMode.BOOT)


class OrderError(Exception):
    """An order that is not carried out; the text is for the operator."""


async def abort(vehicle: AsyncRemoteVehicle) -> str:
    """Stop everything; the text names mode and motors as the vehicle reports them. Raises OrderError, NetworkError."""
    system, before = vehicle.system, vehicle.system.latest_message(imc.VehicleState)
    if system.id is None:
        raise OrderError("nothing was sent: the vehicle has not announced its id yet")
    await vehicle.abort()

    def stopped() -> bool:
        state = system.latest_message(imc.VehicleState)
        return state is not None and state is not before and state.op_mode in STOPPED

    if not await _becomes(stopped):
        raise OrderError(f"Abort was confirmed, but not obeyed within {OBEYED:g} s: mode {_mode_text(system)}")
    if not await _becomes(lambda: motors(system) != "turning"):
        return f"aborted: mode {_mode_text(system)}, and the motors still turn (to come up, or running down)"
    return f"obeyed: mode {_mode_text(system)}, motors {motors(system) or 'not reported'}"


async def hold(vehicle: AsyncRemoteVehicle) -> str:
    """Stay where the vehicle is: an AUV comes up there. Raises OrderError, NetworkError."""
    kind = _type(vehicle.system)
    lat, lon, height = await _position(vehicle)
    airborne = kind == imc.SystemType.UAV
    station = imc.StationKeeping(
        lat=lat,
        lon=lon,
        z=height if airborne else 0.0,
        z_units=imc.ZUnits.HEIGHT if airborne else imc.ZUnits.DEPTH,
        radius=STATION_RADIUS,
        speed=STATION_SPEED,
        speed_units=imc.SpeedUnits.METERS_PS,
    )
    return await _start(vehicle, sequential_plan(HOLD, {"station": station}))


async def surface(vehicle: AsyncRemoteVehicle) -> str:
    """Come up, or land, where the vehicle is. Raises OrderError, NetworkError."""
    kind = _type(vehicle.system)
    if kind == imc.SystemType.USV:
        raise OrderError("a boat is at the surface")
    lat, lon, _ = await _position(vehicle)
    maneuver: imc.Message
    if kind == imc.SystemType.UAV:
        maneuver = imc.Land(lat=lat, lon=lon, speed=STATION_SPEED, speed_units=imc.SpeedUnits.METERS_PS)
    else:
        maneuver = imc.PopUp(
            timeout=POP_UP_TIMEOUT,
            lat=lat,
            lon=lon,
            z=0.0,
            z_units=imc.ZUnits.DEPTH,
            speed=STATION_SPEED,
            speed_units=imc.SpeedUnits.METERS_PS,
            duration=POP_UP_TIMEOUT,
            radius=STATION_RADIUS,
            flags=imc.PopUp.Flags.CURR_POS,
        )
    return await _start(vehicle, sequential_plan(SURFACE, {"up": maneuver}))


async def start(vehicle: AsyncRemoteVehicle, plan: str | imc.PlanSpecification) -> str:
    """Start a stored plan, or one that is sent with the order. Raises OrderError, NetworkError."""
    if not plan:
        raise OrderError("name a plan")
    return await _start(vehicle, plan)


async def stop(vehicle: AsyncRemoteVehicle) -> str:
    """Stop the plan that is running. Raises OrderError, NetworkError."""
    system, before = vehicle.system, vehicle.system.latest_message(imc.PlanControlState)
    await vehicle.plan.stop()

    def rests() -> bool:
        state = system.latest_message(imc.PlanControlState)
        return state is not None and state is not before and state.state not in RUNNING

    if not await _becomes(rests):
        raise OrderError(f"the stop was accepted, but the plan still runs after {OBEYED:g} s")
    return f"obeyed: the plan is stopped, mode {_mode_text(system)}"


async def pause(vehicle: AsyncRemoteVehicle) -> str:
    """Store the rest of the running plan on the vehicle, and hold. Raises OrderError, NetworkError."""
    state = vehicle.system.latest_message(imc.PlanControlState)
    if state is None or state.state not in RUNNING or state.plan_id in (HOLD, SURFACE):
        raise OrderError("no plan is running that could be paused")
    plan = await vehicle.plan.get(state.plan_id)
    lat, lon, _ = await _position(vehicle)
    state = vehicle.system.latest_message(imc.PlanControlState) or state
    left = float(state.man_eta) if state.man_eta >= 0 else math.nan
    try:
        rest = remaining_plan_at(plan, state.man_id, (lat, lon), left)
    except ValueError as error:
        raise OrderError(f"{plan.plan_id} cannot be paused: {error}") from None
    await vehicle.plan.put(rest.replace(plan_id=REST))
    return f"{await hold(vehicle)}; Resume continues {plan.plan_id} at {state.man_id}"


async def resume(vehicle: AsyncRemoteVehicle) -> str:
    """Start what a pause has left of a plan. Raises OrderError, NetworkError."""
    return await _start(vehicle, REST)


async def put(vehicle: AsyncRemoteVehicle, text: str) -> str:
    """Store a plan that is written as YAML. Raises OrderError with its line, NetworkError."""
    if len(text) > LONGEST_PLAN:
        raise OrderError(f"a plan as text has at most {LONGEST_PLAN} characters")
    try:
        plan = await asyncio.to_thread(parse_plan, text)  # a long one takes a second
    except PlanFileError as error:
        raise OrderError(str(error)) from None
    await vehicle.plan.put(plan)
    estimate = await vehicle.plan.estimate(plan.plan_id)
    words = f"{plan.plan_id} is stored; {estimate.describe()}"
    state = vehicle.system.latest_message(imc.PlanControlState)
    if math.isnan(estimate.seconds) and state is not None and state.state in RUNNING:
        words += " (a vehicle estimates none while another one is carried out)"
    return f"{words}; it would be rejected now: {estimate.rejected}" if estimate.rejected else words


async def delete(vehicle: AsyncRemoteVehicle, plan: str) -> str:
    """Delete a stored plan. Raises NetworkError."""
    await vehicle.plan.delete(plan)
    return f"{plan} is deleted"


async def save(vehicle: AsyncRemoteVehicle, entity: str) -> str:
    """Let the vehicle keep the parameters of an entity for its next start. Raises NetworkError with its reason."""
    await vehicle.param.save(entity)
    return f"{entity}: the vehicle starts with these values from now on"


async def carry_out(vehicle: AsyncRemoteVehicle, order: str, words: Mapping[str, object]) -> str:
    """Carry out an order of the page by its name, but none that sets parameters. Raises OrderError, NetworkError."""
    given = {name: value for name, value in words.items() if isinstance(value, str)}
    match order:
        case "abort":
            return await abort(vehicle)
        case "hold":
            return await hold(vehicle)
        case "surface":
            return await surface(vehicle)
        case "start":
            return await start(vehicle, given.get("plan", ""))
        case "stop":
            return await stop(vehicle)
        case "pause":
            return await pause(vehicle)
        case "resume":
            return await resume(vehicle)
        case "put":
            return await put(vehicle, given.get("text", ""))
        case "delete":
            return await delete(vehicle, given.get("plan", ""))
        case "save":
            return await save(vehicle, given.get("entity", ""))
        case _:
            raise OrderError(f"no such order: {order!r}")


async def _start(vehicle: AsyncRemoteVehicle, plan: str | imc.PlanSpecification) -> str:
    """Start a plan; the answer says whether the vehicle executes it."""
    name = plan if isinstance(plan, str) else plan.plan_id
    estimates: list[str] = []
    network, system = vehicle.network, vehicle.system
    states = network.listen(system, (imc.PlanControlState,))
    try:
        await vehicle.plan.start(plan, wait=False, estimated=lambda estimate: estimates.append(estimate.describe()))
        if not await _is_carried_out(states, system, name):
            text = f"{name} was accepted, but is not carried out after {OBEYED:g} s: mode {_mode_text(system)}"
            raise OrderError(text)
    finally:
        network.close_listener(states)
    return f"obeyed: {name} is carried out; {estimates[0]}" if estimates else f"obeyed: {name} is carried out"


async def _is_carried_out(states: MessageListener, system: NetworkSystem, plan: str) -> bool:
    """Whether a vehicle begins a plan soon, which may be over at once: a vehicle at the surface has come up."""
    with suppress(TimeoutError):
        async with asyncio.timeout(OBEYED):
            while True:
                _, state = await states.next(OBEYED)
                assert isinstance(state, imc.PlanControlState)
                if state.src == system.id and state.plan_id == plan and state.state in RUNNING:
                    return True
    return False


async def _position(vehicle: AsyncRemoteVehicle) -> tuple[float, float, float]:
    """Latitude and longitude (rad) and height (m) in the next state. Raises OrderError, NoAnswer."""
    found = position(await vehicle.network.next_message(vehicle.system, imc.EstimatedState, NEXT_POSITION))
    if not all(map(math.isfinite, found)):
        raise OrderError("the vehicle does not know its position")
    return found


async def _becomes(condition: Callable[[], bool]) -> bool:
    """Whether a condition gets true soon."""
    deadline = time.monotonic() + OBEYED
    while not condition():
        if time.monotonic() > deadline:
            return False
        await asyncio.sleep(LOOK)
    return True


def _mode(system: NetworkSystem) -> int | None:
    state = system.latest_message(imc.VehicleState)
    return None if state is None else state.op_mode


def _mode_text(system: NetworkSystem) -> str:
    mode = _mode(system)
    return "unknown" if mode is None else word(imc.VehicleState.OpMode, mode)


def _type(system: NetworkSystem) -> int:
    """SystemType of a system. Raises OrderError if it is unknown: hold and surface depend on it."""
    announce = system.latest_message(imc.Announce)
    if announce is None:
        raise OrderError("the vehicle has not announced its type yet")
    return announce.sys_type
