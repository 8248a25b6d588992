"""Meaning of the settings of a camera, as a camera definition file, from which QGroundControl makes its menus.

Source of the format: mavlink.io/en/services/camera_def.html.
"""

import math
from collections.abc import Iterable, Mapping
from xml.etree import ElementTree
from zlib import crc32

from mavlink.translate import cameras_from_imc
from mavlink.vehicle.parameters import INT32, REAL32, ExtendedParameter

TYPES: Mapping[int, str] = {INT32: "int32", REAL32: "float"}
TEXT = "custom"


def definition(label: str, parameters: Iterable[ExtendedParameter]) -> bytes:
    """The file of the camera with this label; the same settings give the same bytes."""
    described = ElementTree.Element("parameters")
    for setting in parameters:
        described.append(_parameter(setting))
    about = [("model", label), ("vendor", cameras_from_imc.VENDOR)]
    root = ElementTree.Element("mavlinkcamera")
    top = ElementTree.SubElement(root, "definition", version=str(_version(ElementTree.tostring(described))))
    for name, text in about:
        ElementTree.SubElement(top, name).text = text
    root.append(described)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)


def version_of(file: bytes) -> int:
    """The version in a definition file."""
    top = ElementTree.fromstring(file).find("definition")
    return int(top.get("version", "0")) if top is not None else 0


def _version(content: bytes) -> int:
    """A checksum from 1 to 65535: stations keep a file until its version is another one."""
    return crc32(content) % 0xFFFF + 1


def _parameter(setting: ExtendedParameter) -> ElementTree.Element:
    parameter = setting.declaration
    found = ElementTree.Element("parameter", name=setting.id, type=TYPES.get(setting.type, TEXT))
    found.set("default", _written(setting, parameter.default))
    for name, limit in (("min", parameter.minimum), ("max", parameter.maximum)):
        if limit is not None and math.isfinite(limit) and setting.type in TYPES:
            found.set(
                name, f"{limit:g}" if setting.type == REAL32 else str(math.ceil(limit) if name == "min" else int(limit))
            )
    unit = f" ({parameter.unit})" if parameter.unit not in ("", "1") else ""
    ElementTree.SubElement(found, "description").text = f"{parameter.name}{unit}: {parameter.description}"
    if options := _options(setting):
        listed = ElementTree.SubElement(found, "options")
        for name, value in options.items():
            ElementTree.SubElement(listed, "option", name=name, value=value)
    return found


def _options(setting: ExtendedParameter) -> Mapping[str, str]:
    """The values to choose from, by the name that people see."""
    parameter = setting.declaration
    if parameter.type is bool and not parameter.is_list:
        return {"false": "0", "true": "1"}
    if parameter.is_list:
        return {}
    return {str(choice): _written(setting, choice) for choice in parameter.choices}


def _written(setting: ExtendedParameter, value: object) -> str:
    if setting.type == INT32:
        return str(int(value)) if isinstance(value, int) else "0"
    return setting.declaration.format(value)
