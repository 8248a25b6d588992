"""Re-runs tasks on the logged messages of all others, and compares what they publish with the log."""

import contextlib
import math
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import imc
from runtime.bus import find_equivalent_class
from runtime.kernel import SECOND, VirtualClock, nanoseconds
from runtime.logs import create_log
from runtime.profile import Profile, default_label, load_profile, own_etc, split_list
from runtime.task import Task, consumer_methods, find_parameter, periodic_methods
from runtime.vehicle import TaskImportError, all_tasks, build, find_task, missing_task_reason
from shoal.rerun.comparison import LastMomentBuffer, RerunComparison
from shoal.rerun.log_summary import GAP, RerunLogSummary, summarize_log
from shoal.rerun.logged_bus import LoggedBus
from shoal.rerun.logged_packet_times import LogReplay, TimestampResolver, make_sender_test
from shoal.rerun.publishing_tasks import publishing_sections
from shoal.rerun.run_log_sequence import CONFIGURATION, LoggedRun, find_run_of_log
from support.file_errors import add_path_to_errors
from support.terminal_text import quoted, suggestion

ENOUGH = 10  # messages at a rate; so many periods without one are a silence
TOLERANCE = 0.5  # s, between the two messages of a pair, for a log made on a wall clock


class ResimulationError(ValueError):
    """The log cannot be re-simulated; the text gives the reason and the remedy."""


@dataclass
class Resimulation:
    """The result. `exact`: a virtual run from its start, without overrides, so nothing may differ.

    notes: what cannot be reproduced, and why. begin: s since 1970 UTC. labels: of the tasks' entities, by id.
    missing: inputs that a task subscribes to and the log lacks, by entity; what these entities publish cannot be
    compared with the log. sources: the sections of the profile whose task can make such an input, by its name.
    """

    log: imc.Log
    tasks: list[str]
    comparison: RerunComparison
    exact: bool
    begin: float
    notes: list[str] = field(default_factory=list[str])
    labels: dict[int, str] = field(default_factory=dict[int, str])
    missing: dict[int, list[str]] = field(default_factory=dict[int, list[str]])
    sources: dict[str, list[str]] = field(default_factory=dict[str, list[str]])


