"""The vehicles of a fleet file: names, ids, ports, start positions and seeds, none of them twice."""

import math
import re
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from runtime.profile import Profile, derived_id, dune_section_names, load_profile
from runtime.vehicle import all_tasks, check_profile, find_task
from runtime.zenoh import ZenohConfig
from shoal.fleet.fleet_file import FleetFile, FleetFileSource, VehicleGroup, read_fleet_file
from shoal.fleet.ports import MAVLINK_OFF, SYSTEM_ID, mavlink_id, mavlink_id_overrides, port_overrides
from support.diagnostics import COMMAND_LINE, Problem, ProfileError
from support.durations import parse_duration
from support.number_parsing import leading_number
from support.terminal_text import quoted, with_suggestion
from support.wgs84 import SEMI_MAJOR_AXIS, displace, ground_distance

RESTART = ("on-failure", "never")
COLUMNS = 10  # vehicles side by side, from west to east
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._~-]{0,63}")
CLIENT = "Zenoh:Mode=client"
PLACE = ":Initial Position="
NEAREST = 5.0  # m between two start positions; nearer, vehicles touch
CELLS = SEMI_MAJOR_AXIS / NEAREST  # per rad, so that two positions that are too near are in neighboring cells
FIXED = ("Mode", "Scouting")  # of the process to which all connect


@dataclass(frozen=True)
class FleetVehicle:
    """One vehicle: how `shoal run` starts it. `group` is the number of its group in the file."""

    name: str
    profile: str
    modes: str
    system: int
    seed: int
    group: int
    overrides: tuple[str, ...]


@dataclass(frozen=True)
class FleetConfig:
    """Content of a fleet file.

    `zenoh` are the options of the process that all vehicles connect to, `stagger` is the time between two starts (s),
    `warnings` are those about the profiles of its vehicles.
    """

    path: Path
    name: str
    vehicles: tuple[FleetVehicle, ...]
    per_process: int
    stagger: float
    restart: bool
    zenoh: dict[str, str]
    log_dir: Path
    warnings: tuple[Problem, ...] = ()

    @property
    def process_groups(self) -> list[tuple[FleetVehicle, ...]]:
        """The vehicles of each process."""
        step = self.per_process
        return [self.vehicles[first : first + step] for first in range(0, len(self.vehicles), step)]


def load_fleet(path: Path, log_dir: Path | None = None) -> FleetConfig:
    """Read a fleet file, and check the profiles of its vehicles.

    Raises FleetFileError and ProfileError, which name the file and what is wrong, OSError if it cannot be read.
    """
    file, source = read_fleet_file(path)
    try:
        stagger = parse_duration(file.stagger)
    except ValueError as error:
        source.fail("stagger", f"stagger: {error}")
    if not NAME.fullmatch(file.name):
        source.fail("name", f"name: {quoted(file.name)} is not a name")
    if file.restart not in RESTART:
        source.fail("restart", f"restart: {quoted(file.restart)} is not one of {', '.join(RESTART)}")
    for option in FIXED:
        if option in file.zenoh:
            source.fail(f"zenoh.{option}", f"zenoh: {option} cannot be set, since all vehicles connect to this process")
    try:
        port = ZenohConfig.from_options(file.zenoh).local_port
    except ValueError as error:
        source.fail("zenoh", str(error))
    if not port:
        source.fail("zenoh", "zenoh: Local Port cannot be 0, since all vehicles connect there")
    vehicles = _vehicles(file, path, source)
    folder = log_dir if log_dir is not None else Path(file.log_dir)
    restart = file.restart == "on-failure"
    _refuse_crowded_starts(vehicles, source)
    warnings = (*_check(vehicles, path, file, source), *_without_mavlink(vehicles, path))
    return FleetConfig(path, file.name, vehicles, file.per_process, stagger, restart, file.zenoh, folder, warnings)


