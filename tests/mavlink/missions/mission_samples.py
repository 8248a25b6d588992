"""Vehicles and items for tests of missions."""

import math
import struct
from dataclasses import replace

from hypothesis import strategies as st

import imc
from mavlink import FLAVORS, KINDS
from mavlink.missions import COMMANDS, ConversionContext, Item, MissionCommand, MissionType, plan_of
from mavlink.positions import Home, degrees_e7

C = MissionCommand
PX4, ARDUPILOT = FLAVORS["px4"], FLAVORS["ardupilot"]
NAN = math.nan
LAT, LON = math.radians(41.185) + 3e-10, math.radians(-8.7062) - 3e-10  # between the positions that items have
GROUND = 84.6  # m above the ellipsoid
SEA = Home(LAT, LON, GROUND, 0.0)
FIELD = Home(LAT, LON, GROUND, 30.0)  # m above mean sea level
SUBMARINE = ConversionContext(
    KINDS["submarine"], SEA, speed=1.2, z=1.0, deepest=49.0, fastest=2.0, tightest=10.0, camera="Fisheye Camera",
    switch="Save Images",
)  # fmt: skip
BOAT = ConversionContext(KINDS["boat"], SEA, speed=1.5, camera="Fisheye Camera", switch="Save Images")
COPTER = ConversionContext(KINDS["hexacopter"], FIELD, speed=5.0, z=10.0, highest=120.0, fastest=12.0, tightest=3.0)
PLANE = ConversionContext(KINDS["plane"], FIELD, speed=15.0, z=50.0)
VEHICLES = {"submarine": SUBMARINE, "boat": BOAT, "copter": COPTER, "plane": PLANE}
X, Y = degrees_e7(LAT), degrees_e7(LON)
RELATIVE, ABSOLUTE, TERRAIN, BARE = 6, 5, 11, 2  # frames


def item(command, north=0, east=0, z=0.0, *numbers, frame=RELATIVE):
    """An item at about `north` and `east` (m) of home, with parameters 1 to 4."""
    parameters = {f"param{n}": float(value) for n, value in enumerate(numbers, 1)}
    return Item(frame, int(command), x=X + 90 * north, y=Y + 119 * east, z=float(z), **parameters)


def bare(command, *numbers):
    """An item without a position."""
    return Item(BARE, int(command), **{f"param{n}": float(value) for n, value in enumerate(numbers, 1)})


def waypoint(north, east=0, z=0.0, *numbers, frame=RELATIVE):
    return item(MissionCommand.NAV_WAYPOINT, north, east, z, *numbers, frame=frame)


def maneuvers(items, settings=SUBMARINE, flavor=PX4):
    """The maneuvers of a mission by name."""
    return {m.maneuver_id: m.data for m in plan_of(items, flavor, settings).plan.maneuvers}


def nameless(plan):
    """A plan with its maneuvers numbered, whatever they are called."""
    names = {m.maneuver_id: f"m{number}" for number, m in enumerate(plan.maneuvers)}
    return plan.replace(
        plan_id="plan",
        start_man_id=names[plan.start_man_id],
        maneuvers=tuple(m.replace(maneuver_id=names[m.maneuver_id]) for m in plan.maneuvers),
        transitions=tuple(
            t.replace(source_man=names[t.source_man], dest_man=names[t.dest_man]) for t in plan.transitions
        ),
    )


def packed(items):
    return [each.pack() for each in items]


def on_wire(message):
    return imc.decode(imc.encode(message))


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


EDGES = (1e-3, 0.5, 1.0, 49.0, 50.0, 90.0, 100.0, 120.0, 360.0, 400.0, 11_000.0, 25_000.0, 65_535.0)
SIGNED = [sign * float32(edge) for edge in EDGES for sign in (1, -1)]
FLOATS = st.floats(width=32) | st.sampled_from(SIGNED)
INT32 = st.integers(-(2**31), 2**31 - 1)
GARBAGE = st.builds(
    Item,
    frame=st.integers(0, 255), command=st.one_of(st.sampled_from(sorted(COMMANDS)), st.integers(0, 65535)),
    current=st.integers(0, 255), autocontinue=st.integers(0, 255),
    param1=FLOATS, param2=FLOATS, param3=FLOATS, param4=FLOATS, x=INT32, y=INT32, z=FLOATS,
    mission_type=st.sampled_from((0, 0, 0, 1, 2, 255)),
)  # fmt: skip
"""Items of any bits."""

