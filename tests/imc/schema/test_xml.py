"""A damaged, hostile or incomplete IMC.xml is refused with file and line."""

import gzip
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc

XML = """\
<?xml version="1.0" encoding="UTF-8"?>
<messages name="IMC" version="5.4.31">
  <enumerations><def name="Colour" abbrev="Colour"><value id="0" name="Red" abbrev="RED"/></def></enumerations>
  <header>
    <field name="Sync" abbrev="sync" type="uint16_t" value="0xFE54"/><field name="Id" abbrev="mgid" type="uint16_t"/>
    <field name="Size" abbrev="size" type="uint16_t"/><field name="Time" abbrev="timestamp" type="fp64_t"/>
    <field name="Src" abbrev="src" type="uint16_t"/><field name="Ent" abbrev="src_ent" type="uint8_t"/>
    <field name="Dst" abbrev="dst" type="uint16_t"/><field name="Ent" abbrev="dst_ent" type="uint8_t"/>
  </header>
  <message id="7" name="Ball" abbrev="Ball" flags="periodic, deprecated" source="Vehicle">
    <description>A toy.</description>
    <field name="Colour" abbrev="colour" type="uint8_t" unit="Enumerated" enum-def="Colour"/>
    <field name="Size" abbrev="size" type="fp32_t" min="-1" max="2.5" value="0x10"><value id="1" abbrev="ONE"/></field>
  </message>
</messages>
"""


def load(folder: Path, text: str | bytes) -> imc.Schema:
    path = folder / "IMC.xml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return imc.load(path)


def test_forms_that_occur_are_understood(tmp_path: Path) -> None:
    schema = load(tmp_path, XML)
    ball = schema.types["Ball"]
    assert (ball.flags, ball.source, schema.long_name) == (("periodic", "deprecated"), ("vehicle",), "IMC")
    assert ball.fields[1].default == 16
    assert ball.fields[1].values[0].name == "ONE"
    assert schema.decode(schema.encode(schema["Ball"](colour=1))) == schema["Ball"](colour=1)
    assert load(tmp_path, XML.replace("UTF-8", "UTF-16").encode("utf-16")) == schema
    assert load(tmp_path, b"\xef\xbb\xbf" + XML.encode()) == schema


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("<messages n", "<!DOCTYPE m SYSTEM 'file:///etc/passwd'>\n<messages n", ":2: document types and entities"),
        ("<messages n", "<!DOCTYPE m [<!ENTITY a 'aa'>]>\n<messages n", ":2: document types and entities"),
        ("UTF-8", "shift_jis", ":1: not XML"),
        ("UTF-8", "klingon", ":1: not XML"),
        ("A toy.", "&a;", ":11: not XML: "),
        ("</messages>", "", ":16: not XML: "),
        ("</message>", "</field>", ":14: not XML: "),
        ("<messages name", "<schema name", ":15: not XML: "),
        (' version="5', ' revision="5', ":2: <messages> has no 'version'"),
        ('id="7" ', "", ":10: <message> has no 'id'"),
        ('id="7"', 'id="seven"', ":10: 'seven' is not a number"),
        ('id="7"', 'id="7.5"', ":10: 'id' of <message> is not an integer"),
        ('abbrev="size" type="fp32_t"', 'type="fp32_t"', ":13: <field> has no 'abbrev'"),
        ('"fp32_t"', '"fp16_t"', ":13: Ball.size: unknown type 'fp16_t'"),
        ('abbrev="colour" type', 'abbrev="co lour" type', ":12: 'co lour' cannot name a field of Ball"),
        ('abbrev="Ball"', 'abbrev="Ball:\\nimport os"', ":10: 'Ball:"),
        ('abbrev="colour" type', 'abbrev="size" type', ":13: field Ball.size is defined twice"),
        ('enum-def="Colour"', 'enum-def="Color"', ":12: Ball.colour: Color is not defined"),
        ('max="2.5"', 'max="much"', ":13: 'much' is not a number"),
        ('abbrev="mgid" type="uint16_t"', 'abbrev="mgid" type="uint32_t"', ":4: the header differs from that of IMC 5"),
        ("<description>", "<a>" * 20, ":11: nested too deeply"),
    ],
)
def test_wrong_xml_is_named(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in XML
    with pytest.raises(imc.SchemaError, match=re.escape(f"IMC.xml{text}")):
        load(tmp_path, XML.replace(old, new, 1))


def test_two_messages_with_one_id(tmp_path: Path) -> None:
    message = '<message id="7" name="Box" abbrev="Box"/>'
    with pytest.raises(imc.SchemaError, match=r"IMC.xml:15: Box and Ball have the same id 7"):
        load(tmp_path, XML.replace("</messages>", message + "</messages>"))
    with pytest.raises(imc.SchemaError, match="Ball is defined twice"):
        load(tmp_path, XML.replace("</messages>", message.replace("Box", "Ball").replace("7", "8") + "</messages>"))


def test_other_root_element(tmp_path: Path) -> None:
    with pytest.raises(imc.SchemaError, match=r"IMC.xml:1: expected <messages>, not <svg>"):
        load(tmp_path, "<svg/>")


def test_sizes_are_bounded(tmp_path: Path) -> None:
    with pytest.raises(imc.SchemaError, match="more than 4194304 bytes"):
        load(tmp_path, gzip.compress(b" " * (1 << 25)))
    with pytest.raises(imc.SchemaError, match="more than 4194304 bytes"):
        load(tmp_path, b" " * ((1 << 22) + 1))


@pytest.mark.parametrize("cut", [5, 30, -9, -1])
def test_damaged_gzip(tmp_path: Path, cut: int) -> None:
    with pytest.raises(imc.SchemaError, match="compressed data is damaged"):
        load(tmp_path, gzip.compress(XML.encode())[:cut])


def test_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        imc.load(tmp_path / "IMC.xml")


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, len(XML) - 1), st.integers(0, 40), st.binary(max_size=8))
def test_any_damage_is_a_schema_error_or_nothing(tmp_path: Path, start: int, length: int, new: bytes) -> None:
    data = XML.encode()
    try:
        schema = load(tmp_path, data[:start] + new + data[start + length :])
    except imc.SchemaError:
        return
    for message in schema.messages:
        assert schema.decode(schema.encode(schema[message.abbrev]()))


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=200))
def test_any_bytes_are_a_schema_error(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(imc.SchemaError):
        load(tmp_path, data)
