"""Packets of DUNE's codec: each decodes to the stored values and encodes to the same bytes."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest

import imc

DATA = Path(__file__).parents[1] / "data" / "imc"
PUBLIC = imc.load(Path(imc.__file__).parent / "definitions" / "imc-5.4.31.yaml")
ROWS = {"public": 676, "defaults": 338, "bigendian": 338, "new_5_4_31": 44, "special_floats": 193, "edge": 23}


def rows(name: str) -> list[dict[str, Any]]:
    with gzip.open(DATA / f"{name}.jsonl.gz", "rt", encoding="utf-8") as file:
        return [json.loads(line) for line in file]


def build(row: dict[str, Any], schema: imc.Schema, **header: Any) -> imc.Message:
    """The message of a row, built with the constructor."""
    cls = schema[row["abbrev"]]
    stored = {name.lower(): value for name, value in row["fields"].items()}
    values: dict[str, Any] = {}
    for info in imc.fields(cls):
        value = stored.pop(info.name)
        if info.type == "message":
            value = None if value is None else build(value, schema)
        elif info.type == "message-list":
            value = [None if item is None else build(item, schema) for item in value]
        elif info.type == "rawdata":
            value = bytes.fromhex(value)
        elif info.type == "plaintext" and isinstance(value, dict):
            value = bytes.fromhex(value["bytes"]).decode("utf-8", "surrogateescape")
        elif info.type in ("fp32_t", "fp64_t"):
            value = float(value)
        values[info.name] = value
    assert not stored
    return cls(**header, **values)


def check(row: dict[str, Any], schema: imc.Schema) -> None:
    packet = bytes.fromhex(row["hex"])
    order = "big" if packet.startswith(b"\xfe\x54") else "little"
    built = build(row, schema, **row["header"])
    read = schema.decode(packet)
    assert type(read) is type(built)
    assert read.to_json() == built.to_json()
    assert imc.encode(built, order) == packet
    assert imc.encode(read, order) == packet


@pytest.mark.parametrize("name", ["public", "defaults", "bigendian", "new_5_4_31", "special_floats"])
def test_rows_under_the_public_schema(name: str) -> None:
    found = rows(name)
    assert len(found) == ROWS[name]
    for row in found:
        check(row, PUBLIC)


@pytest.mark.parametrize("name", ["public", "defaults", "bigendian", "new_5_4_31", "special_floats"])
def test_rows_under_the_built_in_schema(name: str) -> None:
    for row in rows(name):
        if row["abbrev"] != "GpioStateGet":
            check(row, imc.builtin())


@pytest.mark.parametrize("row", rows("edge"), ids=lambda row: row["case"])
def test_edge_case(row: dict[str, Any]) -> None:
    packet = bytes.fromhex(row["hex"])
    if row["case"] == "unknown_id":
        message = imc.decode(packet)
        assert isinstance(message, imc.Unknown)
        assert imc.encode(message) == packet
    elif row["expect"] == "error":
        with pytest.raises(imc.DecodeError) as caught:
            imc.decode(packet)
        assert caught.value.reason
    elif "fields" in row:
        check(row, imc.builtin())
    else:
        message = imc.decode(packet)
        assert type(message).__name__ == row["dune"]["ok"]
        assert imc.encode(message.replace(surplus=b"")).hex() == row["dune"]["reserialized"]


def test_surplus_of_a_payload_is_kept() -> None:
    (row,) = (row for row in rows("edge") if row["case"] == "payload_longer_than_fields")
    packet = bytes.fromhex(row["hex"])
    message = imc.decode(packet)
    assert message == imc.EntityState(state=1, description="ok", surplus=b"EXTRA").replace(
        **{name: getattr(message, name) for name in ("timestamp", "src", "src_ent", "dst", "dst_ent")}
    )
    assert imc.encode(message) == packet


def test_rows_return_from_json() -> None:
    for row in rows("public"):
        message = PUBLIC.decode(bytes.fromhex(row["hex"]))
        assert imc.from_json(message.to_json(), PUBLIC) == message
        assert imc.from_dict(message.to_dict(), PUBLIC) == message
