"""Profiles: ini files read into values that know their file and line."""

from runtime.profile import dune
from runtime.profile.config import Config, Option, Section, format_option, format_sections, split_list
from runtime.profile.dune import EVERY_TASK
from runtime.profile.ini import read_config, read_sections, write_sections
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
from runtime.profile.profile_search import (
    available_profiles,
    copy_in_root,
    find_profile,
    own_etc,
    search_path,
    user_etc,
)

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
    "available_profiles",
    "copy_in_root",
    "default_label",
    "derived_id",
    "dune",
    "find_profile",
    "format_option",
    "format_sections",
    "load_profile",
    "own_etc",
    "parse_address",
    "read_config",
    "read_sections",
    "search_path",
    "split_list",
    "user_etc",
    "write_sections",
]
