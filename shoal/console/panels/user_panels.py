"""Panels that a user describes in a file: values, plots, and buttons that send a message."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import imc
from support.diagnostics import LocatedError
from support.located_yaml import Node, parse_yaml_tree, read_text
from support.regular_files import check_regular_file
from support.terminal_text import printable, with_suggestion

MOST_PANELS, MOST_BUTTONS = 20, 20
MOST_VALUES = 24  # of all panels: a page draws so many beside its plots
MOST_PLOTS = 8
LONGEST = 60  # characters of a name
PRESS, PRESS_OF_MAINTAINER = "press", "press-maintain"
"""Orders of the page that send the message of a button."""
MAINTAINING = (
    "PopEntityParameters",
    "PowerOperation",
    "PushEntityParameters",
    "RestartSystem",
    "SaveEntityParameters",
    "SetEntityParameters",
)
"""Messages that only a user with the role *maintain* sends."""
NUMBERS = ("fp", "int", "uint")


class PanelFileError(LocatedError):
    """A file of panels that cannot be read; the text names file and line."""


@dataclass(frozen=True)
class PanelValue:
    """A field, as Message.field or Message.field:entity, with the name and the digits that are shown."""

    label: str
    field: str
    unit: str
    digits: int


@dataclass(frozen=True)
class PanelButton:
    """A button that sends a message by the order `order`."""

    label: str
    message: imc.Message

    @property
    def order(self) -> str:
        return PRESS_OF_MAINTAINER if type(self.message).__name__ in MAINTAINING else PRESS


@dataclass(frozen=True)
class UserPanel:
    """A panel, of one vehicle or, with an empty name, of each."""

    title: str
    vehicle: str
    values: tuple[PanelValue, ...]
    plots: tuple[str, ...]
    buttons: tuple[PanelButton, ...]

    def view(self) -> dict[str, Any]:
        """The page's data."""
        return {
            "title": printable(self.title),
            "vehicle": self.vehicle,
            "values": [vars(value) for value in self.values],
            "plots": self.plots,
            "buttons": [{"label": printable(each.label), "order": each.order} for each in self.buttons],
        }


def read_panels(path: Path, schema: imc.Schema | None = None) -> tuple[UserPanel, ...]:
    """The panels of a YAML file. Raises PanelFileError, which names the line; OSError."""
    schema = schema or imc.builtin()
    check_regular_file(path)  # a vehicle must not wait for a pipe
    text = read_text(path, PanelFileError)
    root = parse_yaml_tree(text, str(path), PanelFileError).mapping("panels", required=("panels",))
    nodes = _few(root["panels"], MOST_PANELS)
    panels = tuple(_panel(node, schema) for node in nodes)
    for number, panel in enumerate(panels):
        if panel.title in [each.title for each in panels[:number]]:
            nodes[number].fail(f"there is a panel {panel.title!r} already")
    if sum(len(panel.values) for panel in panels) > MOST_VALUES:
        root["panels"].fail(f"at most {MOST_VALUES} values are shown in all panels")
    return panels


def find_button(panels: tuple[UserPanel, ...], words: Mapping[str, object]) -> PanelButton | None:
    """The button of an order of the page; None if there is none for this order and vehicle."""
    for panel in panels:
        if panel.title == words.get("panel") and panel.vehicle in ("", words.get("vehicle")):
            for button in panel.buttons:
                if (button.label, button.order) == (words.get("button"), words.get("order")):
                    return button
    return None


def _panel(node: Node, schema: imc.Schema) -> UserPanel:
    parts = node.mapping("title", "vehicle", "values", "plots", "buttons", required=("title",))
    buttons = tuple(_button(each, schema) for each in _few(parts.get("buttons"), MOST_BUTTONS))
    labels = [button.label for button in buttons]
    if len(set(labels)) < len(labels):
        parts["buttons"].fail("two buttons have one label")
    plots = _few(parts.get("plots"), MOST_PLOTS)
    for each in plots:
        _unit(each, schema)
    return UserPanel(
        _name(parts["title"]),
        parts["vehicle"].text() if "vehicle" in parts else "",
        tuple(_value(each, schema) for each in _few(parts.get("values"), MOST_VALUES)),
        tuple(each.text() for each in plots),
        buttons,
    )


def _value(node: Node, schema: imc.Schema) -> PanelValue:
    parts = node.mapping("label", "field", "digits", required=("field",))
    unit, field = _unit(parts["field"], schema), parts["field"].text()
    digits = parts["digits"].integer() if "digits" in parts else 2
    if not 0 <= digits <= 9:
        parts["digits"].fail("digits are 0 to 9")
    return PanelValue(_name(parts["label"]) if "label" in parts else field, field, unit, digits)


def _unit(node: Node, schema: imc.Schema) -> str:
    """The unit of a field that can be drawn."""
    name, _, rest = node.text().partition(".")
    field = rest.partition(":")[0]
    if name not in schema.types:
        node.fail(with_suggestion(f"there is no message {name!r}", name, schema.types))
    infos = {info.name: info for info in schema.fields(schema[name]) if info.type.startswith(NUMBERS)}
    if field not in infos:
        node.fail(with_suggestion(f"{name} has no number {field!r}", field, infos))
    return infos[field].unit


def _button(node: Node, schema: imc.Schema) -> PanelButton:
    parts = node.mapping("label", "message", required=("label", "message"))
    parts["message"].mapping(required=("abbrev",))
    try:
        message = imc.from_dict(parts["message"].value(), schema)
        imc.encode(message)
    except (imc.DecodeError, imc.EncodeError) as error:
        parts["message"].fail(str(error))
    return PanelButton(_name(parts["label"]), message)


def _name(node: Node) -> str:
    text = node.text().strip()
    if not text or len(text) > LONGEST:
        node.fail(f"a name has 1 to {LONGEST} characters")
    return text


def _few(node: Node | None, most: int) -> list[Node]:
    found = [] if node is None else node.items()
    if node is not None and len(found) > most:
        node.fail(f"at most {most} are allowed, not {len(found)}")
    return found
