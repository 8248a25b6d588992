"""Finds mistakes in the sections of a profile that concern no single task: General, IMC Addresses, Zenoh."""

from collections.abc import Callable, Iterable, Iterator
from itertools import chain

import imc
from runtime.profile import Option, Profile, dune_section_names, parse_imc_id, split_list
from runtime.zenoh import ZenohConfig
from support.diagnostics import Problem, ProfileError, Severity
from support.terminal_text import corrected_spelling, quoted


def general_problems(profile: Profile) -> Iterator[Problem]:
    """All problems of these sections."""
    return chain(_of_general(profile), _of_addresses(profile), _of_zenoh(profile))


def parse_zenoh_options(profile: Profile) -> Iterator[tuple[Option, ZenohConfig | str]]:
    """The options of [Zenoh], each with its configuration alone, or what is wrong with it."""
    for option in profile.config.options("Zenoh"):
        try:
            yield option, ZenohConfig.from_options({option.name: option.value}, profile.path.parent)
        except ValueError as error:
            yield option, str(error)


def _of_general(profile: Profile) -> Iterator[Problem]:
    if problem := profile.vehicle_name_problem():
        yield problem
    readers: tuple[Callable[[], object], ...] = (
        lambda: profile.bus_transport,
        lambda: profile.message_schema,
        lambda: profile.start_time_ns,
        lambda: profile.seed,
        lambda: profile.entity_ids,
    )
    for read in readers:
        try:
            read()
        except ProfileError as error:
            yield from error.problems
    for option in profile.config.options("General"):
        if option.name in dune_section_names.GENERAL:
            continue
        near = corrected_spelling(option.name, dune_section_names.GENERAL)
        severity: Severity = "warning" if near else "note"
        hint = f"did you mean {quoted(near)}?" if near else ""
        yield Problem(severity, *option.origin, f"[General] unknown option {quoted(option.name)}", hint)
    if (option := profile.config.option("General", "Console Messages")) is not None:
        names = [item.partition(":")[0].strip() for item in split_list(option.value)]
        yield from _of_message_names(profile, option, "[General] Console Messages", names)


def _of_zenoh(profile: Profile) -> Iterator[Problem]:
    for option, found in parse_zenoh_options(profile):
        if isinstance(found, str):
            yield Problem("error", *option.origin, found)
        else:
            yield from _of_message_names(profile, option, "[Zenoh] Hear", found.hear or ())
            if absent := found.describe_missing_interface():
                yield Problem("warning", *option.origin, absent)


def _of_message_names(profile: Profile, option: Option, title: str, names: Iterable[str]) -> Iterator[Problem]:
    if not (names := list(names)):
        return
    try:
        schema = profile.message_schema or imc.builtin()
    except ProfileError:
        return  # reported already
    known = [kind.abbrev for kind in schema.types_by_id.values()]
    for name in [name for name in names if name not in known]:
        hint = f"did you mean {quoted(near)}?" if (near := corrected_spelling(name, known)) else ""
        yield Problem("warning", *option.origin, f"{title}: there is no message {quoted(name)}", hint)


def _of_addresses(profile: Profile) -> Iterator[Problem]:
    known: dict[int, Option] = {}
    for option in profile.config.options("IMC Addresses"):
        try:
            first = known.setdefault(parse_imc_id(option.value), option)
        except ValueError as error:
            yield Problem("warning", *option.origin, f"{quoted(option.name)} has no id: {error}", "such as 0x001A")
            continue
        if first is not option:
            text = f"{quoted(option.name)} and {quoted(first.name)} ({first.origin}) have the same id {option.value}"
            yield Problem("note", *option.origin, text)
    vehicle = profile.config.option("General", "Vehicle")
    if vehicle and not profile.config.value("IMC Addresses", vehicle.value):
        text = f"{quoted(vehicle.value)} is not in [IMC Addresses], so its id is 0x{profile.system_id:04X}"
        yield Problem("note", *vehicle.origin, text)
