"""Definitions: built in, overlays, other schemas at run time, and to IMC.xml and back."""

import gzip
import subprocess
import sys
from pathlib import Path

import pytest

import imc
from imc.generate import main, messages_source
from imc.schema import load_unless_builtin
from imc.schema.files import builtin_from_yaml

PACKAGE = Path(imc.__file__).parent
PUBLIC = PACKAGE / "definitions" / "imc-5.4.31.yaml"
DUNE = Path(__file__).parents[2] / "data" / "imc" / "dune.IMC.xml.gz"

SMALL = """\
name: IMC
version: 5.4.31
enumerations:
  Colour: {name: Colour, prefix: C, values: {0: RED, 1: GREEN}}
groups:
  Toy: {name: Toy, members: [Ball]}
messages:
  Ball:
    id: 60001
    name: Ball
    flags: [periodic]
    fields:
      colour: {type: uint8_t, name: Colour, enum: Colour}
      Radius: {type: fp32_t, name: Radius, unit: m, min: 0, max: 1.5}
      class: {type: plaintext, name: Class}
      state: {type: uint8_t, name: State, bits: {0x01: FLAT, 0x02: 2TONE}}
  Box:
    id: 60002
    name: Box
    fields:
      toys: {type: message-list, name: Toys, message: Toy}
"""


def write(folder: Path, text: str, name: str = "own.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_generated_files_are_current() -> None:
    assert main(["--check"]) == 0
    assert (PACKAGE / "messages.py").read_text(encoding="utf-8") == messages_source(builtin_from_yaml())
    assert imc.builtin() == builtin_from_yaml()


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("name", "file", "old"), [("MESSAGES", "messages.py", "float"), ("MERGED", "merged.json", "rad")]
)
def test_check_notices_an_edited_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name, file, old) -> None:
    (current,) = PACKAGE.rglob(file)
    edited = tmp_path / file
    edited.write_text(current.read_text(encoding="utf-8").replace(old, "int", 1), encoding="utf-8")
    monkeypatch.setattr(f"imc.generate.{name}", edited)
    assert main(["--check"]) == 1
    assert main([]) == 0
    assert main(["--check"]) == 0
    assert edited.read_bytes() == current.read_bytes()


def test_definitions_that_are_the_built_in_ones_are_not_read_twice(tmp_path: Path) -> None:
    ours = imc.dump(imc.builtin())
    (tmp_path / "IMC.xml.gz").write_bytes(gzip.compress(ours))
    assert load_unless_builtin(tmp_path / "IMC.xml.gz") is imc.builtin()
    assert imc.load(tmp_path / "IMC.xml.gz") == imc.builtin()
    (tmp_path / "IMC.xml").write_bytes(ours.replace(b'unit="rad"', b'unit="mrad"', 1))
    assert load_unless_builtin(tmp_path / "IMC.xml") != imc.builtin()


def test_built_in_schema() -> None:
    schema = imc.builtin()
    assert schema is imc.builtin()
    assert (schema.name, schema.version, len(schema.messages)) == ("IMC", "5.4.31", 350)
    assert schema["EstimatedState"] is imc.EstimatedState
    assert schema.by_id(350) is imc.EstimatedState
    assert "GpioStateGet" not in schema
    for id in (-1, 65535):
        with pytest.raises(KeyError):
            schema.by_id(id)


@pytest.mark.parametrize("path", [None, PUBLIC, DUNE], ids=["built-in", "public", "DUNE"])
def test_schema_returns_from_xml(path: Path | None, tmp_path: Path) -> None:
    schema = imc.load(path) if path else imc.builtin()
    text = imc.dump(schema)
    for name, data in (("IMC.xml", text), ("IMC.xml.gz", gzip.compress(text))):
        (tmp_path / name).write_bytes(data)
        again = imc.load(tmp_path / name)
        assert again == schema
        assert imc.dump(again) == text


def test_dune_schema_is_apart_from_the_built_in_one() -> None:
    dune = imc.load(DUNE)
    assert len(dune.messages) == 350
    message = dune["GpioStateGet"](name="led")
    packet = dune.encode(message)
    assert dune.decode(packet) == message
    assert imc.header(packet).id == imc.EstimatedMugState.ID
    with pytest.raises(imc.DecodeError):
        imc.decode(packet)
    assert dune["EstimatedState"] is not imc.EstimatedState
    assert dune["EstimatedState"].__struct_fields__ == imc.EstimatedState.__struct_fields__


def test_own_schema(tmp_path: Path) -> None:
    schema = imc.load(write(tmp_path, SMALL))
    ball = schema["Ball"](colour=1, radius=0.5, class_="soft")
    box = schema["Box"](toys=[ball, None])
    assert schema.decode(schema.encode(box)) == box
    assert schema.decode(schema.encode(box, "big")) == box
    colour, radius, kind, state = imc.fields(schema["Ball"])
    assert [info.name for info in (colour, radius, kind, state)] == ["colour", "radius", "class_", "state"]
    assert colour.enum is not None
    assert colour.enum["GREEN"] == 1
    assert state.enum is not None
    assert state.enum(3) == state.enum["FLAT"] | state.enum["_2TONE"]
    assert radius[1:5] == ("fp32_t", "m", 0, 1.5)
    assert imc.fields(schema["Box"])[0].messages == {"Ball"}
    assert isinstance(imc.decode(schema.encode(box)), imc.Unknown)
    write(tmp_path, imc.dump(schema).decode(), "own.xml")
    assert imc.load(tmp_path / "own.xml") == schema


