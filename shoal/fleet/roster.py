"""The vehicles of a fleet file: names, ids, ports, start positions and seeds, none of them twice."""

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import msgspec
import yaml

from imc.coordinates import displace
from runtime.durations import parse_duration
from runtime.problem import Problem, ProfileError, misspelled, quoted
from runtime.profile import Profile, derived_id, load_profile
from shoal.fleet.ports import own_ports

Count = Annotated[int, msgspec.Meta(ge=1, le=1000)]
HEARD = ("Abort", "Announce", "Heartbeat")
RESTART = ("on-failure", "never")
COLUMNS = 10  # vehicles side by side, from west to east
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._~-]*")


class Group(msgspec.Struct, forbid_unknown_fields=True):
    """Vehicles of one profile. `{number}` in `name` counts them from 1."""

    name: str
    count: Count = 1
    profile: str | None = None
    modes: str | None = None
    start: tuple[float, float] | None = None
    set: list[str] = []


class FleetFile(msgspec.Struct, forbid_unknown_fields=True):
    """A fleet file, as it is written; `Roster` says what it means."""

    vehicles: Annotated[list[Group], msgspec.Meta(min_length=1)]
    name: str = "fleet"
    profile: str = "lauv-noptilus-1"
    modes: str = "Simulation"
    per_process: Count = 1
    start: tuple[float, float] | None = None  # degrees
    spacing: Annotated[float, msgspec.Meta(gt=0)] = 20.0  # m
    seed: Annotated[int, msgspec.Meta(ge=0)] = 1
    stagger: str = "0.2 s"
    restart: str = "on-failure"
    hear: list[str] = msgspec.field(default_factory=lambda: list(HEARD))
    set: list[str] = []
    zenoh: dict[str, str] = {}
    log_dir: str = "log"


@dataclass(frozen=True)
class Member:
    """One vehicle: how `shoal run` starts it."""

    name: str
    profile: str
    modes: str
    system: int
    seed: int
    overrides: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class Roster:
    """What a fleet file says.

    `zenoh` are the options of the process that all vehicles connect to, `stagger` is the time between two starts (s).
    """

    path: Path
    name: str
    members: tuple[Member, ...]
    per_process: int
    stagger: float
    restart: bool
    zenoh: dict[str, str]
    log_dir: Path

    @property
    def crews(self) -> list[tuple[Member, ...]]:
        """The members of each process."""
        step = self.per_process
        return [self.members[first : first + step] for first in range(0, len(self.members), step)]


def load_roster(path: Path, log_dir: Path | None = None) -> Roster:
    """Read a fleet file. Raises ProfileError naming it and what is wrong, OSError if it cannot be read."""

    def wrong(text: str, hint: str = "") -> ProfileError:
        return ProfileError([Problem("error", str(path), 0, text, hint)])

    try:
        plain: Any = yaml.safe_load(path.read_text(encoding="utf-8"))
        file = msgspec.convert(plain, FleetFile)
    except yaml.YAMLError as error:
        raise wrong(f"no YAML: {error}") from None
    except (msgspec.ValidationError, UnicodeDecodeError) as error:
        found = re.search(r"unknown field `(.*?)`", str(error))
        near = misspelled(found[1], [*FleetFile.__struct_fields__, *Group.__struct_fields__]) if found else ""
        raise wrong(str(error), f"did you mean {quoted(near)}?" if near else "") from None
    if file.restart not in RESTART:
        raise wrong(f"restart: {quoted(file.restart)} is not one of {', '.join(RESTART)}")
    try:
        stagger = parse_duration(file.stagger)
    except ValueError as error:
        raise wrong(f"stagger: {error}") from None
    if not NAME.fullmatch(file.name):
        raise wrong(f"name: {quoted(file.name)} is not a name")
    members = _members(file, path, wrong)
    folder = log_dir if log_dir is not None else Path(file.log_dir)
    restart = file.restart == "on-failure"
    return Roster(path, file.name, members, file.per_process, stagger, restart, file.zenoh, folder)


def _members(file: FleetFile, path: Path, wrong: Any) -> tuple[Member, ...]:
    named: dict[str, Group] = {}
    for group in file.vehicles:
        for number in range(1, group.count + 1):
            name = group.name.replace("{number}", str(number))
            if group.count > 1 and "{number}" not in group.name:
                name = f"{group.name}-{number}"
            if not NAME.fullmatch(name):
                raise wrong(f"{quoted(name)} is not a name of a vehicle")
            if name in named:
                raise wrong(f"two vehicles are called {quoted(name)}", "write {number} into the name of a group")
            named[name] = group
    folders = [path.parent]
    profiles = {name: load_profile(name, folders) for name in {g.profile or file.profile for g in file.vehicles}}
    ids = _ids(named, {name: profiles[group.profile or file.profile] for name, group in named.items()})
    addresses = [f"IMC Addresses:{name}={number:#06x}" for name, number in ids.items()]
    members: list[Member] = []
    for place, (name, group) in enumerate(named.items()):
        profile = profiles[group.profile or file.profile]
        start = group.start or file.start
        overrides = [
            *addresses,
            *own_ports(profile, place),
            *_start(profile, start, place if start is file.start else 0, file.spacing),
            "Zenoh:Mode=client",
            "Zenoh:Scouting=none",
            f"Zenoh:Local Port={file.zenoh.get('Local Port', 7447)}",
            f"Zenoh:Hear={', '.join(file.hear) or 'Abort'}",
            *file.set,
            *group.set,
        ]
        modes = file.modes if group.modes is None else group.modes
        wanted = group.profile or file.profile
        members.append(Member(name, wanted, modes, ids[name], file.seed + place, tuple(overrides)))
    return tuple(members)


def _ids(named: dict[str, Group], profiles: dict[str, Profile]) -> dict[str, int]:
    """The IMC id of each vehicle: that of its name; if another one has it, the next one that nobody has."""
    ids: dict[str, int] = {}
    for name in named:
        profile = profiles[name]
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
