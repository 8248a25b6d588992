"""Every message of imcpy (DUNE's codec, IMC 5.4.30), in both directions, field by field."""

import gzip
import json
import math
from pathlib import Path
from typing import Any

import imcpy
import pytest

import imc

DATA = Path(__file__).parents[1] / "data" / "imc"
UNREADABLE = {
    ("Sample", "syringe0"),
    ("Sample", "syringe1"),
    ("Sample", "syringe2"),
    ("GetWorldCoordinates", "tracking"),
}
"""Boolean fields: imcpy 1.1.2 never registered their type."""


def packets(name: str) -> list[bytes]:
    with gzip.open(DATA / f"{name}.jsonl.gz", "rt", encoding="utf-8") as file:
        return [bytes.fromhex(json.loads(line)["hex"]) for line in file]


def same(ours: Any, theirs: Any) -> bool:
    """Whether a field of a message has the same value on both sides."""
    if isinstance(ours, imc.Message):
        return same_fields(ours, theirs)
    if isinstance(ours, tuple):
        others = list(theirs)
        return len(ours) == len(others) and all(map(same, ours, others))
    if isinstance(ours, float):
        return ours == theirs or (math.isnan(ours) and math.isnan(theirs))
    if isinstance(ours, bytes):
        return ours == bytes(theirs)
    if isinstance(ours, str):
        # imcpy decodes text as ASCII.
        return ours.encode("utf-8", "surrogateescape").decode("ascii", "replace") == theirs
    return ours is theirs is None or ours == int(theirs)


def same_fields(ours: imc.Message, theirs: Any) -> bool:
    name = type(ours).__name__
    return type(theirs).__name__ == name and all(
        same(getattr(ours, info.name), getattr(theirs, info.name))
        for info in imc.fields(type(ours))
        if (name, info.name) not in UNREADABLE
    )


@pytest.mark.parametrize("name", ["public", "defaults", "special_floats"])
def test_fields_and_bytes_agree(name: str) -> None:
    for packet in packets(name):
        if imc.header(packet).id == imc.EstimatedMugState.ID:
            continue
        ours = imc.decode(packet)
        theirs = imcpy.Packet.deserialize(imc.encode(ours))
        assert same_fields(ours, theirs), ours
        for field in ("timestamp", "src", "src_ent", "dst", "dst_ent"):
            assert getattr(ours, field) == getattr(theirs, field)
        assert imc.encode(imc.decode(imcpy.Packet.serialize(theirs))) == packet


def test_big_endian_packets_are_read() -> None:
    for packet in packets("public")[::5]:
        if imc.header(packet).id != imc.EstimatedMugState.ID:
            ours = imc.decode(packet)
            assert same_fields(ours, imcpy.Packet.deserialize(imc.encode(ours, "big")))


def test_ids_agree() -> None:
    names = [name for name in imc.builtin().types if hasattr(imcpy, name) and name != "EstimatedMugState"]
    assert len(names) == 337
    for name in names:
        assert imcpy.Factory.id_from_abbrev(name) == getattr(imc, name).ID
