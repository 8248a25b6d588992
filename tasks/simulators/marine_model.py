"""The numbers of a simulated marine vehicle, as a section [VSIM/Model/...] of a profile has them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tasks.simulators.attitude import Vector

FULL_DEFLECTION = 0.4363  # rad, 25 degrees
MAXIMUM_TORQUE = 6.0  # N m, of an engine about each axis


class ModelError(ValueError):
    """A section [VSIM/Model/...] has no number, or a wrong one, where the equations need one."""


@dataclass(frozen=True)
class Fin:
    """A control surface: N per (m/s)² at full deflection, twice over, along each axis; m from the centre of gravity."""

    force: Vector
    position: Vector


@dataclass(frozen=True)
class Engine:
    """A thruster: F = (gain n - loss V) |n| in N, with n in revolutions per second and V in m/s.

    `full_speed` is n at full actuation; `direction` is where it pushes, a unit vector; `position` is in m.
    """

    gain: float
    loss: float
    full_speed: float
    position: Vector
    direction: Vector


@dataclass(frozen=True, eq=False)
class Model:
    """Mass, geometry and hydrodynamic coefficients in SI units; body frame forward, starboard, down (SNAME).

    `inertia` divides the six forces and moments. `linear` and `quadratic` drag are of u, v, w, p, q, r, then Y_r, Z_q,
    M_w, N_v. `lift` is Y_uv, Y_ur, Z_uw, Z_uq, M_uw, M_uq, N_uv, N_ur. `buoyancy` is the centre of buoyancy, `volume`
    the sides of the displaced box. `rotational` are the moments of inertia of the Coriolis terms. The fins roll the
    vehicle only if `fins_roll` is set.
    """

    mass: float
    buoyancy: Vector
    volume: Vector
    inertia: tuple[float, ...]
    linear: tuple[float, ...]
    quadratic: tuple[float, ...]
    added_mass: tuple[float, ...]
    lift: tuple[float, ...]
    rotational: Vector
    fins: tuple[Fin, ...]
    engines: tuple[Engine, ...]
    maximum_force: float
    fins_roll: bool


def read_model(value: Callable[[str, str], str], name: str) -> Model:
    """The model of a section, with `value(section, option)` giving its texts. Raises ModelError.

    Options are DUNE's, and besides `Rotational Inertia` (by default the last three of `Inertial Matrix`; DUNE takes the
    first three by mistake) and `Fins Roll` (by default false, as in DUNE, where fins have no rolling moment).
    """
    section = f"VSIM/Model/{name}"

    def numbers(option: str, count: int, default: Sequence[float] | None = None) -> tuple[float, ...]:
        text = value(section, option)
        if not text and default is not None:
            return tuple(default)
        try:
            found = tuple(float(word) for word in text.split(","))
        except ValueError:
            found = ()
        if len(found) != count or not all(map(math.isfinite, found)):
            wanted = "a number" if count == 1 else f"{count} numbers"
            raise ModelError(
                f"[{section}] {option} is not {wanted}: {text!r}" if text else f"[{section}] has no {option}"
            )
        return found

    def positive(option: str, count: int, default: Sequence[float] | None = None) -> tuple[float, ...]:
        found = numbers(option, count, default)
        if min(found) <= 0.0:
            raise ModelError(f"[{section}] {option} has to be more than 0")
        return found

    def vector(option: str, default: Sequence[float] | None = None) -> Vector:
        x, y, z = numbers(option, 3, default)
        return x, y, z

    def count(option: str) -> int:
        (found,) = numbers(option, 1, (0,))
        if found not in range(256):
            raise ModelError(f"[{section}] {option} is not a whole number from 0 to 255")
        return int(found)

    def engine(i: int) -> Engine:
        gain, loss, rpm = numbers(f"Engine Parameters {i}", 3)
        a, b = numbers(f"Engine Orientation {i}", 2, (0.0, 0.0))
        direction = math.cos(a) * math.cos(b), math.sin(a) * math.cos(b), math.sin(b)
        return Engine(gain, loss, rpm / 60.0, vector(f"Engine Position {i}", (0.0, 0.0, 0.0)), direction)

    kind, method = value(section, "Type"), value(section, "Integration Method")
    if method == "false" or kind not in ("", "UUV", "AUV", "ROV"):
        raise ModelError(f"[{section}] is a model of a {kind or 'boat'}, which is no underwater vehicle")
    inertia = positive("Inertial Matrix", 6)
    x, y, z = positive("Rotational Inertia", 3, inertia[3:])
    sides = positive("Volume", 3)
    return Model(
        mass=positive("Mass", 1)[0],
        buoyancy=vector("Buoyancy"),
        volume=(sides[0], sides[1], sides[2]),
        inertia=inertia,
        linear=numbers("Linear Drag Coefficients", 10),
        quadratic=numbers("Quadratic Drag Coefficients", 10),
        added_mass=numbers("Added Mass Coefficients", 6, (0.0,) * 6),
        lift=numbers("Body Lift Coefficients", 8, (0.0,) * 8),
        rotational=(x, y, z),
        fins=tuple(Fin(vector(f"Fin Force {i}"), vector(f"Fin Position {i}")) for i in range(count("Fin Count"))),
        engines=tuple(engine(i) for i in range(count("Engine Count"))),
        maximum_force=positive("Engine Max Force", 1, (math.inf,))[0]
        if value(section, "Engine Max Force")
        else math.inf,
        fins_roll=value(section, "Fins Roll") in ("true", "True", "1"),
    )