def resimulate(
    log: imc.Log,
    tasks: Sequence[str],
    *,
    overrides: Sequence[str] = (),
    profile: str | Path | None = None,
    out: Path | None = None,
) -> Resimulation:
    """Re-run tasks on the logged messages of all others, with `overrides` ("Section:Option=value").

    `tasks` are sections, entity labels or classes. They start with the run, whose earlier logs are read as well. Their
    parameters are those of its Config.ini, or of `profile`. `out` becomes a log of all messages on the bus.
    Raises ResimulationError, ProfileError, FileExistsError, OSError, and what the tasks raise.
    """
    run = find_run_of_log(log)
    about = summarize_log(run)
    if about is None:
        raise ResimulationError(f"{log.path}: the log has no messages")
    loaded, notes = logged_profile(run.logs[0], about, profile)
    notes = [f"{note}; name a profile with -c" for note in notes]
    if loaded.message_schema is not None:
        run.schema.share_classes(loaded.message_schema)
    if before := ", ".join(earlier.path.parent.name for earlier in run.logs[:-1]):
        notes.append(f"starts with the earlier logs of the run: {before}")
    sections = [_section(loaded, name) for name in tasks]
    for section in sections:
        _check(section)
        if section not in loaded.config.sections:
            loaded.override(f"{section}:Enabled=Always")
    for assignment in overrides:
        _check_option(assignment, *loaded.override(assignment))
    loaded.raise_unused_overrides()
    loaded.raise_errors()
    virtual = about.begin == loaded.start_time  # a log of a wall clock never begins exactly then
    start = loaded.start_time_ns if virtual else nanoseconds(about.begin)
    with tempfile.TemporaryDirectory() as folder:
        made = build(
            loaded,
            frozenset(split_list(loaded.config.value("General", "Selected"))),
            clock=VirtualClock(start),
            keep_going=False,
            log_root=Path(folder) / "log",
            state_folder=Path(folder) / "db",
            only=sections,
            bus=LoggedBus,
            entity_ids=about.entity_ids,
        )
        vehicle = made.vehicle
        for reason, skipped in made.skipped.items():
            vehicle.close()
            raise ResimulationError(f"{', '.join(skipped)}: {reason}")
        again = [vehicle.task(section) for section in sections]
        chosen = {entity.id: entity.label for entity in vehicle.entities if entity.component in sections}
        own = make_sender_test(
            about.owner, chosen.keys(), since=about.begin if about.begin > about.opened else -math.inf
        )
        comparison = RerunComparison(log.schema, 0.0 if virtual else TOLERANCE)
        bus = vehicle.bus
        assert isinstance(bus, LoggedBus)
        moment = LastMomentBuffer(comparison, lambda: vehicle.kernel.now_ns)
        bus.on_logged, bus.on_published = moment.add_logged, moment.add_published
        bus.daemon, bus.cut_short = vehicle.daemon, not about.ends_cleanly
        for label, entity in about.entity_ids.items():
            vehicle.entities.learn_label(about.owner, entity, label)
        with _written(out, log, loaded) as bus.on_packet:
            rates = TimestampResolver(start, (rate for _, rate in tick_rates(loaded)), virtual=virtual)
            of_entity = _rates_by_entity(loaded, about) if virtual else {}
            bus.deliver_log(LogReplay(run, about.owner, rates, own, start, about.late, of_entity), log.schema, own)
            try:
                vehicle.start()
                end = rates.resolve(about.end)
                moment.end = end if about.ends_cleanly else None
                vehicle.kernel.run(until=end if about.ends_cleanly else end + 1)
            finally:
                vehicle.close()
            bus.finish()
        if not moment.compare_last(about.is_active_at_end and not overrides):
            notes.append("the run was stopped in the middle of its last moment, which is not compared")
        comparison.finish()
    notes += _reservations(run, about, loaded, again, chosen, virtual, bus.malformed_in_log)
    missing: dict[int, list[str]] = {}
    kinds = {kind for (_, kind), tally in comparison.counts.items() if tally.published}
    published = {run.schema.by_id(kind).__name__ for kind in kinds & run.schema.types_by_id.keys()}
    for task in again:
        own_ids = {entity.id for entity in vehicle.entities if entity.component == task.name}
        stopped = any(t.logged and not t.published for (entity, _), t in comparison.counts.items() if entity in own_ids)
        if any(t.only_logged for (entity, _), t in comparison.counts.items() if entity in own_ids):
            notes += _ending(run, about, task)
        inputs = _lacking(run, about, loaded, task, stopped=stopped)
        if lacking := [name for name in inputs if name not in published]:
            missing |= dict.fromkeys(own_ids, lacking)
    sources = publishing_sections(loaded, {name for names in missing.values() for name in names})
    exact = virtual and not overrides
    return Resimulation(log, sections, comparison, exact, start / SECOND, notes, chosen, missing, sources)


def logged_profile(log: imc.Log, about: RerunLogSummary, named: str | Path | None) -> tuple[Profile, list[str]]:
    """The configuration of a run by its first log, or the profile that is named, and what is to be noted of it."""
    beside = log.path.parent / CONFIGURATION
    if named is not None:
        return load_profile(named, strict=False), []
    if beside.is_file():
        return load_profile(beside, strict=False), []
    name = about.names.system_name(about.owner)
    addresses = own_etc() / "common" / "imc-addresses.ini"
    note = f"the log has no {CONFIGURATION}: using default parameters"
    return load_profile(addresses, vehicle=name, strict=False), [note]