def test_other_synchronization_number(tmp_path: Path) -> None:
    schema = imc.load(write(tmp_path, "sync: 0xFE55\n" + SMALL))
    packet = schema.encode(schema["Ball"]())
    assert packet.startswith(b"\x55\xfe")
    assert schema.decode(packet) == schema["Ball"]()
    with pytest.raises(imc.DecodeError, match="synchronization number 0xfe55 instead of 0xfe54"):
        imc.decode(packet)


def test_overlay_adds_and_replaces(tmp_path: Path) -> None:
    own = SMALL.replace("60002", "263").replace("name: Box\n", "name: Box\n    replaces: Temperature\n")
    merged = imc.load(write(tmp_path, own), over=imc.builtin())
    assert len(merged.messages) == 351
    assert merged.by_id(263).__name__ == "Box"
    assert "Temperature" not in merged
    assert imc.builtin().by_id(263) is imc.Temperature
    with pytest.raises(imc.SchemaError, match=r"^ExternalNavData.state: EstimatedState is not defined"):
        imc.load(
            write(tmp_path, own.replace("Temperature", "EstimatedState").replace("263", "350")), over=imc.builtin()
        )


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("60001", "350", r"own.yaml:8: Ball \(id 350\) collides with EstimatedState \(id 350\)"),
        ("  Ball:", "  Goto:", r"own.yaml:8: Goto \(id 60001\) collides with Goto \(id 450\)"),
        ("name: Box\n", "name: Box\n    replaces: Bow\n", "own.yaml:17: Box replaces Bow, which is not defined"),
        ("Colour: {name", "ZUnits: {name", "ZUnits is already defined differently"),
    ],
)
def test_overlay_that_collides(tmp_path: Path, old: str, new: str, text: str) -> None:
    with pytest.raises(imc.SchemaError, match=text):
        imc.load(write(tmp_path, SMALL.replace(old, new, 1)), over=imc.builtin())


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("60002", "60001", "own.yaml:17: Box and Ball have the same id 60001"),
        ("60002", "65535", "own.yaml:17: Box: id 65535 is not within"),
        ("60002", "many", "own.yaml:18: 'many' is not a number"),
        ("  Box:", "  Ball:", "own.yaml:17: 'Ball' occurs twice"),
        ("fp32_t", "fp16_t", "own.yaml:14: Ball.Radius: unknown type 'fp16_t'"),
        ("type: fp32_t, ", "", "own.yaml:14: 'type' is missing"),
        ("    id: 60002\n", "", "own.yaml:17: 'id' is missing"),
        ("unit: m", "units: m", "own.yaml:14: unknown key 'units'"),
        ("max: 1.5", "max: nan", "own.yaml:14: 'nan' is not a number"),
        ("Radius:", "Colour:", "own.yaml:14: field Ball.Colour is defined twice"),
        ("Radius:", "a-b:", "own.yaml:14: 'a-b' cannot name a field of Ball"),
        ("Radius:", "__class__:", "own.yaml:14: '__class__' cannot name"),
        ("  Box:", '  "Box(x)":', "own.yaml:17: 'Box.x.' cannot name a message"),
        ("enum: Colour", "enum: Color", "own.yaml:13: Ball.colour: Color is not defined"),
        ("message: Toy", "message: Tool", "own.yaml:21: Box.toys: Tool is not defined"),
        ("0x02: 2TONE", "0x02: FLAT", "own.yaml:16: Ball.state: value FLAT is defined twice"),
        ("version: 5.4.31\n", "", "own.yaml:1: 'version' is missing"),
        ("    flags: [periodic]", "    flags: periodic", "own.yaml:11: expected a list"),
        ("name: IMC", "name: [IMC", "own.yaml:2: not YAML"),
        ("name: IMC", "name: &a IMC", "own.yaml:1: anchors and aliases"),
        ("name: IMC", "--- {}\n---\nname: IMC", "own.yaml:1: expected one YAML document"),
        ("name: IMC", "? [a, b]\n: c", "own.yaml:1: expected text"),
        ("name: IMC", "name: " + "[" * 5000, "own.yaml:1: nested too deeply"),
    ],
)
def test_wrong_definitions_are_named(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert old in SMALL
    with pytest.raises(imc.SchemaError, match=text):
        imc.load(write(tmp_path, SMALL.replace(old, new, 1)))


def test_import_reads_no_definitions() -> None:
    code = "import sys, imc; sys.exit(any(name in sys.modules for name in ('yaml', 'numpy', 'xml.parsers.expat')))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
