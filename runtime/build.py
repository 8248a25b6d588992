"""From a profile to a vehicle: finds the classes of its sections and gives them their values."""

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from runtime.catalogue import TaskImportError, find_task, missing_extra
from runtime.clock import VirtualClock, WallClock
from runtime.entities import EntityError
from runtime.parameters import ParameterError
from runtime.problem import Origin, Problem, ProfileError
from runtime.profile import Profile
from runtime.vehicle import Vehicle


@dataclass
class Build:
    """A vehicle, and the enabled sections that were left out of it by reason."""

    vehicle: Vehicle
    left_out: dict[str, list[str]] = field(default_factory=dict[str, list[str]])

    def leave_out(self, section: str, reason: str) -> None:
        self.left_out.setdefault(reason, []).append(section)


def build(
    profile: Profile,
    selected: Collection[str] = (),
    *,
    clock: WallClock | VirtualClock,
    seed: int | None = None,
    keep_going: bool | None = None,
    log_root: Path = Path("log"),
    state_folder: Path = Path("db"),
) -> Build:
    """The vehicle of a profile with the tasks that the selected modes enable.

    `keep_going` is whether a task that fails is restarted (True) or ends the run (False); by default it ends a
    simulation and is restarted otherwise. `seed` is by default the profile's; the effective configuration, which is
    in every log, has it and the modes. Raises ProfileError naming file and line of what cannot be.
    """
    if keep_going is None:
        keep_going = not (isinstance(clock, VirtualClock) or "Simulation" in selected)
    seed = profile.seed if seed is None else seed
    profile.override(f"General:Seed={seed}")
    profile.override(f"General:Selected={', '.join(sorted(selected))}")
    vehicle = Vehicle(
        profile.vehicle,
        profile.system,
        clock=clock,
        profile=profile,
        systems=profile.systems,
        seed=seed,
        keep_going=keep_going,
        log_root=log_root,
        state_folder=state_folder,
    )
    made, problems = Build(vehicle), list[Problem]()
    for section in profile.config.sorted_sections():
        if not profile.enabled(section.name, selected):
            continue
        try:
            cls = find_task(section.name)
        except TaskImportError as error:
            problems.append(Problem("error", *section.origin, str(error)))
            continue
        if cls is None:
            made.leave_out(section.name, "not in Shoal")
        elif vehicle.virtual and cls.external:
            made.leave_out(section.name, "talks to the outside, which a virtual run has not")
        elif extra := missing_extra(cls):
            made.leave_out(section.name, f"needs pip install 'shoal[{extra}]'")
        else:
            try:
                task = vehicle.add(cls, section.name, profile.options(section.name))
                for option in section.options.values():
                    task.parameter_set.redeclare(option.name, option.attributes)
            except ParameterError as error:
                problems.append(
                    Problem("error", *_origin(profile, section.name, error.name), f"{section.name}: {error}")
                )
            except EntityError as error:
                problems.append(Problem("error", *_origin(profile, section.name, "Entity Label"), str(error)))
    if problems:
        vehicle.close()
        raise ProfileError(problems)
    return made


def join_zenoh(vehicle: Vehicle, profile: Profile) -> None:
    """Put the vehicle's bus on zenoh, as the section [Zenoh] of its profile says.

    Raises ProfileError for the section, ConnectionError where zenoh cannot be joined, ModuleNotFoundError without it.
    """
    from runtime.zenoh import ZenohTransport
    from runtime.zenoh_config import ZenohConfig

    try:
        config = ZenohConfig.from_options(profile.options("Zenoh"), profile.path.parent)
        vehicle.bus.attach(ZenohTransport(config, vehicle.systems.name, vehicle.entities.label))
    except ValueError as error:
        section = profile.config.sections.get("Zenoh")
        origin = section.origin if section else Origin(str(profile.path))
        raise ProfileError([Problem("error", *origin, str(error))]) from None


def _origin(profile: Profile, section: str, option: str) -> Origin:
    found = profile.config.option(section, option)
    return found.origin if found is not None else profile.config.sections[section].origin
