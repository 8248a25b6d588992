"""Logs as Parquet, CSV and LLF, read by other software."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import imc
from runtime.logs import summarize
from shoal.logs.export import LogSource
from shoal.logs.export.csv import export_csv
from shoal.logs.export.llf import export_llf, java_number
from shoal.logs.export.parquet import export_parquet
from shoal.logs.selection import PacketSelection

LOGS = Path(__file__).parents[3] / "data" / "logs"
HEADER = {"timestamp": 1.7e9, "src": 0x1A, "src_ent": 7, "dst": 0x1E, "dst_ent": 9}
ODD = [
    imc.LogBookEntry(type=2, text='tab\tline\r\nquote" comma, ñ', context="\udcff", **HEADER),
    imc.LogBookEntry(text="", **{**HEADER, "timestamp": -1.0}),
    imc.DevDataBinary(value=b"\x00\xfe\n", **HEADER),
    imc.PlanControl(arg=imc.Goto(lat=0.5, custom="a=1"), **HEADER),
    imc.PlanControl(arg=None, **HEADER),
    imc.Distance(location=(imc.DeviceState(x=1.0), None), value=0.1, **HEADER),
    imc.Rpm(value=-5, **HEADER),
    imc.Rpm(value=6, **HEADER),
    imc.Temperature(value=math.nan, **HEADER),
    imc.Temperature(value=0.1, **HEADER),
]


def source_of(log, *types):
    opened = imc.Log(log)
    return LogSource(opened, summarize(opened), PacketSelection(types=frozenset(types) or None))


@pytest.fixture
def odd(make_log):
    """A log with values that are hard to write as text; one message is big-endian."""
    return source_of(make_log([imc.encode(message, "big" if message is ODD[7] else "little") for message in ODD]))


def test_parquet_has_all_messages_of_a_log_of_dune(tmp_path):
    source = source_of(LOGS / "dune-idle")
    assert export_parquet(source, tmp_path) == 6647
    files = {path.stem: pq.ParquetFile(path) for path in tmp_path.glob("*.parquet")}
    assert {name: file.metadata.num_rows for name, file in files.items()} == source.log.counts()
    table = files["EstimatedState"].read()
    states = list(source.log.messages("EstimatedState"))
    for name in imc.EstimatedState.__struct_fields__[:-1]:
        assert table[name].to_pylist() == [getattr(state, name) for state in states], name
    assert table["system"].to_pylist() == ["lauv-noptilus-1"] * 100
    assert set(table["label"].to_pylist()) == {"Navigation"}
    stamps = table["utc"].to_numpy().astype("datetime64[us]").astype(float) / 1e6
    assert stamps == pytest.approx([state.timestamp for state in states], abs=1e-6)


def test_parquet_fields_say_units_and_enumerations(odd, tmp_path):
    export_parquet(odd, tmp_path)
    schema = pq.read_schema(tmp_path / "Temperature.parquet")
    assert schema.field("value").metadata[b"unit"] == "°C".encode()
    assert schema.field("timestamp").metadata[b"unit"] == b"s"
    assert schema.metadata[b"message"] == b"Temperature"
    kinds = json.loads(pq.read_schema(tmp_path / "LogBookEntry.parquet").field("type").metadata[b"enum"])
    assert kinds["2"] == "ERROR"


def test_parquet_holds_what_is_hard_to_write(odd, tmp_path):
    assert export_parquet(odd, tmp_path) == len(ODD)
    rows = {path.stem: pq.read_table(path).to_pylist() for path in tmp_path.glob("*.parquet")}
    assert [row["text"] for row in rows["LogBookEntry"]] == [ODD[0].text, ""]
    assert rows["LogBookEntry"][0]["context"] == "\\udcff"
    assert rows["LogBookEntry"][1]["utc"] is None
    assert rows["DevDataBinary"][0]["value"] == b"\x00\xfe\n"
    assert [row["value"] for row in rows["Rpm"]] == [-5, 6]
    plan = json.loads(rows["PlanControl"][0]["arg"])
    assert (plan["abbrev"], plan["lat"], "timestamp" in plan) == ("Goto", 0.5, False)
    assert rows["PlanControl"][1]["arg"] == "null"
    assert json.loads(rows["Distance"][0]["location"])[1] is None
    assert math.isnan(rows["Temperature"][0]["value"])
    assert rows["Temperature"][1]["value"] == np.float32(0.1)


def test_a_parquet_file_is_written_in_pieces(make_log, tmp_path, monkeypatch):
    monkeypatch.setattr("shoal.logs.export.parquet.ROWS", 100)
    monkeypatch.setattr("imc.lsf.scanner.PIECE", 600)
    monkeypatch.setattr("shoal.logs.export.message_batches.BATCH_BYTES", 1200)
    source = source_of(make_log([imc.Rpm(value=number, **HEADER) for number in range(1000)]))
    (tmp_path / "out").mkdir()
    export_parquet(source, tmp_path / "out")
    file = pq.ParquetFile(tmp_path / "out" / "Rpm.parquet")
    assert file.metadata.num_row_groups == 10
    assert file.read()["value"].to_pylist() == list(range(1000))


def test_fields_with_the_names_of_our_columns_keep_both(make_log, tmp_path):
    export_parquet(source_of(make_log([imc.FollowSystem(system=5, **HEADER)])), tmp_path)
    (row,) = pq.read_table(tmp_path / "FollowSystem.parquet").to_pylist()
    assert (row["system"], row["field_system"]) == ("lauv-noptilus-1", 5)


def read_csv(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_csv_numbers_are_those_of_the_log(tmp_path):
    source = source_of(LOGS / "dune-idle", imc.EstimatedState.ID, imc.EntityState.ID)
    assert export_csv(source, tmp_path) == 389
    rows, states = read_csv(tmp_path / "EstimatedState.csv"), list(source.log.messages("EstimatedState"))
    assert len(rows) == len(states)
    for row, state in zip(rows, states, strict=True):
        assert float(row["lat (rad)"]) == state.lat
        assert np.float32(row["u (m/s)"]) == np.float32(state.u)
        assert float(row["timestamp (s)"]) == state.timestamp
        assert (row["system"], row["label"], row["src"]) == ("lauv-noptilus-1", "Navigation", str(state.src))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["EntityState.csv", "EstimatedState.csv"]


def test_csv_quotes_what_is_hard_to_write(odd, tmp_path):
    assert export_csv(odd, tmp_path) == len(ODD)
    first, second = read_csv(tmp_path / "LogBookEntry.csv")
    assert (first["text"], first["context"], first["type"]) == (ODD[0].text, "\\udcff", "2")
    assert (first["utc"], second["utc"]) == ("2023-11-14T22:13:20.000000Z", "")
    assert read_csv(tmp_path / "DevDataBinary.csv")[0]["value"] == "00fe0a"
    assert [row["value (rpm)"] for row in read_csv(tmp_path / "Rpm.csv")] == ["-5", "6"]
    assert [row["value (°C)"] for row in read_csv(tmp_path / "Temperature.csv")] == ["nan", "0.1"]
    assert json.loads(read_csv(tmp_path / "PlanControl.csv")[0]["arg"])["custom"] == "a=1"


def read_llf(path):
    """Head values by name, names of columns, rows."""
    lines = path.read_bytes().decode().split("\r\n")
    assert lines.pop() == ""
    head = [line for line in lines if line.startswith("#")]
    names, *rows = (line.split("\t") for line in lines[len(head) :])
    values = dict(line[1:].split(": ", 1) for line in head[1:])
    assert head[0] == "#LLF1"
    assert len(values["types"].split("\t")) == len(names)
    return values, names, [dict(zip(names, row, strict=True)) for row in rows]


def test_llf_numbers_are_those_of_the_log(tmp_path):
    source = source_of(LOGS / "dune-idle")
    assert export_llf(source, tmp_path) == 6647
    head, names, rows = read_llf(tmp_path / "EstimatedState.llf")
    assert (head["name"], head["standard"], head["version"]) == ("EstimatedState", "IMC", source.schema.version)
    assert names[:7] == ["timestamp", "src", "src_ent", "dst", "dst_ent", "lat", "lon"]
    for row, state in zip(rows, source.log.messages("EstimatedState"), strict=True):
        assert float(row["timestamp"]) == state.timestamp - float(head["startTime"])
        assert float(row["lat"]) == state.lat
        assert np.float32(row["u"]) == np.float32(state.u)
        assert row["src"] == str(state.src)
    found = {path.stem: len(read_llf(path)[2]) for path in tmp_path.iterdir()}
    assert found == source.log.counts()


def test_llf_writes_what_is_hard_to_write_as_imcjava_does(odd, tmp_path):
    export_llf(odd, tmp_path)
    assert read_llf(tmp_path / "LogBookEntry.llf")[2][0]["text"] == 'tab line  quote" comma, ñ'
    assert read_llf(tmp_path / "DevDataBinary.llf")[2][0]["value"] == "00FE0A"
    assert [row["arg"] for row in read_llf(tmp_path / "PlanControl.llf")[2]] == ["%INLINE{Goto}", "null"]
    assert read_llf(tmp_path / "Distance.llf")[2][0]["location"] == "%MESSAGE-LIST[DeviceState, null]"
    assert [row["value"] for row in read_llf(tmp_path / "Temperature.llf")[2]] == ["NaN", "0.1"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.0, "1.0"),
        (-0.0, "-0.0"),
        (0.001, "0.001"),
        (0.00099, "9.9E-4"),
        (9999999.0, "9999999.0"),
        (1e7, "1.0E7"),
        (123456.789, "123456.789"),
        (-3e20, "-3.0E20"),
        (1.7e9, "1.7E9"),
        (5e-324, "5.0E-324"),  # Java says 4.9E-324, which is the same number
        (math.inf, "Infinity"),
        (-math.inf, "-Infinity"),
        (math.nan, "NaN"),
        ("1.2345e+10", "1.2345E10"),
    ],
)
def test_numbers_as_java_writes_them(value, text):
    assert java_number(value) == text
