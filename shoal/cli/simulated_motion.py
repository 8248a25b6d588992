"""Whether a simulated vehicle moves: a profile of DUNE may have simulators that are not in Shoal."""

from collections.abc import Collection

from runtime.profile import Profile
from runtime.vehicle import Build

MOTION = ("Simulators.VSIM", "Simulators.UAV", "Simulators.EstimatedState")
ENGINE, AUTOPILOT, MODE = "Plan.Engine", "Control.Autopilot.", "Simulation"
MULTIROTOR = "Simulators.UAV"
FIXED_WING = ("simulation type", "bank time constant", "speed time constant")
"""Options of DUNE's Simulators.UAV, which a multirotor does not have."""


def motion_error(made: Build, profile: Profile) -> str:
    """Why the vehicle would stand still or be another one, for people; empty if it is not so.

    Only a vehicle that flies plans is meant. Tasks of the user's own may simulate it, so nothing is said where one
    runs.
    """
    for section in (task.name for task in made.vehicle.tasks if task.name.partition("/")[0] == MULTIROTOR):
        wrong = [option for option in profile.config.sections[section].options if option.casefold() in FIXED_WING]
        if wrong:
            return (
                f"[{section}] {wrong[0]}: that is a fixed wing of DUNE; {MULTIROTOR} here is a multirotor, "
                "and there is no simulator of fixed wings"
            )
    missing = [name for names in made.skipped.values() for name in names if name.startswith("Simulators.")]
    return f"{_nothing_moves(profile)}: {', '.join(missing)} cannot run here" if missing and _stands(made) else ""


def motion_warning(made: Build, profile: Profile, selected: Collection[str]) -> str:
    """That a vehicle in mode Simulation has no simulator of its motion, which may run elsewhere; empty if it has."""
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
