"""IMC values as MAVLink values: exact if known, omitted if not."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import imc
from mavlink import load_dialect
from mavlink.positions import degrees_e7, home_from_state, position_of
from mavlink.translate import from_imc

DIALECT = load_dialect()
State = imc.EntityState.State
PORTO = dict(lat=math.radians(41.1850), lon=math.radians(-8.7060), height=55.0)
ANY = st.floats(width=32)
FIGURES = [field for field in imc.EstimatedState.__struct_fields__ if field not in imc.Message.__struct_fields__]
ANY_STATE = st.builds(imc.EstimatedState, **dict.fromkeys(FIGURES, ANY))


def located(state, *, afloat=True, home=None, undulation=0.0):
    home = home or home_from_state(state, afloat=afloat, undulation=undulation)
    return home, home and position_of(state, home, afloat=afloat, undulation=undulation)


def everything(state, afloat=True):
    """All MAVLink messages of a state, by name."""
    home, place = located(state, afloat=afloat)
    found = {
        "ATTITUDE": from_imc.attitude(state, 0),
        "GLOBAL_POSITION_INT": from_imc.global_position(state, place, 0),
        "LOCAL_POSITION_NED": from_imc.local_position(state, place, home, 0) if home else None,
        "VFR_HUD": from_imc.hud(state, place, math.nan, math.nan),
        "HOME_POSITION": from_imc.home_position(home, 0.0) if home else None,
        "GPS_GLOBAL_ORIGIN": from_imc.global_origin(home, 0.0) if home else None,
    }
    return {name: fields for name, fields in found.items() if fields is not None}


def meters(lat, lon, other_lat, other_lon):
    """North and east in m from one point to another nearby, by the radii of curvature of WGS-84 (Torge 2001, 4.1.3)."""
    a, e2 = 6378137.0, 6.69437999014e-3
    w = math.sqrt(1.0 - e2 * math.sin(lat) ** 2)
    return (other_lat - lat) * a * (1.0 - e2) / w**3, (other_lon - lon) * a * math.cos(lat) / w


def test_position_is_where_the_vehicle_is_not_its_reference():
    state = imc.EstimatedState(**PORTO, x=300.0, y=-400.0, z=12.0, depth=12.0, vx=1.0, vy=-2.0, vz=0.25, psi=-0.1)
    fields = everything(state)["GLOBAL_POSITION_INT"]
    lat, lon = math.radians(fields["lat"] * 1e-7), math.radians(fields["lon"] * 1e-7)
    assert meters(PORTO["lat"], PORTO["lon"], lat, lon) == pytest.approx((300.0, -400.0), abs=0.1)
    assert (fields["alt"], fields["relative_alt"]) == (-12000, -12000)
    assert (fields["vx"], fields["vy"], fields["vz"]) == (100, -200, 25)
    assert fields["hdg"] == round((360.0 - math.degrees(0.1)) * 100)


def test_degrees_are_rounded_not_cut():
    assert degrees_e7(math.radians(12.34567899)) == 123456790
    assert degrees_e7(math.radians(-12.34567899)) == -123456790


@pytest.mark.parametrize(("degrees", "hdg"), [(0, 0), (-1, 35900), (359.996, 0), (-0.004, 0), (180, 18000), (720, 0)])
def test_heading_wraps(degrees, hdg):
    state = imc.EstimatedState(**PORTO, psi=math.radians(degrees))
    assert everything(state)["GLOBAL_POSITION_INT"]["hdg"] == hdg


def test_unknown_depth_is_not_one_metre_above_the_surface():
    state = imc.EstimatedState(**PORTO, z=3.5, depth=-1.0)
    assert everything(state)["GLOBAL_POSITION_INT"]["relative_alt"] == -3500
    waves = imc.EstimatedState(**PORTO, z=-0.2, depth=-0.2)
    assert everything(waves)["GLOBAL_POSITION_INT"]["relative_alt"] == 0


def test_flying_vehicle_is_above_the_sea_by_the_geoid():
    first = imc.EstimatedState(**PORTO, depth=-1.0)
    home, _ = located(first, afloat=False, undulation=54.5)
    higher = imc.EstimatedState(**PORTO, z=-100.0, depth=-1.0)
    _, place = located(higher, afloat=False, home=home, undulation=54.5)
    fields = from_imc.global_position(higher, place, 0)
    assert fields["alt"] == pytest.approx(100500, abs=2)
    assert fields["relative_alt"] == pytest.approx(100000, abs=2)
    assert from_imc.home_position(home, 0.0)["altitude"] == 500


def test_local_position_counts_from_home_also_after_a_new_reference():
    first = imc.EstimatedState(**PORTO, x=10.0, y=20.0, z=2.0, depth=2.0)
    home, place = located(first)
    fields = from_imc.local_position(first, place, home, 0)
    assert (fields["x"], fields["y"], fields["z"]) == (10.0, 20.0, 2.0)
    later = imc.EstimatedState(lat=PORTO["lat"] + 1e-4, lon=PORTO["lon"], height=55.0, x=1.0, y=2.0, depth=3.0, z=3.0)
    _, place = located(later, home=home)
    fields = from_imc.local_position(later, place, home, 0)
    north, east = meters(PORTO["lat"], PORTO["lon"], place.lat, place.lon)
    assert (fields["x"], fields["y"], fields["z"]) == (pytest.approx(north, abs=0.2), pytest.approx(east, abs=0.2), 3.0)


def test_velocity_over_ground_comes_from_the_body_where_it_is_missing():
    state = imc.EstimatedState(**PORTO, u=2.0, psi=math.pi / 2)
    assert from_imc.velocity_of(state) == pytest.approx((0.0, 2.0, 0.0))
    down = imc.EstimatedState(**PORTO, u=2.0, theta=-math.pi / 6)
    assert from_imc.velocity_of(down) == pytest.approx((math.sqrt(3.0), 0.0, 1.0))
    assert from_imc.velocity_of(imc.EstimatedState(vx=math.nan, u=math.inf)) is None


def test_attitude_is_as_it_was():
    state = imc.EstimatedState(phi=0.1, theta=-0.2, psi=3.0 * math.pi / 2, p=0.4, q=0.5, r=0.6)
    fields = everything(state)["ATTITUDE"]
    assert (fields["roll"], fields["pitch"], fields["rollspeed"]) == (0.1, -0.2, 0.4)
    assert fields["yaw"] == pytest.approx(-math.pi / 2)


def test_hud():
    state = imc.EstimatedState(**PORTO, u=1.5, vx=3.0, vy=4.0, vz=0.5, psi=-0.001, depth=7.0)
    _, place = located(state)
    fields = from_imc.hud(state, place, math.nan, 45.4)
    expected = {"airspeed": 1.5, "groundspeed": 5.0, "heading": 0, "throttle": 45, "alt": -7.0, "climb": -0.5}
    assert fields == pytest.approx(expected)


def test_time_since_boot_wraps():
    assert from_imc.boot_ms(1002.5, 1000.0) == 2500
    assert from_imc.boot_ms(999.0, 1000.0) == 0
    assert from_imc.boot_ms(1000.0 + 2**32 / 1000.0 + 1.0, 1000.0) == 1000


def test_system_status_says_what_is_unknown():
    bits = from_imc.sensor_bits([("IMU", State.NORMAL), ("DVL", State.ERROR)], located=True, fenced=None, ready=False)
    assert (bits[0] & from_imc.GEOFENCE, bits[1] & from_imc.GEOFENCE) == (0, from_imc.GEOFENCE), "no fence, no breach"
    out = from_imc.sensor_bits([], located=True, fenced=False, ready=True)
    assert out[0] & ~out[1] == from_imc.GEOFENCE
    assert from_imc.failure_bits(out) == 2048
    assert (
        from_imc.failure_bits(from_imc.sensor_bits([("IMU", State.ERROR)], located=False, fenced=None, ready=True))
        == 25
    )
    unknown = from_imc.system_status(bits, math.nan, math.nan, math.nan, math.nan)
    assert unknown["voltage_battery"] == 0xFFFF
    assert (unknown["current_battery"], unknown["battery_remaining"]) == (-1, -1)
    known = from_imc.system_status(bits, 12.0, 24.5, 3.25, 61.0)
    assert [known[n] for n in ("load", "voltage_battery", "current_battery", "battery_remaining")] == [
        120,
        24500,
        325,
        61,
    ]
    present, healthy = known["onboard_control_sensors_present"], known["onboard_control_sensors_health"]
    assert present & from_imc.GYRO
    assert healthy & from_imc.GYRO
    assert present & from_imc.OPTICAL_FLOW
    assert not healthy & from_imc.OPTICAL_FLOW
    assert healthy & from_imc.GPS
    assert not healthy & from_imc.PREARM


def test_landed_state_follows_the_medium():
    media = imc.VehicleMedium.Medium
    states = [(None, False), (media.GROUND, True), (media.WATER, False), (media.WATER, True), (media.UNDERWATER, False)]
    assert [from_imc.extended_state(*state)["landed_state"] for state in states] == [0, 1, 1, 2, 2]


@pytest.mark.heavy
@settings(max_examples=400)
@given(ANY_STATE, st.booleans())
@example(imc.EstimatedState(lat=math.pi / 2, lon=0.0, x=10.0, y=10.0), True)
@example(imc.EstimatedState(lat=0.5, lon=math.pi, y=1000.0), True)
@example(imc.EstimatedState(lat=0.5, lon=1e300), False)
@example(imc.EstimatedState(lat=0.5, lon=0.5, depth=3.4e38, z=1e7), True)
@example(imc.EstimatedState(lat=0.5, lon=0.5, vx=3e4), True)
@example(imc.EstimatedState(depth=2000001.0), True)
def test_no_state_raises_and_none_lies(state, afloat):
    for name, fields in everything(state, afloat).items():
        definition = DIALECT.by_name[name]
        said = definition.unpack(definition.pack(fields))
        for field, value in fields.items():
            if isinstance(value, int):
                assert said[field] == value, f"{name}.{field} does not fit"
        if name == "ATTITUDE":
            for field in ("roll", "pitch", "yaw"):
                assert abs(said[field]) <= math.pi + 1e-6
        if name == "GLOBAL_POSITION_INT":
            assert abs(said["lat"]) <= 900000000
            assert abs(said["lon"]) <= 1800000000
            assert 0 <= said["hdg"] < 36000 or said["hdg"] == 0xFFFF
            if afloat and state.depth > -1.0:
                assert said["relative_alt"] == pytest.approx(-1e3 * max(0.0, state.depth), abs=1.0)
            if any((state.vx, state.vy, state.vz)) and math.isfinite(state.vx + state.vy + state.vz):
                assert [said["vx"], said["vy"]] == pytest.approx([100 * state.vx, 100 * state.vy], abs=1.0)


@settings(max_examples=200)
@given(*[st.floats() for _ in range(4)])
def test_no_figure_raises(load, voltage, current, fuel):
    fields = from_imc.system_status((0, 0), load, voltage, current, fuel)
    definition = DIALECT.by_name["SYS_STATUS"]
    said = definition.unpack(definition.pack(fields))
    assert all(said[name] == value for name, value in fields.items())