def _vehicles(file: FleetFile, path: Path, source: FleetFileSource) -> tuple[FleetVehicle, ...]:
    named: dict[str, tuple[int, int, VehicleGroup]] = {}
    for place, group in enumerate(file.vehicles):
        for number in range(1, group.count + 1):
            name = group.name.replace("{number}", str(number))
            if group.count > 1 and "{number}" not in group.name:
                name = f"{group.name}-{number}"
            if not NAME.fullmatch(name):
                source.fail(f"vehicles[{place}].name", f"{quoted(name)} is not a name of a vehicle")
            if name in named:
                words = f"two vehicles are called {quoted(name)} (write {{number}} into the name of a group)"
                source.fail(f"vehicles[{place}].name", words)
            named[name] = place, number - 1, group
    profiles: dict[str, Profile] = {}
    for place, group in enumerate(file.vehicles):
        within = f"vehicles[{place}]."
        wanted, modes = group.profile or file.profile, file.modes if group.modes is None else group.modes
        with _naming_place(source, f"{within if group.profile else ''}profile", wanted):
            profiles[wanted] = profiles.get(wanted) or load_profile(wanted, [path.parent])
        with _naming_place(source, f"{within if group.modes is not None else ''}modes", modes):
            profiles[wanted].parse_modes(modes)
    ids = _ids({name: profiles[group.profile or file.profile] for name, (_, _, group) in named.items()})
    addresses = [f"IMC Addresses:{name}={number:#06x}" for name, number in ids.items()]
    vehicles: list[FleetVehicle] = []
    taken: set[int] = set()
    for place, (name, (number, within, group)) in enumerate(named.items()):
        profile = profiles[group.profile or file.profile]
        start = group.start or file.start
        overrides = [
            *addresses,
            *port_overrides(profile, place),
            *mavlink_id_overrides(profile, ids[name], taken),
            *_start(profile, start, within if group.start else place, file.spacing),
            CLIENT,
            "Zenoh:Scouting=none",
            f"Zenoh:Local Port={file.zenoh.get('Local Port', 7447)}",
            f"Zenoh:Hear={', '.join(file.hear) or 'Abort'}",
            *file.set,
            *group.set,
        ]
        modes = file.modes if group.modes is None else group.modes
        wanted = group.profile or file.profile
        vehicles.append(FleetVehicle(name, wanted, modes, ids[name], file.seed + place, number, tuple(overrides)))
    _refuse_shared_ids(vehicles, profiles, source)
    return tuple(vehicles)


def _refuse_shared_ids(vehicles: list[FleetVehicle], profiles: dict[str, Profile], source: FleetFileSource) -> None:
    """Raise FleetFileError if what the file sets gives two vehicles one MAVLink id."""
    owners: dict[int, FleetVehicle] = {}
    for vehicle in vehicles:
        number = mavlink_id(profiles[vehicle.profile], vehicle.system, vehicle.overrides)
        if number is None:
            continue
        first = owners.setdefault(number, vehicle)
        if first is not vehicle:
            words = f"{first.name} and {vehicle.name} have the same MAVLink id {number}"
            hint = f"set [{SYSTEM_ID[0]}] {SYSTEM_ID[1]} of one of them to another one, or of neither"
            source.fail(f"vehicles[{vehicle.group}].set", f"{words} ({hint})")


@contextmanager
def _naming_place(source: FleetFileSource, place: str, value: str) -> Generator[None]:
    """Raise FleetFileError with the place of a value of which there is no profile or mode."""
    try:
        yield
    except ProfileError as error:
        problem = error.problems[0]
        if problem.line:
            raise
        words = problem.text if quoted(value) in problem.text else f"{value}: {problem.text}"
        source.fail(place, f"{place}: {words}{f' ({problem.hint})' if problem.hint else ''}")


def _refuse_crowded_starts(vehicles: tuple[FleetVehicle, ...], source: FleetFileSource) -> None:
    """Raise FleetFileError if two vehicles start within NEAREST of each other, such as those of neighboring groups."""
    cells: dict[tuple[int, int], list[tuple[FleetVehicle, float, float]]] = {}
    for vehicle in vehicles:
        text = next((o.partition("=")[2] for o in reversed(vehicle.overrides) if PLACE in o), "")
        try:
            lat, lon = (math.radians(leading_number(word)) for word in text.split(","))
        except ValueError:
            continue  # without a start position, or with a wrong one, which the check of the profile reports
        if not math.isfinite(lat + lon):
            continue
        row, column = (round(CELLS * angle) for angle in (lat, lon * math.cos(round(lat, 2))))
        near = (found for r in (-1, 0, 1) for c in (-1, 0, 1) for found in cells.get((row + r, column + c), ()))
        for other, other_lat, other_lon in near:
            if (away := ground_distance(other_lat, other_lon, lat, lon)) < NEAREST:
                words = f"{other.name} and {vehicle.name} start {away:.1f} m apart, at least {NEAREST:g} m are needed"
                hint = "groups with a start are rows of their own: set start, count or spacing"
                source.fail(f"vehicles[{vehicle.group}].start", f"{words} ({hint})")
        cells.setdefault((row, column), []).append((vehicle, lat, lon))


