"""A written IMC.xml has every attribute, id and reference that imcjava's parser looks up."""

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
    assert len({int(message.attrib["id"]) for message in messages}) == len(messages) == 349
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
    assert len(values) == 856  # as in the public definitions: 805 of fields, 51 of shared enumerations and bitfields
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