def _section(profile: Profile, name: str) -> str:
    """The section of a name: the section itself, its entity label, or its class if only one section has it."""
    sections = profile.config.sections
    if name in sections:
        return name
    labels = {section: profile.config.value(section, "Entity Label", default_label(section)) for section in sections}
    classes = {section: section.partition("/")[0] for section in sections}
    found = [s for s in sections if name in (labels[s], classes[s], classes[s].rpartition(".")[2])]
    selected = split_list(profile.config.value("General", "Selected"))
    found = [section for section in found if profile.is_task_enabled(section, selected)] or found
    if len(found) == 1:
        return found[0]
    if len(found) > 1:
        raise ResimulationError(f"{quoted(name)} is ambiguous: {', '.join(found)}")
    with contextlib.suppress(TaskImportError):
        if find_task(name) is not None:
            return name
    tasks = [section for section in sections if "Enabled" in sections[section].options] or list(all_tasks([]))
    known = dict.fromkeys([*tasks, *(labels[section] for section in tasks if section in labels)])
    hint = suggestion(name, known) or "`shoal tasks` lists them"
    raise ResimulationError(f"there is no task {quoted(name)}: {hint}")


def _check(section: str) -> None:
    try:
        cls = find_task(section)
    except TaskImportError as error:
        raise ResimulationError(str(error)) from None
    if cls is None:
        raise ResimulationError(f"{section} is not a task of Shoal: {missing_task_reason(section)}")
    if cls.external:
        raise ResimulationError(f"{section} needs the network, which logs do not record")


def _rates_by_entity(profile: Profile, about: RerunLogSummary) -> dict[int, set[float]]:
    found: dict[int, set[float]] = {}
    for section, rate in tick_rates(profile):
        label = profile.config.value(section, "Entity Label", default_label(section))
        if label in about.entity_ids:
            found.setdefault(about.entity_ids[label], set()).add(rate)
    return found


def tick_rates(profile: Profile) -> Iterator[tuple[str, float]]:
    """The sections of the profile, with each rate (Hz) at which their tasks tick."""
    for name in profile.config.sections:
        try:
            cls = find_task(name)
        except TaskImportError:
            continue
        for ticking in periodic_methods(cls) if cls is not None else ():
            if not isinstance(ticking.rate, str):
                yield name, ticking.rate
                continue
            for parameter in cls.parameters().values() if cls is not None else ():
                if parameter.attribute == ticking.rate:
                    text = profile.options(name).get(parameter.name)
                    with contextlib.suppress(ValueError):
                        yield name, float(parameter.parse(text) if text else parameter.default)


def _reservations(
    run: LoggedRun,
    about: RerunLogSummary,
    profile: Profile,
    tasks: Sequence[Task],
    chosen: dict[int, str],
    virtual: bool,
    malformed: int,
) -> Iterator[str]:
    """The results that cannot be reproduced, and the reasons."""
    if not virtual:
        since = profile.start_time if 0.0 <= about.opened - profile.start_time < 1e6 else about.opened
        if about.begins_with_start and (late := about.begin - since) > 0.0:
            whom = "the vehicle" if since == profile.start_time else "the run"
            why = f"; {run.gap}" if run.gap else ""
            yield f"the log begins {late:.1f} s after {whom}: the state of the tasks at that time is unknown{why}"
        elif run.gap:
            yield f"the tasks start with this log, not with the run; {run.gap}"
        if not about.begins_with_start or since != profile.start_time:
            yield "made on a wall clock: the log does not record when tasks ticked and in which order things happened"
    if not about.ends_cleanly:
        yield "the log does not end cleanly: its last messages may be missing"
    if damaged := sum(len(log.losses) for log in run.logs):
        yield f"the log has {damaged} damaged places: what the tasks received there is unknown"
    if malformed:
        yield f"{malformed} messages of the log are malformed and were not delivered"
    if skipped := profile.config.value("Transports.Logging", "Transports"):
        yield f"the log has only selected messages: {skipped}"
    schema = run.schema
    present = {number: schema.by_id(number) for number in about.counts if number in schema.types_by_id}
    for task in tasks:
        for wanted in _beside_messages(task):
            yield f"{task.name} subscribes to {wanted.__name__}, which logs never have: re-run its source, too"
        for wanted in _inputs(run, task):
            if not any(issubclass(kind, wanted) for kind in present.values()):
                known = wanted.ID in present
                reason = f"uses id {wanted.ID} for another message" if known else f"has no {wanted.__name__}"
                yield f"{task.name} subscribes to {wanted.__name__}, but the log {reason}"
    for entity, label in chosen.items():
        if not any(speaker == entity for _, speaker in about.speakers):
            yield f"the log has no messages of the entity {quoted(label)}" + _others(about, label)