def _refuse_mistakes(problems: list[Problem], group: int, file: FleetFile, source: FleetFileSource) -> None:
    """Raise FleetFileError for a warning about what the file itself sets, as a scenario does: it is a typing error."""
    for problem in problems:
        if problem.file != COMMAND_LINE.file or problem.severity == "note":
            continue
        reason = problem.text + (f" ({problem.hint})" if problem.hint else "")
        if problem.text.startswith("[Zenoh] Hear"):
            source.fail("hear", f"hear: {reason.removeprefix('[Zenoh] Hear: ')}")
        for place, settings in ((f"vehicles[{group}].set", file.vehicles[group].set), ("set", file.set)):
            for number, setting in enumerate(settings):
                section, _, option = setting.partition("=")[0].rpartition(":")
                if section.strip() in problem.text and option.strip() in problem.text:
                    source.fail(f"{place}[{number}]", f"{place}: {reason}")


def _refuse_unknown_general(profile: Profile, group: int, file: FleetFile, source: FleetFileSource) -> None:
    """Raise FleetFileError for an option of [General] that neither Shoal nor the profile has."""
    for place, settings in ((f"vehicles[{group}].set", file.vehicles[group].set), ("set", file.set)):
        for number, setting in enumerate(settings):
            section, _, option = (word.strip() for word in setting.partition("=")[0].partition(":"))
            own = profile.config.option("General", option)
            theirs = own is not None and any(a.origin.file != COMMAND_LINE.file for a in own.history)
            if section == "General" and option not in dune_section_names.GENERAL and not theirs:
                words = with_suggestion(f"[General] has no option {option!r}", option, dune_section_names.GENERAL)
                source.fail(f"{place}[{number}]", f"{place}: {words}")


def _check(
    vehicles: tuple[FleetVehicle, ...], path: Path, file: FleetFile, source: FleetFileSource
) -> tuple[Problem, ...]:
    """The warnings about the profiles of all vehicles that differ in more than name, place and numbers.

    Raises FleetFileError for what the file sets, ProfileError for the profile: a process that cannot run would be
    started again and again.
    """
    found: list[Problem] = []
    for vehicle in {m.group: m for m in reversed(vehicles)}.values():
        try:
            profile = load_profile(vehicle.profile, [path.parent], vehicle=vehicle.name, overrides=vehicle.overrides)
            problems = check_profile(profile, all_tasks([]), profile.parse_modes(vehicle.modes), find_task)
            _refuse_mistakes(problems, vehicle.group, file, source)
            _refuse_unknown_general(profile, vehicle.group, file, source)
            found += problems
        except ProfileError as error:
            found += error.problems
    said = dict.fromkeys(replace(p, file=str(path)) if p.file == COMMAND_LINE.file else p for p in found)
    if errors := [problem for problem in said if problem.severity == "error"]:
        raise ProfileError(errors)
    return tuple(problem for problem in said if problem.severity == "warning")


def _without_mavlink(vehicles: tuple[FleetVehicle, ...], path: Path) -> list[Problem]:
    """Names the vehicles for which no MAVLink id is left."""
    # What the file sets comes last: it may have switched MAVLink off itself.
    silent = [m.name for m in vehicles if MAVLINK_OFF in m.overrides[: m.overrides.index(CLIENT)]]
    words = "MAVLink has 250 ids: it is off in {}, {} of the {} vehicles"
    text = words.format(", ".join(silent[:3]) + ", ..." * (len(silent) > 3), len(silent), len(vehicles))
    return [Problem("warning", str(path), 0, text)] if silent else []


def _ids(profiles: dict[str, Profile]) -> dict[str, int]:
    """The IMC id of each vehicle: that of its name; if another one has it, the next free one."""
    ids: dict[str, int] = {}
    for name, profile in profiles.items():
        number = profile.systems.get(name) or derived_id(name)
        taken = {*ids.values(), *(other for whose, other in profile.systems.items() if whose != name)}
        while number in taken:
            number = 0xA000 | ((number + 1) & 0x1FFF)  # where ids that follow from names are
        ids[name] = number
    return ids


def _start(profile: Profile, start: tuple[float, float] | None, place: int, spacing: float) -> list[str]:
    """Overrides that put a vehicle to its place in the grid: rows of COLUMNS, from the start position to the north."""
    found: list[str] = []
    row, column = divmod(place, COLUMNS)
    for section in profile.config.sections.values():
        option = section.options.get("Initial Position")
        if option is None:
            continue
        lat, lon = start or tuple(float(word) for word in option.value.split(","))
        moved = displace(math.radians(lat), math.radians(lon), 0.0, row * spacing, column * spacing)
        found.append(f"{section.name}:Initial Position={math.degrees(moved[0]):.8f}, {math.degrees(moved[1]):.8f}")
    return found
