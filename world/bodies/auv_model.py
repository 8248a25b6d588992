"""The model of a simulated underwater vehicle, read from a section [VSIM/Model/...] of a profile."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from support.rotations import Vector
from world.bodies.model_section import ModelSection

FULL_DEFLECTION = 0.4363  # rad, 25 degrees
MAXIMUM_TORQUE = 6.0  # N m, of an engine, about each axis


@dataclass(frozen=True)
class Fin:
    """A control surface.

    `force` is twice the N per (m/s)² at full deflection along each axis, `position` m from the center of gravity.
    """

    force: Vector
    position: Vector


@dataclass(frozen=True)
class Thruster:
    """A thruster: F = (gain n - loss V) |n| in N, with n in revolutions per second and V in m/s.

    `full_speed` is n at full actuation, `direction` the unit vector of the thrust, `position` in m.
    """

    gain: float
    loss: float
    full_speed: float
    position: Vector
    direction: Vector


@dataclass(frozen=True, eq=False)
class UnderwaterModel:
    """Mass, geometry and hydrodynamic coefficients in SI units; body frame forward, starboard, down (SNAME).

    `inertia` divides the six forces and moments. `linear` and `quadratic` are drag of u, v, w, p, q, r, then Y_r, Z_q,
    M_w, N_v. `lift` is Y_uv, Y_ur, Z_uw, Z_uq, M_uw, M_uq, N_uv, N_ur. `buoyancy` is the center of buoyancy, `volume`
    the sides of the displaced box. `rotational_inertia` are the moments of inertia of the Coriolis terms. The fins roll
    the vehicle only if `fins_roll` is set.
    """

    mass: float
    buoyancy: Vector
    volume: Vector
    inertia: tuple[float, ...]
    linear: tuple[float, ...]
    quadratic: tuple[float, ...]
    added_mass: tuple[float, ...]
    lift: tuple[float, ...]
    rotational_inertia: Vector
    fins: tuple[Fin, ...]
    engines: tuple[Thruster, ...]
    maximum_force: float
    fins_roll: bool


def read_underwater_model(value: Callable[[str, str], str], name: str) -> UnderwaterModel:
    """Read the model `name`; `value(section, option)` returns the text of an option. Raises ModelError.

    Options are DUNE's, plus `Rotational Inertia` (default: the last three of `Inertial Matrix`; DUNE takes the first
    three by mistake) and `Fins Roll` (default: false, as in DUNE, where fins have no rolling moment).
    """
    section = ModelSection(value, name)

    def vector(option: str, default: Sequence[float] | None = None) -> Vector:
        x, y, z = section.numbers(option, 3, default)
        return x, y, z

    def engine(i: int) -> Thruster:
        gain, loss, rpm = section.numbers(f"Engine Parameters {i}", 3)
        a, b = section.numbers(f"Engine Orientation {i}", 2, (0.0, 0.0))
        direction = math.cos(a) * math.cos(b), math.sin(a) * math.cos(b), math.sin(b)
        return Thruster(gain, loss, rpm / 60.0, vector(f"Engine Position {i}", (0.0, 0.0, 0.0)), direction)

    kind, method = section.text("Type"), section.text("Integration Method")
    if method == "false" or kind not in ("", "UUV", "AUV", "ROV"):
        raise section.error(f"is a model of type {kind or 'boat'}, not of an underwater vehicle")
    inertia = section.positive_numbers("Inertial Matrix", 6)
    x, y, z = section.positive_numbers("Rotational Inertia", 3, inertia[3:])
    sides = section.positive_numbers("Volume", 3)
    return UnderwaterModel(
        mass=section.positive_numbers("Mass", 1)[0],
        buoyancy=vector("Buoyancy"),
        volume=(sides[0], sides[1], sides[2]),
        inertia=inertia,
        linear=section.numbers("Linear Drag Coefficients", 10),
        quadratic=section.numbers("Quadratic Drag Coefficients", 10),
        added_mass=section.numbers("Added Mass Coefficients", 6, (0.0,) * 6),
        lift=section.numbers("Body Lift Coefficients", 8, (0.0,) * 8),
        rotational_inertia=(x, y, z),
        fins=tuple(
            Fin(vector(f"Fin Force {i}"), vector(f"Fin Position {i}")) for i in range(section.count("Fin Count"))
        ),
        engines=tuple(engine(i) for i in range(section.count("Engine Count"))),
        maximum_force=section.positive_numbers("Engine Max Force", 1, (math.inf,))[0],
        fins_roll=section.text("Fins Roll") in ("true", "True", "1"),
    )
