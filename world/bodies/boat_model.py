"""The model of a simulated boat, read from a section [VSIM/Model/...] of type ASV, USV or Boat."""

from collections.abc import Callable
from dataclasses import dataclass

from world.bodies.model_section import ModelSection

KINDS = ("ASV", "USV", "Boat")  # DUNE's are ASV and Boat
DENSITY = 1025.0  # kg/m³


@dataclass(frozen=True)
class Propeller:
    """A thruster: F = (gain n - loss u) |n| in N, times `reverse_factor` astern; n in revolutions per second, u in m/s.

    `full_speed` is n at full actuation, reached with the time constant `lag` (s); `x`, `y` is its position (m), `angle`
    the direction of its thrust (rad from ahead).
    """

    gain: float
    loss: float
    full_speed: float
    reverse_factor: float
    lag: float
    x: float
    y: float
    angle: float


@dataclass(frozen=True)
class Rudder:
    """A rudder of an `area` (m²) with an aspect ratio, at `x`, `y` (m); a share of it is in a propeller's slipstream.

    The propeller is the one with the number of the rudder, `propeller_diameter` is its diameter (m).
    """

    area: float
    aspect_ratio: float
    x: float
    y: float
    slipstream_share: float
    propeller_diameter: float


@dataclass(frozen=True, eq=False)
class BoatModel:
    """Mass, geometry and coefficients of a boat in SI units; body frame forward, starboard, down, origin midships.

    `inertia` is the moment about the origin, `center` the distance from there ahead to the center of gravity.
    `added_mass` are the derivatives by accelerations: X by that of u, Y by v, N by r, and Y by r. `linear` and
    `quadratic` are the coefficients of drag X_u, Y_v, N_r, Y_r, N_v; `lift` those of Y_uv, Y_ur, N_uv, N_ur.
    `cross_flow` are length and draft (m) and a drag coefficient. `munk` adds the Munk moment of the added masses;
    without it, the other coefficients contain that moment. `wind` are the frontal and the lateral area (m²), the length
    (m), and the coefficients c_x, c_y, c_n. Waves are averaged over `waterplane`, a length and a beam (m).
    """

    mass: float
    inertia: float
    center: float
    added_mass: tuple[float, ...]
    linear: tuple[float, ...]
    quadratic: tuple[float, ...]
    lift: tuple[float, ...]
    cross_flow: tuple[float, ...]
    munk: bool
    wind: tuple[float, ...]
    rudders: tuple[Rudder, ...]
    engines: tuple[Propeller, ...]
    waterplane: tuple[float, float] = (0.0, 0.0)


def is_boat_model(value: Callable[[str, str], str], name: str) -> bool:
    """Whether the model `name` is a boat; `value(section, option)` returns the text of an option."""
    return value(f"VSIM/Model/{name}", "Type") in KINDS


def is_estimated_model(value: Callable[[str, str], str], name: str) -> bool:
    """Whether the model `name` is one of DUNE's boats, whose numbers are no masses and drags: DUNE fits a recursion."""
    section = f"VSIM/Model/{name}"
    return bool(is_boat_model(value, name) and value(section, "Inertial Matrix") and not value(section, "Yaw Inertia"))


