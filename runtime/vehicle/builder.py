"""Builds the vehicle of a profile: finds the task classes of its sections and sets their parameters."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import imc
from imc.console_acl import ConsoleAcl
from runtime.bus import Bus, find_equivalent_class
from runtime.kernel import Clock, Kernel, WallClock, to_ordinary_exception
from runtime.profile import (
    ENTITY_IDS,
    EVERY_TASK,
    MAIN,
    Option,
    Profile,
    Section,
    default_label,
    dune_section_names,
    split_list,
)
from runtime.task import EntityError, ParameterError, Task, assign_ids, consumer_methods, with_location
from runtime.vehicle.fleet import Fleet
from runtime.vehicle.general_lint import parse_zenoh_options
from runtime.vehicle.other_process_entities import ProcessMonitor
from runtime.vehicle.task_registry import TaskImportError, find_task, missing_extra, missing_task_reason
from runtime.vehicle.vehicle import Vehicle
from support.diagnostics import COMMAND_LINE, Origin, Problem, ProfileError
from support.terminal_text import corrected_spelling, quoted

OF_ONE_TASK = (
    imc.QueryEntityParameters,
    imc.SetEntityParameters,
    imc.QueryTypedEntityParameters,
    imc.SaveEntityParameters,
    imc.PushEntityParameters,
    imc.PopEntityParameters,
)
SIMULATED = {"Simulation", "Kinematic"}


@dataclass
class Build:
    """A vehicle, and the enabled sections that were skipped, by reason; `off` are those that virtual time skips."""

    vehicle: Vehicle
    skipped: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    off: list[str] = field(default_factory=list[str])

    def skip(self, section: str, reason: str) -> None:
        self.skipped.setdefault(reason, []).append(section)


def build(
    profile: Profile,
    selected: Collection[str] = (),
    *,
    clock: Clock | None = None,
    fleet: Fleet | None = None,
    seed: int | None = None,
    keep_going: bool | None = None,
    log_root: Path = Path("log"),
    state_folder: Path = Path("db"),
    only: Collection[str] | None = None,
    bus: Callable[[Kernel, int], Bus] = Bus,
    entity_ids: Mapping[str, int] | None = None,
    process: str | None = None,
    skip_missing_extras: bool = False,
) -> Build:
    """The vehicle of a profile with the tasks that the selected modes enable, on a clock or in a fleet.

    In a fleet on a virtual clock the profile's Start Time is set to the time of this clock.
    `keep_going` is whether a task that fails is restarted (True) or ends the run (False); the default is False in a
    simulation, else True. The default of `seed` is the profile's. Seed, modes and entity ids become part of the
    effective configuration, which is in every log. `only` are the sections to use instead of the enabled ones, `bus`
    creates the bus, `entity_ids` (by label) replaces the ids that follow from the profile. `process` is which of the
    vehicle's processes this is, "" the main one: only its sections are built; None builds all.
    A task whose extra is not installed is a mistake; with `skip_missing_extras` it is skipped, as optional ones are.
    Raises ProfileError naming file and line of each mistake, FleetError if the fleet has a vehicle of this name.
    """
    if fleet is not None and fleet.kernel.virtual and fleet.kernel.now_ns != profile.start_time_ns:
        profile.set_start_time(fleet.kernel.now_ns)
    if keep_going is None:
        virtual = fleet.kernel.virtual if fleet is not None else clock is not None and clock.virtual
        keep_going = not (virtual or SIMULATED & set(selected))
    seed = profile.seed if seed is None else seed
    profile.override(f"General:Seed={seed}")
    profile.override(f"General:Selected={', '.join(sorted(selected))}")
    if entity_ids is None:
        entity_ids = assign_ids(_labels(profile), profile.entity_ids)
        for label, number in entity_ids.items():
            profile.override(f"{ENTITY_IDS}:{label}={number}")
    systems = profile.systems
    vehicle = Vehicle(
        profile.vehicle,
        systems[profile.vehicle],
        clock=clock,
        fleet=fleet,
        profile=profile,
        systems=systems,
        seed=seed,
        keep_going=keep_going,
        log_root=log_root,
        state_folder=state_folder,
        bus=bus,
        entity_ids=entity_ids,
        messages=profile.message_schema,
        process=process or "",
    )
    made, problems = Build(vehicle), list[Problem]()
    for section in profile.config.sorted_sections():
        wanted = profile.is_task_enabled(section.name, selected) if only is None else section.name in only
        if wanted and section.name != dune_section_names.MULTIPLEXER:
            problems += _build_task(made, profile, section, process, skip_missing_extras)
    if made.off and only is None:
        problems += _problems_of_external(made, profile, systems, entity_ids)
    if problems:
        vehicle.close()
        raise ProfileError(list(dict.fromkeys(problems)))
    return made


def missing_extra_problem(cls: type[Task], section: Section) -> Problem | None:
    """An extra that the task of a section needs and that is not installed; only a note if the task is optional."""
    if not (extra := missing_extra(cls)):
        return None
    text = f"[{section.name}] needs pip install 'shoal[{extra}]'"
    return Problem("note" if cls.optional else "error", *section.origin, text, "`Enabled = Never` leaves it out")


def _build_task(
    made: Build, profile: Profile, section: Section, process: str | None, skip_missing_extras: bool
) -> list[Problem]:
    """Add the task of a section, or skip it; returns the mistakes."""
    vehicle = made.vehicle
    try:
        cls = find_task(section.name)
    except TaskImportError as error:
        return [Problem("error", *section.origin, str(error))]
    if cls is None:
        if section.name.partition("/")[0] in dune_section_names.TASKS:
            made.skip(section.name, "not in Shoal")
            return []
        return [Problem("error", *section.origin, f"[{section.name}] is not a task", missing_task_reason(section.name))]
    if vehicle.has_virtual_time and cls.external:
        what = "a device" if cls.requires == "drivers" else "the network"
        made.skip(section.name, f"needs {what}, which is off in virtual time")
        made.off.append(section.name)
    elif process is not None and (elsewhere := profile.task_process(section.name)) != process:
        if not process:
            label = section.value("Entity Label", default_label(section.name))
            vehicle.entities.reserve(label, section.name).process = elsewhere
    elif problem := missing_extra_problem(cls, section):
        if problem.severity == "error" and not skip_missing_extras:
            return [problem]
        made.skip(section.name, f"needs pip install 'shoal[{cls.requires}]'")
    else:
        return _add_task(vehicle, profile, section, cls)
    return []


def _problems_of_external(
    made: Build, profile: Profile, systems: Mapping[str, int], entity_ids: Mapping[str, int]
) -> list[Problem]:
    """The mistakes in sections that virtual time skips: a run in real time would reject them.

    Their tasks are created for a vehicle of their own, with the ids and the seed of the other, which never starts.
    """
    of = made.vehicle
    alone = Build(
        Vehicle(
            of.name,
            of.system,
            clock=WallClock(),
            profile=profile,
            systems=systems,
            seed=of.seed,
            entity_ids=entity_ids,
            messages=of.bus.messages,
        )
    )
    try:
        sections = (profile.config.sections[name] for name in made.off)
        return [problem for section in sections for problem in _build_task(alone, profile, section, None, True)]
    finally:
        alone.vehicle.close()


def _add_task(vehicle: Vehicle, profile: Profile, section: Section, cls: type[Task]) -> list[Problem]:
    """Add a task of a class with the options of its section; returns the mistakes."""
    try:
        for consumer in consumer_methods(cls):
            if issubclass(consumer.type, imc.Message) and consumer.type.SCHEMA is not None:
                find_equivalent_class(consumer.type, vehicle.bus.messages)
        task = vehicle.add(cls, section.name, profile.options(section.name))
        for option in section.options.values():
            task.parameter_set.redeclare(option.name, option.attributes)
        _warn_of_unknown(task, section)
    except ParameterError as error:
        named = _named_in(profile, error.reason)
        shared = any(error.name == name for name in cls.reads)
        text = error.reason if shared else f"{section.name}: {error}"
        return [Problem("error", *(named or _origin(profile, section.name, error.name)), text)]
    except imc.SchemaError as error:
        return [Problem("error", *section.origin, f"{section.name}: {error}")]
    except EntityError as error:
        return [Problem("error", *_origin(profile, section.name, "Entity Label"), str(error))]
    except BaseException as error:
        return [Problem("error", *section.origin, f"{section.name}: {with_location(to_ordinary_exception(error))}")]
    return []


def _labels(profile: Profile) -> Iterator[str]:
    """The labels of all tasks of a profile, in line order, so that all processes of a vehicle assign the same ids."""
    for section in profile.config.sections.values():
        if "Enabled" in section.options:
            yield section.value("Entity Label", default_label(section.name))


def join_zenoh(vehicle: Vehicle, profile: Profile) -> None:
    """Attach the vehicle's bus to zenoh, with the options in section [Zenoh] of its profile.

    Raises ProfileError for the section, ConnectionError if zenoh cannot be joined or a vehicle of this name is already
    on the network, ModuleNotFoundError without zenoh.
    """
    from runtime.zenoh import DAEMON, ProcessPart, ZenohConfig, ZenohTransport

    own = [e for e in vehicle.entities if e is not vehicle.daemon.entity and not e.process]
    here = sum(1 << entity.id for entity in own) | (0 if vehicle.process else DAEMON)
    others = ProcessMonitor(vehicle) if any(entity.process for entity in vehicle.entities) else None
    try:
        config = ZenohConfig.from_options(profile.options("Zenoh"), profile.path.parent)
        config = replace(config, vehicle=vehicle.name)
        if absent := config.describe_missing_interface():
            raise ValueError(absent)
        transport = ZenohTransport(
            config,
            vehicle.systems.name,
            vehicle.entities.label,
            system_id=vehicle.systems.id,
            part=ProcessPart(vehicle.name, vehicle.system, here, vehicle.process or MAIN),
            concerns=partial(_concerns, vehicle),
            speaks_for=partial(_speaks_for, vehicle),
            consoles=_listed_consoles(vehicle, profile),
            note=None
            if others is None
            else lambda name, runs: vehicle.kernel.post(others.update_process_state, name, runs),
            warn=lambda words: vehicle.kernel.post(vehicle.daemon.log.warning, words),
        )
        vehicle.bus.attach_transport(transport)
        vehicle.bus.frames = transport.frames
        vehicle.daemon.publishes_all = True
    except ValueError as error:
        raise ProfileError([Problem("error", *_zenoh_origin(profile, str(error)), str(error))]) from None


def _listed_consoles(vehicle: Vehicle, profile: Profile) -> ConsoleAcl:
    """The consoles that may command, over zenoh. Raises ProfileError."""
    try:
        return ConsoleAcl(split_list(profile.value("General", "Consoles")), vehicle.systems.id)
    except ValueError as error:
        problem = Problem("error", *_origin(profile, "General", "Consoles"), f"[General] Consoles: {error}")
        raise ProfileError([problem]) from None


def _zenoh_origin(profile: Profile, error: str) -> Origin:
    """The place of the option in [Zenoh] that is wrong by itself, or that the error names; else of the section.

    Of options that do not go together, the one of the command line is named.
    """
    wrong = [option.origin for option, found in parse_zenoh_options(profile) if isinstance(found, str)]
    named = [option.origin for option in profile.config.options("Zenoh") if option.name in error]
    found = [*wrong, *sorted(named, key=lambda origin: origin != COMMAND_LINE)]
    section = profile.config.sections.get("Zenoh")
    return found[0] if found else section.origin if section else Origin(str(profile.path))


def _concerns(vehicle: Vehicle, request: imc.Message) -> bool:
    """Whether this process of the vehicle answers a request: for parameters that of the task, else the main one.

    Raises LookupError in the main process if no process answers.
    """
    asked = getattr(request, "entity_name", "") or getattr(request, "name", "")
    if not (isinstance(request, OF_ONE_TASK) and asked):
        return not vehicle.process
    if vehicle.daemon.find_task(asked) is not None:
        return True
    entity = vehicle.entities.find(asked)
    if not vehicle.process and (entity is None or not entity.process):
        raise LookupError(f"no task of {vehicle.name} has the entity label {quoted(asked)}")
    if not vehicle.process and entity is not None and entity.orphan:
        raise LookupError(f"{asked} is in process {entity.process}, which does not run")
    return False


def _speaks_for(vehicle: Vehicle, number: int) -> bool:
    """Whether this process of the vehicle answers for an entity; each process also has the reports of others."""
    entity = vehicle.entities.by_id(number)
    return entity is None or vehicle.daemon.reports_state_of(entity)


def config_warnings(vehicle: Vehicle, profile: Profile) -> list[Problem]:
    """Warnings of a vehicle's tasks about their parameters in the profile."""
    return [
        Problem("warning", *_origin(profile, section, doubt.option), f"[{section}] {doubt.text}", doubt.hint)
        for task in vehicle.tasks
        for doubt in task.configuration_warnings()
        for section in [doubt.section or task.name]
    ]


