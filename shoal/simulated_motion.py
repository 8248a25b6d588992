"""Whether a simulated vehicle moves: a profile of DUNE may have simulators that are not in Shoal."""

from collections.abc import Collection, Iterable

from runtime.profile import Profile
from runtime.vehicle import Build
from support.diagnostics import Problem

MOTION = ("Simulators.VSIM", "Simulators.UAV", "Simulators.EstimatedState")
ENGINE, AUTOPILOT, MODE = "Plan.Engine", "Control.Autopilot.", "Simulation"
MULTIROTOR = "Simulators.UAV"
FIXED_WING = frozenset(
    (
        "simulation type",
        "bank time constant",
        "speed time constant",
        "altitude time constant",
        "bank rate limit",
        "longitudinal acceleration limit",
        "vertical slope limit",
        "commands source",
        "stream speed to north",
        "stream speed to east",
        "stream speed north",
        "stream speed east",
        "max motor thrust",
        "aircraft aerodynamic center",
        "wing aerodynamic center",
        "tail aerodynamic center",
        "fin aerodynamic center",
        "lift coefficients",
        "elevator coefficient",
        "rudder coefficient",
        "initial speed",
        "initial roll",
        "initial yaw",
    )
)
"""Options that a multirotor does not have, of DUNE's Simulators.UAV: src/Simulators/UAV/Task.cpp and
etc/uav/simulator.ini of LSTS/dune, from 2013 (wind "Stream Speed North") to today ("Stream Speed to North")."""


def motion_problem(made: Build, profile: Profile) -> Problem | None:
    """Reason why the vehicle would stand still or be another one; None if it is not so.

    Only a vehicle that flies plans is meant. Tasks of the user's own may simulate it, so nothing is reported where one
    runs.
    """
    if wing := fixed_wing_problem(profile, (task.name for task in made.vehicle.tasks)):
        return wing
    missing = [name for names in made.skipped.values() for name in names if name.startswith("Simulators.")]
    if not missing or not _stands(made):
        return None
    origin = profile.config.sections[missing[0]].origin
    return Problem("error", *origin, f"{_nothing_moves(profile)}: {', '.join(missing)} cannot run here")


def fixed_wing_problem(profile: Profile, sections: Iterable[str]) -> Problem | None:
    """The first option in these sections that describes a fixed wing of DUNE; None without one."""
    for section in sections:
        if section.partition("/")[0] != MULTIROTOR:
            continue
        for option in profile.config.sections[section].options.values():
            if option.name.casefold() in FIXED_WING:
                text = (
                    f"[{section}] {option.name}: that is a fixed wing of DUNE; {MULTIROTOR} here is a multirotor, "
                    "and there is no simulator of fixed wings"
                )
                return Problem("error", *option.origin, text)
    return None


def motion_warning(made: Build, profile: Profile, selected: Collection[str]) -> str:
    """Warning that a vehicle in mode Simulation has no simulator of its motion, which may run elsewhere; else empty."""
    leads = any(task.name.startswith(AUTOPILOT) for task in made.vehicle.tasks)  # which is simulated elsewhere
    if MODE not in selected or leads or made.vehicle.bus.has_transports or not _stands(made):
        return ""
    return f"{_nothing_moves(profile)}: no task of mode {MODE} publishes SimulatedState"


def _nothing_moves(profile: Profile) -> str:
    return f"nothing simulates the motion of {profile.vehicle}"


def _stands(made: Build) -> bool:
    """Whether a vehicle flies plans, and no task is known, or may be one of the user's, that moves it."""
    running = [task.name.partition("/")[0] for task in made.vehicle.tasks]
    own = any(not type(task).__module__.startswith(("tasks.", "runtime.")) for task in made.vehicle.tasks)
    return ENGINE in running and not own and not any(name in MOTION for name in running)
