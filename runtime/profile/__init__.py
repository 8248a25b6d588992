"""Profiles: ini files read into values with file and line."""

from runtime.profile import dune_section_names
from runtime.profile.config import Config, Option, Section, format_option, format_sections, split_list
from runtime.profile.consoles import listed_consoles
from runtime.profile.dune_section_names import EVERY_TASK
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
    parse_imc_id,
)
from runtime.profile.profile_search import (
    available_profiles,
    find_profile,
    is_file,
    own_etc,
    resolve_root_copy,
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
    "default_label",
    "derived_id",
    "dune_section_names",
    "find_profile",
    "format_option",
    "format_sections",
    "is_file",
    "listed_consoles",
    "load_profile",
    "own_etc",
    "parse_imc_id",
    "read_config",
    "read_sections",
    "resolve_root_copy",
    "search_path",
    "split_list",
    "user_etc",
    "write_sections",
]
