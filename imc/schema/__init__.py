"""Definitions of messages: read from XML and YAML, written as XML, and turned into classes."""

from imc.schema.classes import definition_checksum
from imc.schema.definition import Enumeration, Field, Group, MessageType, Value
from imc.schema.field_info import FieldInfo
from imc.schema.files import builtin, builtin_xml_gz, fields, load, load_unless_builtin, message_named
from imc.schema.schema import Schema
from imc.schema.xml_writer import dump

__all__ = [
    "Enumeration",
    "Field",
    "FieldInfo",
    "Group",
    "MessageType",
    "Schema",
    "Value",
    "builtin",
    "builtin_xml_gz",
    "definition_checksum",
    "dump",
    "fields",
    "load",
    "load_unless_builtin",
    "message_named",
]