def _warn_of_unknown(task: Task, section: Section) -> None:
    """Let the task log, when it runs, which options are unknown: misspelled ones one by one, others at once."""
    others: list[Option] = []
    for option in section.options.values():
        known = option.name in ("Enabled", *EVERY_TASK) or task.parameter_set.find(option.name) is not None
        if known or not option.history:
            continue
        if near := corrected_spelling(option.name, task.parameter_set.declarations):
            words = f"{quoted(option.name)} is not a parameter; did you mean {quoted(near)}?"
            task.vehicle.kernel.soon(task.log.warning, f"{_short(option)}: {words}")
        else:
            others.append(option)
    if others:
        words = ", ".join(quoted(option.name) for option in others)
        which = "is not a parameter" if len(others) == 1 else "are not parameters"
        task.vehicle.kernel.soon(task.log.warning, f"{_short(others[0])}: {words} {which}")


def _short(option: Option) -> Origin:
    """File and line without the folder, on which the log must not depend."""
    return Origin(Path(option.origin.file).name, option.origin.line)


def _origin(profile: Profile, section: str, option: str) -> Origin:
    """The line where an option is set: in the section, else in [General], which all tasks can read."""
    found = profile.config.option(section, option) or profile.config.option("General", option)
    return found.origin if found is not None else profile.config.sections[section].origin


def _named_in(profile: Profile, reason: str) -> Origin | None:
    """The line of the option of another section that begins a reason, such as "[VSIM/Model/lauv] Mass is ..."."""
    name, _, text = reason.removeprefix("[").partition("] ")
    if not reason.startswith("[") or (section := profile.config.sections.get(name)) is None:
        return None
    options = [option for option in section.options.values() if text.startswith(f"{option.name} ")]
    return max(options, key=lambda option: len(option.name)).origin if options else None
