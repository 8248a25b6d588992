"""Logs as NetCDF, read by Unidata's library and by another reader, directly and with xarray."""

import json
import math
from pathlib import Path

import h5netcdf
import netCDF4
import numpy as np
import pytest
import xarray

import imc
from runtime.logs import summarize
from shoal.logs.export import LogSource
from shoal.logs.export.netcdf import UNITS, export_netcdf

LOGS = Path(__file__).parents[3] / "data" / "logs"
HEADER = {"timestamp": 1.7e9, "src": 0x1A, "src_ent": 7, "dst": 0xFFFF, "dst_ent": 255}


def export(log, path):
    """Writes a log to a file; returns the number of rows."""
    opened = imc.Log(log)
    return export_netcdf(LogSource(opened, summarize(opened)), path)


@pytest.fixture(scope="module")
def idle(tmp_path_factory):
    path = tmp_path_factory.mktemp("netcdf") / "idle.nc"
    assert export(LOGS / "dune-idle", path) == 6647
    return path


@pytest.fixture
def export_messages(tmp_path, make_log):
    def run(*messages):
        path = tmp_path / "log.nc"
        export(make_log(messages), path)
        return path

    return run


def group_of(path, name=None):
    return xarray.open_dataset(path, group=name, engine="h5netcdf")


@pytest.mark.heavy
def test_all_messages_of_a_log_of_dune_are_there(idle):
    log = imc.Log(LOGS / "dune-idle")
    with h5netcdf.File(idle, decode_vlen_strings=True) as file:
        assert {name: group.dimensions["obs"].size for name, group in file.groups.items()} == log.counts()
        for kind in log.counts():
            group, rows = file[kind], log[kind]
            for name in rows.dtype.names:
                stored = f"field_{name}" if f"field_{name}" in group.variables else name
                np.testing.assert_array_equal(group[stored][...], rows[name], f"{kind}.{name}")
            for field in log.schema.types[kind].fields:
                if field.type == "plaintext":
                    expected = [getattr(message, field.attribute) for message in log.objects(kind)]
                    assert group[field.attribute][...].tolist() == expected, (kind, field.attribute)


@pytest.mark.heavy
def test_time_units_and_names_follow_the_conventions(idle):
    assert group_of(idle).attrs["Conventions"] == "CF-1.11"
    states, stamps = group_of(idle, "EstimatedState"), imc.Log(LOGS / "dune-idle")["EstimatedState"]["timestamp"]
    assert list(states.coords) == ["time"]
    assert states["time"].values.astype("i8") / 1e9 == pytest.approx(stamps, abs=1e-6)
    assert states["lat"].attrs == {"long_name": "Latitude (WGS-84)", "units": "rad"}
    temperature = group_of(idle, "Temperature")["value"].attrs
    assert (temperature["units"], temperature["imc_unit"]) == ("degree_Celsius", "°C")
    state = group_of(idle, "EntityState")["state"].attrs
    assert state["flag_meanings"].split()[state["flag_values"].tolist().index(1)] == "NORMAL"


def test_bits_have_masks_and_names(export_messages):
    loops = group_of(export_messages(imc.ControlLoops(**HEADER)), "ControlLoops")["mask"].attrs
    names = dict(zip(loops["flag_meanings"].split(), loops["flag_masks"].tolist(), strict=True))
    assert names["YAW"] == imc.CLoopsMask.YAW
    assert 0 not in names.values()


@pytest.mark.heavy
def test_every_row_says_who_spoke(idle):
    for kind in ("EstimatedState", "EntityState"):
        group = group_of(idle, kind)
        speakers = group_of(idle).isel(entity=group["speaker"])
        np.testing.assert_array_equal(speakers["src"], group["src"])
        np.testing.assert_array_equal(speakers["src_ent"], group["src_ent"])
    names = group_of(idle).isel(entity=group_of(idle, "EstimatedState")["speaker"])
    assert set(names["system"].values) == {"lauv-noptilus-1"}
    assert set(names["label"].values) == {"Navigation"}