def read_boat_model(value: Callable[[str, str], str], name: str) -> BoatModel:
    """Read the model `name`; `value(section, option)` returns the text of an option. Raises ModelError.

    A model with DUNE's options, which has no `Yaw Inertia`, is estimated from mass and size; see `_estimate`.
    """
    section = ModelSection(value, name)

    def positive(option: str) -> float:
        (found,) = section.positive_numbers(option)
        return found

    def damping(option: str) -> tuple[float, ...]:
        found = section.numbers(option, 5, (0.0,) * 5)
        if max(found[:3]) > 0.0:
            raise section.error(f"{option}: drag of surge, sway and yaw cannot be more than 0")
        return found

    def engine(i: int) -> Propeller:
        gain, loss, rpm = section.numbers(f"Engine Parameters {i}", 3)
        (reverse,) = section.numbers(f"Engine Reverse Factor {i}", 1, (1.0,))
        (lag,) = section.numbers(f"Engine Time Constant {i}", 1, (0.0,))
        if min(gain, rpm) <= 0.0 or min(loss, reverse, lag) < 0.0:
            raise section.error(f"engine {i}: gain and speed must be more than 0, the others at least 0")
        x, y, _ = section.numbers(f"Engine Position {i}", 3, (0.0, 0.0, 0.0))
        angle, _ = section.numbers(f"Engine Orientation {i}", 2, (0.0, 0.0))
        return Propeller(gain, loss, rpm / 60.0, reverse, lag, x, y, angle)

    def rudder(i: int) -> Rudder:
        x, y, _ = section.numbers(f"Rudder Position {i}", 3)
        share, diameter = section.numbers(f"Rudder Slipstream {i}", 2, (0.0, 1.0))
        if not 0.0 <= share <= 1.0 or diameter <= 0.0:
            raise section.error(f"Rudder Slipstream {i} must be a share from 0 to 1 and a diameter")
        if share and i >= section.count("Engine Count"):
            raise section.error(f"Rudder Slipstream {i}: there is no engine {i}")
        return Rudder(positive(f"Rudder Area {i}"), positive(f"Rudder Aspect Ratio {i}"), x, y, share, diameter)

    if is_estimated_model(value, name):
        return _estimate(section, tuple(engine(i) for i in range(section.count("Engine Count"))))
    mass, inertia = positive("Mass"), positive("Yaw Inertia")
    (center,) = section.numbers("Centre of Gravity", 1, (0.0,))
    added = section.numbers("Added Mass Coefficients", 4, (0.0,) * 4)
    surge, sway, yaw = mass - added[0], mass - added[1], inertia - added[2]
    if min(surge, sway, yaw) <= 0.0 or sway * yaw <= (mass * center - added[3]) ** 2:
        raise section.error("Added Mass Coefficients make the inertia matrix not positive definite")
    cross_flow = section.numbers("Cross Flow", 3, (0.0,) * 3)
    length, beam = section.numbers("Waterplane", 2, (cross_flow[0], 0.0))
    if min(length, beam) < 0.0:
        raise section.error("Waterplane must be a length and a beam")
    return BoatModel(
        mass=mass,
        inertia=inertia,
        center=center,
        added_mass=added,
        linear=damping("Linear Drag Coefficients"),
        quadratic=damping("Quadratic Drag Coefficients"),
        lift=section.numbers("Body Lift Coefficients", 4, (0.0,) * 4),
        cross_flow=cross_flow,
        munk=section.text("Munk Moment") not in ("false", "False", "0"),
        wind=section.numbers("Wind", 6, (0.0,) * 6),
        rudders=tuple(rudder(i) for i in range(section.count("Rudder Count"))),
        engines=tuple(engine(i) for i in range(section.count("Engine Count"))),
        waterplane=(length, beam),
    )


def _estimate(section: ModelSection, engines: tuple[Propeller, ...]) -> BoatModel:
    """A boat of this `Mass`, of the length and beam in `Volume`, with DUNE's engines, and its fins as rudders.

    Nothing needs the height in `Volume`, which is 0 in some of DUNE's: the draft follows from mass, length and beam.
    Added masses and damping are to mass and inertia as those of the Otter (Fossen, Marine Systems Simulator, otter.m);
    in surge the boat slows down within 10 s. The force of a fin is that of a foil with a lift coefficient of 1.
    """
    (mass,) = section.positive_numbers("Mass")
    length, beam, height = section.numbers("Volume", 3)
    if min(length, beam) <= 0.0 or height < 0.0:
        raise section.error("Volume: length and beam must be more than 0, the height at least 0")
    inertia = mass * (0.25 * length) ** 2
    sway, yaw = 2.5 * mass, 2.7 * inertia
    rudders: list[Rudder] = []
    for i in range(section.count("Fin Count")):
        force = max(map(abs, section.numbers(f"Fin Force {i}", 3)))
        x, y, _ = section.numbers(f"Fin Position {i}", 3)
        rudders.append(Rudder(force / DENSITY, 2.0, x, y, 0.0, 1.0))
    return BoatModel(
        mass=mass,
        inertia=inertia,
        center=0.0,
        added_mass=(-0.1 * mass, mass - sway, inertia - yaw, 0.0),
        linear=(-0.1 * mass, -sway, -yaw, 0.0, 0.0),
        quadratic=(0.0, 0.0, -10.0 * yaw, 0.0, 0.0),
        lift=(0.0,) * 4,
        cross_flow=(length, mass / (DENSITY * length * beam), 1.0),
        munk=False,
        wind=(0.0,) * 6,
        rudders=tuple(rudders),
        engines=engines,
        waterplane=(length, beam),
    )