NOT_GIVEN = st.sampled_from((0.0, NAN))
TIME = st.one_of(st.integers(1, 90).map(float), st.floats(0.125, 90, width=32))
RADIUS = st.one_of(NOT_GIVEN, st.floats(1, 60, width=32))
ROUND = st.one_of(RADIUS, RADIUS.map(lambda radius: -radius))
YAW = st.one_of(NOT_GIVEN, st.floats(-180, 360, width=32))
SPEED = st.one_of(st.floats(0.25, 2.0, width=32), st.sampled_from((-1.0, -2.0)))
ZERO = st.just(0.0)
USUAL = {
    C.NAV_WAYPOINT: (NOT_GIVEN | TIME, RADIUS, NOT_GIVEN, YAW),
    C.NAV_SPLINE_WAYPOINT: (NOT_GIVEN | TIME, ZERO, ZERO, ZERO),
    C.NAV_LOITER_UNLIM: (ZERO, ZERO, ROUND, YAW),
    C.NAV_LOITER_TIME: (TIME, ZERO, ROUND, YAW),
    C.NAV_LOITER_TURNS: (st.floats(0.5, 5, width=32), ZERO, ROUND, YAW),
    C.NAV_LOITER_TO_ALT: (ZERO, ROUND, ZERO, ZERO),
    C.NAV_DELAY: (TIME, NOT_GIVEN, NOT_GIVEN, NOT_GIVEN),
    C.CONDITION_DELAY: (TIME, ZERO, ZERO, ZERO),
    C.NAV_LAND: (NOT_GIVEN | st.floats(0, 30, width=32), ZERO, ZERO, YAW),
    C.NAV_TAKEOFF: (NOT_GIVEN | st.floats(0, 30, width=32), ZERO, ZERO, YAW),
    C.DO_CHANGE_SPEED: (st.sampled_from((0.0, 1.0)), SPEED, st.sampled_from((-1.0, 0.0, NAN)), NOT_GIVEN),
}
"""Parameters 1 to 4 that consoles send."""
BARE_COMMANDS = (
    C.NAV_DELAY, C.CONDITION_DELAY, C.DO_CHANGE_SPEED, C.IMAGE_START_CAPTURE, C.IMAGE_STOP_CAPTURE,
    C.VIDEO_START_CAPTURE, C.VIDEO_STOP_CAPTURE,
)  # fmt: skip


@st.composite
def usual_items(draw, craft):
    """An item that a console might send to a vehicle, near home."""
    commands = [C.NAV_WAYPOINT] * 3 + [C.NAV_SPLINE_WAYPOINT, C.NAV_LOITER_UNLIM, C.NAV_LOITER_TIME, C.NAV_LOITER_TURNS]
    commands += [C.DO_CHANGE_SPEED, C.NAV_DELAY, C.CONDITION_DELAY]
    commands += [C.NAV_LOITER_TO_ALT, C.NAV_LAND] if craft.flies or craft.dives else []
    commands += [C.NAV_TAKEOFF] * 2 if craft.flies else []
    commands += BARE_COMMANDS[3:] if craft.camera else []
    command = draw(st.sampled_from(commands))
    numbers = [draw(strategy) for strategy in USUAL.get(command, (ZERO,) * 4)]
    if command in BARE_COMMANDS:
        return bare(command, *numbers)
    frame = draw(st.sampled_from((0, 3, 5, 6, 10, 11) if craft.flies or craft.dives else (0, 3, 5, 6)))
    if craft.flies or frame in (10, 11):
        z = draw(st.floats(1, 60, width=32)) + (30.0 if frame in (0, 5) else 0.0)
    else:
        z = draw(st.floats(-40, 0, width=32)) if craft.dives else 0.0
    found = item(command, draw(st.integers(-300, 300)), draw(st.integers(-300, 300)), z, *numbers, frame=frame)
    return found._replace(x=0, y=0) if draw(st.integers(0, 9)) == 0 else found


@st.composite
def usual_missions(draw, craft):
    """A mission that is mostly accepted."""
    items = draw(st.lists(usual_items(craft), min_size=1, max_size=6))
    return [*items, bare(C.NAV_RETURN_TO_LAUNCH)] if draw(st.booleans()) else items


def without_home(settings):
    return replace(settings, home=None)


def fence_corner(x, y, **fields):
    given = {"param1": 4.0, "mission_type": int(MissionType.FENCE), **fields}
    return Item(0, int(given.pop("command", MissionCommand.NAV_FENCE_POLYGON_VERTEX_INCLUSION)), x=x, y=y, **given)