def _ending(run: LoggedRun, about: RerunLogSummary, task: Task) -> Iterator[str]:
    """The inputs of a task that end long before the log does."""
    for wanted in _inputs(run, task):
        count, last = about.counts[wanted.ID], about.last.get(wanted.ID, math.nan)
        silence = about.end - last
        if count >= ENOUGH and silence > max(GAP, ENOUGH * (last - about.begin) / count):
            yield (
                f"{task.name} subscribes to {wanted.__name__}, which ends {silence:.1f} s before the log: "
                "what the task publishes later cannot be compared"
            )


def _beside_messages(task: Task) -> list[type]:
    """The objects besides messages that a task subscribes to, such as frames."""
    kinds = [cast(type[object], consumer.type) for consumer in consumer_methods(type(task))]
    return [kind for kind in kinds if not issubclass(kind, imc.Message)]


def _inputs(run: LoggedRun, task: Task) -> Iterator[type[imc.Message]]:
    """The messages that a task subscribes to, as the log has them; those that it defines otherwise are its own."""
    for consumer in consumer_methods(type(task)):
        wanted = cast(type[object], consumer.type)
        if issubclass(wanted, imc.Message):
            try:
                yield find_equivalent_class(wanted, run.schema) if wanted.SCHEMA is not None else wanted
            except imc.SchemaError:
                yield wanted


def _lacking(run: LoggedRun, about: RerunLogSummary, profile: Profile, task: Task, *, stopped: bool) -> Iterator[str]:
    """The inputs of a task that the log lacks. A message that was not published is not lacking.

    stopped: the task published messages in the log, but none here.
    """
    chosen = split_list(profile.config.value("Transports.Logging", "Transports"))
    # A vehicle's own log begins with LoggingControl and has its heartbeat. But only the result shows whether another
    # log was made from it, without some messages.
    whole = about.begins_with_start and imc.Heartbeat.ID in about.counts and not stopped
    present = [run.schema.by_id(number) for number in about.counts if number in run.schema.types_by_id]
    if stopped:
        yield from (wanted.__name__ for wanted in _beside_messages(task))
    for wanted in _inputs(run, task):
        recorded = whole and (not chosen or wanted.__name__ in chosen)
        if not recorded and not any(issubclass(kind, wanted) for kind in present):
            yield wanted.__name__


def _check_option(assignment: str, section: str, option: str) -> None:
    """Raises ResimulationError if --set names an option that its task does not have."""
    try:
        cls = find_task(section)
    except TaskImportError:
        return
    if cls is None or option == "Enabled":
        return
    known = cls.parameters()
    if find_parameter(known, option) is None:
        hint = suggestion(option, known) or f"`shoal tasks {section.partition('/')[0]}` lists them"
        raise ResimulationError(f"--set {assignment}: {section} has no option {quoted(option)}: {hint}")


def _others(about: RerunLogSummary, label: str) -> str:
    hint = suggestion(label, about.entity_ids)
    return f"; {hint}; rename it with --set 'Section:Entity Label=...'" if hint else ""


@contextlib.contextmanager
def _written(out: Path | None, log: imc.Log, profile: Profile) -> Generator[Callable[[bytes], object]]:
    """A function that takes the packets of the new log; without `out` it drops them."""
    if out is None:
        yield len
        return
    with create_log(out, log) as writer:
        configuration = profile.dump().encode(errors="surrogateescape")
        with add_path_to_errors(out):
            (writer.path.parent / CONFIGURATION).write_bytes(configuration)
        yield writer.write
