"""A slow ray caster in world coordinates, by marching and bisection, against which labels are checked."""

from dataclasses import dataclass

import numpy as np

MARCHES, BISECTIONS = 900, 80
CLOSE, FAR = 1e-10, 200.0  # m
VOID, SEABED, SURFACE, SKY, GLIDER = range(5)


def about(axis, angle):
    """Rotation matrix about axis 0, 1 or 2."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def frame(x, y, z, phi, theta, psi):
    """(4, 4), from a frame with this pose to the outer one."""
    found = np.eye(4)
    found[:3, :3] = about(2, psi) @ about(1, theta) @ about(0, phi)
    found[:3, 3] = x, y, z
    return found


def camera_frame(standpoint, mount):
    """(4, 4), from the optical frame to the world: north, east, down of the scene's origin, down from the ground."""
    vehicle = frame(
        standpoint.north, standpoint.east, -standpoint.height, standpoint.roll, standpoint.pitch, standpoint.yaw
    )
    axes = np.eye(4)
    axes[:3, :3] = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # right, down, ahead in forward, right, down
    return vehicle @ frame(*mount) @ axes


def body_frame(glider):
    return frame(glider.north, glider.east, -glider.height, 0.0, 0.0, glider.heading)


def signed_distance(points, glider):
    """From points (n, 3) of the world to the skin of a glider, m."""
    turn = body_frame(glider)
    own = (points - turn[:3, 3]) @ turn[:3, :3]
    straight = glider.length / 2 - glider.diameter / 2
    own[:, 0] -= np.clip(own[:, 0], -straight, straight)
    return np.sqrt((own**2).sum(axis=1)) - glider.diameter / 2


def march(origin, rays, glider):
    """Distances (n,) to a glider, infinite for a miss."""
    far = np.zeros(len(rays))
    going = np.arange(len(rays))
    for _ in range(MARCHES):
        gap = signed_distance(origin + far[going, None] * rays[going], glider)
        far[going] += gap
        going = going[(gap > CLOSE) & (far[going] < FAR)]
    far[far >= FAR] = np.inf
    far[going] = np.inf
    return far


def cross(origin, rays, level):
    """Distances (n,) at which rays pass a level, by bisection of a bracket that has no end too near the horizon."""
    low, high = np.zeros(len(rays)), np.full(len(rays), 1e12)
    side = np.sign(origin[2] - level)
    meets = side * (origin[2] + high * rays[:, 2] - level) < 0
    for _ in range(BISECTIONS):
        middle = np.sqrt((low + 1e-9) * high)
        before = side * (origin[2] + middle * rays[:, 2] - level) > 0
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.where(meets, high, np.inf)


@dataclass
class Cast:
    """What rays (n, 3; world) of a camera meet."""

    rays: np.ndarray
    origin: np.ndarray
    distance: np.ndarray
    kinds: np.ndarray
    instances: np.ndarray
    alone: dict


def cast(turn, rays, standpoint, gliders, scene):
    """Cast unit rays (n, 3) of the optical frame, NaN in the void."""
    covered = np.isfinite(rays[:, 2])
    origin, rays = turn[:3, 3], np.nan_to_num(rays) @ turn[:3, :3].T
    distance = cross(origin, rays, 0.0)
    if scene == "Seabed":
        top = cross(origin, rays, -standpoint.height - standpoint.depth)
        kinds, distance = np.where(distance <= top, SEABED, SURFACE), np.minimum(distance, top)
    else:
        kinds = np.where(np.isfinite(distance), SURFACE, SKY)
    instances = np.zeros(len(rays), dtype=int)
    alone = {glider.id: march(origin, rays, glider) for glider in gliders}
    nearest = np.full(len(rays), np.inf)
    for number, far in alone.items():
        mine = far < nearest
        nearest[mine], instances[mine] = far[mine], number
    distance = np.where(instances > 0, nearest, distance)
    kinds = np.where(instances > 0, GLIDER, kinds)
    distance, kinds, instances = np.where(covered, distance, np.nan), kinds * covered, instances * covered
    return Cast(rays, origin, distance, kinds, instances, {n: np.isfinite(far) & covered for n, far in alone.items()})


def seen_again(found, gliders, standpoint, then, turn, moved):
    """Directions (n, 3; optical frame of the next camera) to what was cast; NaN for gliders that are gone."""
    points = found.origin + np.where(np.isfinite(found.distance), found.distance, 1e15)[:, None] * found.rays
    for glider in gliders:
        (own,) = np.nonzero(found.instances == glider.id)
        after = [each for each in moved if each.id == glider.id]
        if not after:
            points[own] = np.nan
            continue
        carry = body_frame(after[0]) @ np.linalg.inv(body_frame(glider))
        points[own] = points[own] @ carry[:3, :3].T + carry[:3, 3]
    # The surface overhead is at another level above the ground if the depth of the water differs.
    overhead = (found.kinds == SURFACE) & (found.rays[:, 2] < 0)
    points[overhead, 2] -= (then.height + then.depth) - (standpoint.height + standpoint.depth)
    return (points - turn[:3, 3]) @ turn[:3, :3]


def march_down(sea, origin, rays, lowered=0.0, far=130.0):
    """Distances (n,) at which rays (n, 3; world) first meet a bottom, by small steps and bisection."""
    low, high, going = np.zeros(len(rays)), np.full(len(rays), np.inf), np.arange(len(rays))

    def over(chosen, way):
        places = origin + way[:, None] * rays[chosen]
        return sea.depths(places[:, 0].copy(), places[:, 1].copy()) + lowered > places[:, 2]

    way = 0.0
    while going.size and way < far:
        after = way + 0.03 + 0.003 * way
        above = over(going, np.full(len(going), after))
        low[going], high[going[~above]] = way, after
        going, way = going[above], after
    hit = np.flatnonzero(np.isfinite(high))
    for _ in range(40):
        middle = (low[hit] + high[hit]) / 2
        above = over(hit, middle)
        low[hit], high[hit] = np.where(above, middle, low[hit]), np.where(above, high[hit], middle)
    return high


def wall_distance(wall, origin, rays):
    """Distances (n,) to an upright wall, from its equation as a plane, and how far along it that is."""
    a, b = np.array(wall)
    normal = np.array([-(b - a)[1], (b - a)[0]])
    with np.errstate(divide="ignore", invalid="ignore"):
        way = (a - origin[:2]) @ normal / (rays[:, :2] @ normal)
        along = (origin[:2] + way[:, None] * rays[:, :2] - a) @ (b - a) / ((b - a) @ (b - a))
        return np.where((way > 0) & (along >= 0) & (along <= 1), way, np.inf)
