"""Whether the tasks of a selection can carry out a plan, and what they lack: a real vehicle needs drivers."""

from runtime.profile import Profile
from runtime.vehicle import Build
from support.diagnostics import Problem

ENGINE, AUTOPILOT = "Plan.Engine", "Control.Autopilot."
PARTS: dict[str, tuple[str, ...]] = {
    "a plan engine": (ENGINE,),
    "a supervisor": ("Supervisors.Vehicle",),
    "maneuvers": ("Maneuver.",),
    "navigation": ("Navigation.",),
    "control": ("Control.",),
    "position": ("Simulators.GPS", "Sensors.GPS"),
    "attitude": ("Simulators.IMU",),
    "depth": ("Simulators.DepthSensor",),
    "barometric height": ("Simulators.Barometer",),
    "actuators": ("Simulators.Motor", "Simulators.VSIM", "Simulators.UAV"),
}
"""The tasks that can do each part: names, or beginnings of names that end with a point."""


def plan_problem(made: Build, profile: Profile) -> Problem | None:
    """A note with the parts that the profile has in other modes and lacks in this one; None if it lacks none.

    A profile without a plan engine is not meant to carry out plans, and an autopilot does all parts itself. Tasks of
    the user's own may do any part: the note names them.
    """
    tasks = [task for task in made.vehicle.tasks if not type(task).__module__.startswith("runtime.")]
    running = [task.name for task in tasks]
    sections = profile.config.sections
    if ENGINE not in sections or any(name.startswith(AUTOPILOT) for name in running):
        return None
    missing = [
        part
        for part, names in PARTS.items()
        if any(_does(section, names) for section in sections) and not any(_does(name, names) for name in running)
    ]
    if not missing:
        return None
    own = [task.name for task in tasks if not type(task).__module__.startswith("tasks.")]
    unless = f", unless {', '.join(own)} {'do' if len(own) > 1 else 'does'} it" if own else ""
    text = f"no plans are carried out in this mode: it lacks {', '.join(missing)}{unless}"
    return Problem("note", *sections[ENGINE].origin, text)


def _does(section: str, names: tuple[str, ...]) -> bool:
    name = section.partition("/")[0]
    return any(name.startswith(each) if each.endswith(".") else name == each for each in names)
