"""Profiles: ini files read into values that know their file and line."""

from runtime.profile import dune
from runtime.profile.config import Config, Option, Section, items, statement, write
from runtime.profile.dune import EVERY_TASK
from runtime.profile.ini import parse, read_sections, write_sections
from runtime.profile.profile import (
    ALWAYS,
    ENTITY_IDS,
    MAIN,
    NEVER,
    Profile,
    default_label,
    derived_id,
    load_profile,
    parse_address,
)
from runtime.profile.search_path import available, find_profile, located, own_etc, search_path, user_etc

__all__ = [
    "ALWAYS",
    "ENTITY_IDS",
    "EVERY_TASK",
    "MAIN",
    "NEVER",
    "Config",
    "Option",
    "Profile",
    "Section",
    "available",
    "default_label",
    "derived_id",
    "dune",
    "find_profile",
    "items",
    "load_profile",
    "located",
    "own_etc",
    "parse",
    "parse_address",
    "read_sections",
    "search_path",
    "statement",
    "user_etc",
    "write",
    "write_sections",
]
