"""The list of a vehicle's parameters for Neptus: `conf/params/<vehicle>.en_US.xml`, as DUNE writes it with -X."""

from xml.etree import ElementTree as Xml

from imc import builtin
from runtime.task import Parameter, Task
from runtime.vehicle import Vehicle

LANGUAGE = "en_US"


def parameter_list(vehicle: Vehicle) -> bytes:
    """The XML with the parameters of all tasks, by entity label; the value of each is its present one.

    An empty list has no element `default`: Neptus takes an empty one for a number that it cannot read, or for one item.
    """
    first, *others = vehicle.tasks
    version = f"IMC {builtin().version}"
    root = Xml.Element("config", format="1", version=version, modules="", system=vehicle.name, i18n=LANGUAGE)
    for task in [first, *sorted(others, key=lambda task: task.entity.label)]:
        label = task.entity.label
        section = Xml.SubElement(root, "section", {"name": label, "name-i18n": label})
        for parameter in task.parameter_set.declarations.values():
            _add(section, task, parameter)
    Xml.indent(root)
    return Xml.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _add(section: Xml.Element, task: Task, parameter: Parameter) -> None:
    attributes = {"name": parameter.name} | ({} if parameter.editable else {"editable": "false"})
    element = Xml.SubElement(section, "param", attributes)
    tags = {
        "name-i18n": parameter.name,
        "type": parameter.xml_type_name,
        "visibility": parameter.visibility,
        "scope": parameter.scope,
        "default": task.parameter_set.text(parameter),
        "units": parameter.unit if parameter.unit != "1" else "",
        "desc": parameter.description,
    }
    if parameter.xml_type_name.startswith("list:") and not tags["default"]:
        del tags["default"]
    low, high = parameter.minimum, parameter.maximum
    tags |= {"min": f"{low:g}"} if low is not None else {}
    tags |= {"max": f"{high:g}"} if high is not None else {}
    if parameter.size is not None:
        least, most = map(str, parameter.size)
        tags |= {"size": least} if least == most else {"min-size": least, "max-size": most}
    if parameter.choices:
        choices = ", ".join(map(str, parameter.choices))
        tags |= {"values": choices, "values-i18n": choices}
    for tag, text in tags.items():
        Xml.SubElement(element, tag).text = _clean(text)


def _clean(text: str) -> str:
    """A text without the characters that XML cannot have."""
    text = text.encode(errors="surrogateescape").decode(errors="replace")
    return "".join(c if c.isprintable() or c in "\t\n" else "\ufffd" for c in text)
