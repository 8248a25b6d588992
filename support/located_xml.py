"""Reads XML into elements with line numbers; document types, and so entities, are rejected."""

import re
from collections.abc import Collection
from xml.parsers import expat

from support.diagnostics import LocatedError, Origin

_DEEPEST = 16
_MOST = 200_000  # elements


class Element:
    """An element of an XML file, and its place in the file. Methods raise the error class given to `parse_xml_tree`."""

    __slots__ = ("attributes", "children", "error", "file", "line", "tag", "text")

    def __init__(self, tag: str, attributes: dict[str, str], file: str, line: int, error: type[LocatedError]) -> None:
        self.tag: str = tag
        self.error: type[LocatedError] = error
        self.attributes: dict[str, str] = attributes
        self.children: list[Element] = []
        self.file: str = file
        self.line: int = line
        self.text: str = ""

    @property
    def where(self) -> str:
        return f"{self.file}:{self.line}"

    def get(self, name: str, default: str = "") -> str:
        return self.attributes.get(name, default)

    def require(self, name: str) -> str:
        """A required attribute. Raises an error if it is missing."""
        if name not in self.attributes:
            raise self.error(f"<{self.tag}> has no {name!r}", self.where)
        return self.attributes[name]

    @property
    def description_text(self) -> str:
        """The text of its first <description>, without markup."""
        return next((child.text for child in self.children if child.tag == "description"), "")

    def attribute_words(self, name: str) -> tuple[str, ...]:
        """The comma separated words of an attribute, in lower case."""
        return tuple(word for word in re.split(r"[,\s]+", self.get(name).lower()) if word)

    def descendants_at_path(self, *tags: str) -> "list[Element]":
        """The descendants along this path of tags."""
        found: list[Element] = [self]
        for tag in tags:
            found = [child for element in found for child in element.children if child.tag == tag]
        return found


def parse_xml_tree(
    data: bytes, file: str, error: type[LocatedError] = LocatedError, *, text_of: Collection[str] = ("description",)
) -> Element:
    """The root element of an XML text, with the texts of elements with the tags `text_of`.

    Tags keep their prefixes, as in kml:Point. Raises `error` naming file:line.
    """
    top = Element("", {}, file, 0, error)
    stack = [top]
    parser = expat.ParserCreate()
    parser.buffer_text = True
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(stack) > _DEEPEST:
            raise error("nested too deeply", Origin(file, parser.CurrentLineNumber))
        nonlocal count
        count += 1
        if count > _MOST:
            raise error(f"more than {_MOST} elements", Origin(file, parser.CurrentLineNumber))
        element = Element(tag, attributes, file, parser.CurrentLineNumber, error)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_: str) -> None:
        ended = stack.pop()
        if ended.tag not in text_of:
            stack[-1].text += ended.text

    def text(found: str) -> None:
        if any(element.tag in text_of for element in stack):
            stack[-1].text += found

    def refuse(*_: object) -> int:
        raise error("document types and entities are not accepted", Origin(file, parser.CurrentLineNumber))

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as wrong:
        raise error(f"not XML: {expat.ErrorString(wrong.code)}", Origin(file, wrong.lineno)) from wrong
    except (ValueError, LookupError) as wrong:  # an encoding that Python does not support
        if type(wrong) is error:
            raise
        raise error(f"not XML: {wrong}", Origin(file, 1)) from wrong
    return top.children[0]
