"""Parameters under MAVLink's names, in both encodings."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink import FLAVORS
from mavlink.vehicle.parameters.names import parameter_ids
from mavlink.vehicle.parameters.table import (
    INT32,
    OUT_OF_RANGE,
    REAL32,
    TYPE_MISMATCH,
    ParameterRefusal,
    ParameterTable,
)
from runtime import Task, param
from runtime.testing import simulate
from tasks.transports.mavlink_links.parameters_and_cameras import task_parameters
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import HOST, Station, mavlink, sail

PX4, ARDUPILOT = FLAVORS["px4"], FLAVORS["ardupilot"]
WORDS = st.text(max_size=40)


class Sonar(Task):
    """Has a parameter of each type."""

    gain: float = param(0.5, "1", "Gain.", minimum=0, maximum=10)
    pings: int = param(-7, "1", "Pings.", minimum=-(2**40), maximum=2**40)
    beamforming_window_selection: str = param("hann", "", "Window.", choices=("none", "hann", "hamming"))
    enabled_beams: bool = param(True, "", "On.")
    comment: str = param("", "", "Free text.")
    offsets: list[float] = param([1.0], "m", "Offsets.")
    fixed: int = param(1, "1", "Not to be changed.", editable=False)
    serial: int = param(2**35, "1", "Does not fit.", minimum=0)


@pytest.fixture
def table():
    return ParameterTable(task_parameters(simulate(Sonar, seconds=0.0, section="Sonar").vehicle.tasks))


@pytest.fixture
def sonar(table):
    return {entry.declaration.attribute: entry for entry in table if entry.view.section == "Sonar"}


def test_table_has_the_numbers_booleans_and_choices(table, sonar):
    assert {name: entry.type for name, entry in sonar.items()} == {
        "gain": REAL32,
        "pings": INT32,
        "beamforming_window_selection": INT32,
        "enabled_beams": INT32,
        "debug_level": INT32,
    }
    assert [entry.index for entry in table] == list(range(len(table)))
    assert sonar["gain"].id == "SONAR_GAIN"
    assert all(table.named(entry.id.encode()) is entry and table.at(entry.index) is entry for entry in table)
    assert (table.named(b"NOTHING"), table.at(-1), table.at(len(table)), table.find_entity_parameter("Sonar", "?")) == (
        None,
    ) * 4
    assert table.find_entity_parameter("Sonar", "Gain") is sonar["gain"]


def test_a_profile_can_take_a_parameter_from_the_table():
    tasks = simulate(Sonar, seconds=0.0, section="Sonar").vehicle.tasks
    for task in tasks:
        task.parameter_set.redeclare("Gain", {"editable": "false"})
    names = {
        entry.declaration.name for entry in ParameterTable(task_parameters(tasks)) if entry.view.section == "Sonar"
    }
    assert "Pings" in names
    assert "Gain" not in names


def test_values(sonar):
    assert sonar["gain"].value == 0.5
    assert sonar["pings"].value == -7
    assert sonar["beamforming_window_selection"].value == 1
    assert sonar["enabled_beams"].value == 1


def test_the_two_encodings_of_an_integer(sonar):
    assert sonar["pings"].encoded(PX4) == struct.pack("<i", -7)
    assert sonar["pings"].encoded(ARDUPILOT) == struct.pack("<f", -7.0)
    assert sonar["gain"].encoded(PX4) == sonar["gain"].encoded(ARDUPILOT) == struct.pack("<f", 0.5)


@settings(max_examples=150)
@given(st.integers(-(2**31), 2**31 - 1))
def test_integers_survive_bytewise(value):
    table = ParameterTable(task_parameters(simulate((Sonar), seconds=0.0, section="Sonar", pings=value).vehicle.tasks))
    entry = table.find_entity_parameter("Sonar", "Pings")
    assert int(entry.decode_param_value(entry.encoded(PX4), INT32, PX4)) == value
    if abs(value) <= 2**24:
        assert int(entry.decode_param_value(entry.encoded(ARDUPILOT), INT32, ARDUPILOT)) == value


def test_pattern_of_a_signalling_nan_survives_as_integer(sonar):
    assert sonar["pings"].decode_param_value(struct.pack("<i", 0x7F800001), INT32, PX4) == str(0x7F800001)


@pytest.mark.parametrize("flavor", [PX4, ARDUPILOT])
@given(value=st.floats(0.0, 10.0, width=32))
def test_floats_survive(flavor, value):
    parameter = Sonar.parameters()["Gain"]
    entry = next(e for e in ParameterTable(task_parameters(TASKS)) if e.declaration is parameter)
    text = entry.decode_param_value(struct.pack("<f", value), REAL32, flavor)
    assert np.float32(float(text)) == np.float32(value)


def test_text_is_the_short_decimal(sonar):
    assert sonar["gain"].decode_param_value(struct.pack("<f", 0.1), REAL32, PX4) == "0.1"


def test_choices_and_booleans_are_set_by_number(sonar):
    assert sonar["beamforming_window_selection"].decode_param_value(struct.pack("<i", 2), INT32, PX4) == "hamming"
    assert sonar["enabled_beams"].decode_param_value(struct.pack("<f", 0.0), INT32, ARDUPILOT) == "false"


@pytest.mark.parametrize(
    ("name", "raw", "kind", "flavor", "code"),
    [
        ("gain", struct.pack("<f", 11.0), REAL32, PX4, OUT_OF_RANGE),
        ("gain", struct.pack("<f", math.nan), REAL32, PX4, OUT_OF_RANGE),
        ("gain", struct.pack("<f", math.inf), REAL32, ARDUPILOT, OUT_OF_RANGE),
        ("gain", struct.pack("<i", 1), INT32, PX4, TYPE_MISMATCH),
        ("pings", struct.pack("<f", 1.5), REAL32, ARDUPILOT, OUT_OF_RANGE),
        ("pings", struct.pack("<f", 1.5), REAL32, PX4, TYPE_MISMATCH),
        ("pings", struct.pack("<f", math.nan), INT32, ARDUPILOT, OUT_OF_RANGE),
        ("enabled_beams", struct.pack("<i", 2), INT32, PX4, OUT_OF_RANGE),
        ("beamforming_window_selection", struct.pack("<i", -1), INT32, PX4, OUT_OF_RANGE),
    ],
)
def test_refusals(sonar, name, raw, kind, flavor, code):
    with pytest.raises(ParameterRefusal) as caught:
        sonar[name].decode_param_value(raw, kind, flavor)
    assert caught.value.code == code


STANDARD_NAME, KEPT_NAME = b"MIS_TAKEOFF_ALT", b"MAVLNK_TAKFF_ALT"


def test_the_altitude_of_a_takeoff_has_the_name_of_a_px4_too():
    port = free_port()

    async def script(control):
        station = Station(control)
        await station.meet((HOST, port))
        wish = {"target_system": 26, "target_component": 1}

        async def named(name):
            return await station.expect("PARAM_VALUE", lambda values: values["param_id"].rstrip(b"\0") == name)

        station.send("PARAM_REQUEST_READ", **wish, param_id=STANDARD_NAME, param_index=-1)
        found = await named(STANDARD_NAME)
        assert (found["param_value"], found["param_type"], found["param_index"]) == (10.0, REAL32, 0xFFFF)
        station.send("PARAM_SET", **wish, param_id=STANDARD_NAME, param_value=25.0, param_type=REAL32)
        assert (await named(KEPT_NAME))["param_value"] == 25.0
        assert (await named(STANDARD_NAME))["param_value"] == 25.0
        assert mavlink(control).takeoff_altitude == 25.0
        station.send("PARAM_SET", **wish, param_id=STANDARD_NAME, param_value=500.0, param_type=REAL32)
        assert (await named(STANDARD_NAME))["param_value"] == 25.0, "at most 120 m"
        station.send("PARAM_REQUEST_LIST", **wish)
        names = set()
        while len(names) < found["param_count"]:
            names.add((await station.expect("PARAM_VALUE"))["param_id"].rstrip(b"\0"))
        assert KEPT_NAME in names
        assert STANDARD_NAME not in names, "one parameter, one entry"

    sail(script, f"udpin:{HOST}:{port}:px4")


@given(st.lists(st.tuples(WORDS, WORDS), unique=True, max_size=40))
def test_names_fit_and_are_unique(pairs):
    names = parameter_ids(pairs)
    assert set(names) == set(pairs)
    assert len(set(names.values())) == len(pairs)
    assert all(0 < len(name) <= 16 and name.isascii() for name in names.values())


def test_names_do_not_depend_on_other_tasks():
    few = [("Depth Sensor", "Standard Deviation - Depth"), ("IMU", "Gyro Noise")]
    many = [*few, ("Depth Sensor", "Standard Deviation - Offset"), ("A", "B"), ("DVL", "Execution Frequency")]
    assert parameter_ids(few).items() <= parameter_ids(many).items()
    assert parameter_ids(few) == {
        ("Depth Sensor", "Standard Deviation - Depth"): "DPTSNS_STDDEVDPT",
        ("IMU", "Gyro Noise"): "IMU_GYRO_NOISE",
    }


TASKS = simulate(Sonar, seconds=0.0, section="Sonar").vehicle.tasks