def test_no_value_is_taken_for_a_missing_one(export_messages):
    extremes = [
        imc.Rpm(value=-32767, **HEADER),
        imc.Rpm(value=32767, **HEADER),
        imc.StorageUsage(available=0xFFFFFFFF, value=255, **HEADER),
        imc.Temperature(value=math.nan, **HEADER),
        imc.Temperature(value=-math.inf, **HEADER),
    ]
    with netCDF4.Dataset(export_messages(*extremes)) as file:
        assert file["Rpm/value"][:].tolist() == [-32767, 32767]
        assert file["StorageUsage/available"][:].tolist() == [0xFFFFFFFF]
        assert file["Rpm/dst"][:].tolist() == [0xFFFF] * 2
        assert file["Rpm/dst_ent"][:].tolist() == [255] * 2
        file.set_auto_mask(False)
        assert math.isnan(file["Temperature/value"][0])
        assert file["Temperature/value"][1] == -math.inf


@pytest.mark.heavy
def test_text_raw_data_and_messages_inside(export_messages):
    path = export_messages(
        imc.LogBookEntry(text='tab\tline\r\nquote" comma, ñ', context="\udcff\0", **HEADER),
        imc.LogBookEntry(text="", **HEADER),
        imc.DevDataBinary(value=b"\x00\xfe\n", **HEADER),
        imc.DevDataBinary(value=b"", **HEADER),
        imc.DevDataBinary(value=b"\xff", **HEADER),
        imc.PlanControl(arg=imc.Goto(lat=0.5), **HEADER),
        imc.PlanControl(arg=None, **HEADER),
        imc.Distance(location=(imc.DeviceState(x=1.0), None), **HEADER),
    )
    texts, raw = group_of(path, "LogBookEntry"), group_of(path, "DevDataBinary")
    assert texts["text"].values.tolist() == ['tab\tline\r\nquote" comma, ñ', ""]
    assert texts["context"].values.tolist() == ["\\udcff\\x00", ""]
    assert raw["value_size"].values.tolist() == [3, 0, 1]
    assert raw["value_size"].attrs["sample_dimension"] == raw["value"].dims[0]
    assert raw["value"].values.tobytes() == b"\x00\xfe\n\xff"
    goto, nothing = map(json.loads, group_of(path, "PlanControl")["arg"].values)
    assert (goto["abbrev"], goto["lat"], nothing) == ("Goto", 0.5, None)
    assert json.loads(group_of(path, "Distance")["location"].values[0])[1] is None


def test_fields_with_the_names_of_our_variables_keep_both(export_messages):
    group = group_of(export_messages(imc.EulerAngles(time=5.0, **HEADER)), "EulerAngles")
    assert group["field_time"].item() == 5.0
    assert group["time"].values.astype("i8").tolist() == [1_700_000_000_000_000_000]


def test_times_that_are_no_dates_are_missing(export_messages):
    wrong = [math.nan, -1.0, 1e300]
    group = group_of(
        export_messages(*(imc.Voltage(**HEADER | {"timestamp": time}) for time in (*wrong, 1.7e9))), "Voltage"
    )
    assert np.isnat(group["time"].values).tolist() == [True] * 3 + [False]
    np.testing.assert_array_equal(group["timestamp"].values, [*wrong, 1.7e9])


def test_a_file_is_written_in_pieces(export_messages, monkeypatch):
    monkeypatch.setattr("shoal.logs.export.netcdf.ROWS", 100)
    monkeypatch.setattr("imc.lsf.scanner.PIECE", 600)
    monkeypatch.setattr("shoal.logs.export.message_batches.BATCH_BYTES", 1300)
    messages = [imc.Rpm(value=number, **HEADER) for number in range(1000)]
    messages[500] = imc.LogBookEntry(text="half", **HEADER)
    with netCDF4.Dataset(export_messages(*messages)) as file:
        assert file["Rpm/value"].chunking() == [100]
        assert file["Rpm/value"][:].tolist() == [number for number in range(1000) if number != 500]


@pytest.mark.heavy
def test_every_message_of_the_schema_can_be_written(export_messages):
    path = export_messages(*(imc.builtin().by_id(number)(**HEADER) for number in imc.builtin().types_by_id))
    with netCDF4.Dataset(path) as file:
        assert set(file.groups) == set(imc.builtin().types)


def test_units_are_words_that_cf_knows():
    known = {"m", "rad", "s", "m/s", "rad/s", "rpm", "dm", "V", "N", "S/m", "ms", "A", "Hz", "min", "rpm/s", "hPa"}
    known |= {"bit", "W", "cm/s", "1/m"}
    used = {field.unit for message in imc.builtin().messages for field in message.fields}
    assert used - {"", "Enumerated", "Bitfield", "TupleList", "List"} - set(UNITS) <= known
