"""A written IMC.xml has every attribute, id and reference that imcjava's parser looks up."""

from pathlib import Path
from xml.etree import ElementTree

import imc

ROOT = ElementTree.fromstring(imc.dump(imc.builtin()))
FIELDS = ROOT.findall("header/field") + ROOT.findall("footer/field") + ROOT.findall("message/field")


def test_name_version_and_sync_are_where_they_are_looked_for() -> None:
    assert (ROOT.tag, ROOT.get("name"), ROOT.get("version")) == ("messages", "IMC", "5.4.31")
    (sync,) = ROOT.findall("header/field[@abbrev='sync']")
    assert int(sync.attrib["value"].replace("0x", ""), 16) == 0xFE54


def test_every_message_and_field_has_what_is_read_of_it() -> None:
    messages = ROOT.findall("message")
    assert len({int(message.attrib["id"]) for message in messages}) == len(messages) == 350
    assert all(message.get("abbrev") and message.get("name") for message in messages)
    types = {kind.get("name") for kind in ROOT.findall("types/type")}
    for field in FIELDS:
        assert field.attrib["abbrev"]
        assert "name" in field.attrib
        assert field.attrib["type"] in types
        for limit in {"min", "max"} & set(field.attrib):
            if "int" in field.attrib["type"]:  # parsed as a long
                int(field.attrib[limit], 16 if "x" in field.attrib[limit] else 10)
            else:
                float(field.attrib[limit])


def test_every_value_is_a_number_with_a_name() -> None:
    values = ROOT.findall(".//value")
    assert len(values) == 858  # 805 of public fields, 51 of shared enumerations and bitfields, 2 of our own messages
    for value in values:
        int(value.attrib["id"], 16 if "x" in value.attrib["id"] else 10)
        assert value.attrib["abbrev"]


def test_every_reference_has_its_definition() -> None:
    messages = {message.get("abbrev") for message in ROOT.findall("message")}
    groups = {group.get("abbrev") for group in ROOT.findall("message-groups/message-group")}
    assert {kind.get("abbrev") for kind in ROOT.findall("message-groups/message-group/message-type")} <= messages
    for field in FIELDS:
        assert field.get("message-type") in {None, *messages, *groups}
        for attribute, section in (("enum-def", "enumerations"), ("bitfield-def", "bitfields")):
            assert field.get(attribute) in {None, *(d.get("abbrev") for d in ROOT.findall(f"{section}/def"))}


DESCRIBED = b"""<messages name="IMC" version="5"><description>All &lt;of&gt; it</description>
<units><unit abbrev="m" name="meter"><description>Length</description></unit></units>
<enumerations><def name="Side" abbrev="Side" prefix="SD"><description>Which side</description>
<value id="0" name="Port" abbrev="PORT"><description>Left
  "bow ahead" &amp; so on</description></value></def></enumerations>
<bitfields><def name="Flags" abbrev="Flags" prefix="FL"><value id="1" name="A" abbrev="A"><description>Bit</description>
</value></def></bitfields>
<message-groups><message-group name="G" abbrev="G"><description>Some</description><message-type abbrev="Ping"/>
</message-group></message-groups>
<flags><flag abbrev="periodic" name="Periodic"><description>Again</description></flag></flags>
<categories><category name="Core"><description>Basic</description></category></categories>
<message id="1" name="Ping" abbrev="Ping"><description>Asks <b><i>who</i></b> is there.</description>
<field name="Kind" abbrev="kind" type="uint8_t" unit="Enumerated" prefix="K"><description>Of what</description>
<value id="0" name="Zero" abbrev="ZERO"><description>Of nothing</description></value></field></message></messages>"""


def test_descriptions_survive(tmp_path: Path) -> None:
    (tmp_path / "IMC.xml").write_bytes(DESCRIBED)
    schema = imc.load(tmp_path / "IMC.xml")
    (tmp_path / "again.xml").write_bytes(imc.dump(schema))
    again = imc.load(tmp_path / "again.xml")
    assert again == schema
    assert again.descriptions == schema.descriptions
    assert again.descriptions == {
        (): "All <of> it",
        ("units", "m"): "Length",
        ("enumerations", "Side"): "Which side",
        ("enumerations", "Side", "PORT"): 'Left\n  "bow ahead" & so on',
        ("bitfields", "Flags", "A"): "Bit",
        ("groups", "G"): "Some",
        ("flags", "periodic"): "Again",
        ("categories", "Core"): "Basic",
        ("messages", "Ping"): "Asks who is there.",
        ("messages", "Ping", "kind"): "Of what",
        ("messages", "Ping", "kind", "ZERO"): "Of nothing",
    }


def test_descriptions_of_an_overlay_are_added(tmp_path: Path) -> None:
    text = """
name: Own
version: "1"
messages:
  Salt:
    id: 2900
    name: Salt
    description: What the probe says.
    fields:
      value: {type: fp32_t, name: Value, unit: psu, description: Salinity.}
"""
    (tmp_path / "own.yaml").write_text(text)
    (tmp_path / "IMC.xml").write_bytes(DESCRIBED)
    merged = imc.load(tmp_path / "own.yaml", over=imc.load(tmp_path / "IMC.xml"))
    (tmp_path / "merged.xml").write_bytes(imc.dump(merged))
    found = imc.load(tmp_path / "merged.xml").descriptions
    assert found["messages", "Salt"] == "What the probe says."
    assert found["messages", "Salt", "value"] == "Salinity."
    assert found["messages", "Ping", "kind"] == "Of what"
