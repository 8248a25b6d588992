"""The messages that ground stations get: what shipped vehicles say in them, and the table in the documentation."""

import math
import re
from pathlib import Path

import pytest

import imc
from mavlink import FLAVORS, Flavor, load_dialect
from mavlink.vehicle.telemetry.named_value_option import parse_named_value
from mavlink.vehicle.telemetry.streams import STREAMS
from shoal.missions import parse_plan
from tasks.transports.mavlink import MAVLink
from tests.tasks.transports.test_mavlink_vehicles import PLANS, Commanded

DIALECT = load_dialect()
PAGE = Path(__file__).parents[3] / "docs" / "mavlink.md"
VESSELS = {"lauv-noptilus-1", "otter", "caravel"}
NEVER = {"NAMED_VALUE_FLOAT"}
ALWAYS = (
    set(STREAMS)
    - NEVER
    - {
        "SCALED_PRESSURE",
        "SCALED_PRESSURE2",
        "DISTANCE_SENSOR",
        "WATER_DEPTH",
        "RAW_IMU",
        "HIGHRES_IMU",
    }
)
BESIDES = {
    "lauv-noptilus-1": {"SCALED_PRESSURE2", "DISTANCE_SENSOR", "WATER_DEPTH", "RAW_IMU", "HIGHRES_IMU"},
    "otter": {"DISTANCE_SENSOR", "WATER_DEPTH", "RAW_IMU", "HIGHRES_IMU"},
    "caravel": {"DISTANCE_SENSOR", "WATER_DEPTH", "RAW_IMU", "HIGHRES_IMU"},
    "hexa-00": {"DISTANCE_SENSOR", "SCALED_PRESSURE", "RAW_IMU", "HIGHRES_IMU"},
}


@pytest.fixture(scope="module", params=PLANS)
def said(request, tmp_path_factory):
    """What a vehicle on its plan sends, by name, and its true state."""
    flown = Commanded(request.param, tmp_path_factory.mktemp("vehicle"))
    flown.vehicle.start()
    flown.vehicle.kernel.after(15.0, flown.begin, parse_plan(PLANS[request.param]))
    flown.vehicle.run(60.0)
    sources, flavor = flown.link.endpoint.telemetry.sources, FLAVORS["ardupilot"]
    found = {}
    for name, stream in STREAMS.items():
        definition = DIALECT.by_name[name]
        instances = stream.build_message_fields(sources, flavor, flown.link.now)
        found[name] = [definition.unpack(definition.pack(fields)) for fields in instances]
        for fields in instances:
            assert set(fields) <= {field.name for field in definition.fields}
    yield request.param, found, flown.truths[-1], flown
    flown.vehicle.close()


@pytest.mark.heavy
def test_a_vehicle_on_its_plan_says_all_that_it_measures(said):
    profile, found, _, _ = said
    assert {name for name, instances in found.items() if instances} == ALWAYS | BESIDES[profile]


def test_quaternion_and_imu_come_without_a_request(said):
    _, found, _, flown = said
    rates = flown.link.endpoint.telemetry.rates(low=False)
    for name in ("ATTITUDE_QUATERNION", "HIGHRES_IMU"):
        assert rates[name] >= 1.0
        assert found[name]


def test_figures_are_those_of_the_vehicle(said):
    profile, found, truth, flown = said
    before = next(t for t in reversed(flown.truths) if t.timestamp <= truth.timestamp - 1.0)
    speed = math.hypot(truth.x - before.x, truth.y - before.y) / (truth.timestamp - before.timestamp)
    (hud,), (position,), (gps,) = found["VFR_HUD"], found["GLOBAL_POSITION_INT"], found["GPS_RAW_INT"]
    assert hud["throttle"] > 10
    assert hud["groundspeed"] == pytest.approx(speed, abs=0.7)
    if profile in VESSELS:
        assert position["relative_alt"] == pytest.approx(-1000 * truth.z, abs=700)
        assert hud["alt"] == pytest.approx(-truth.z, abs=0.7)
    submerged = profile == "lauv-noptilus-1"
    assert gps["fix_type"] == (1 if submerged else 3)
    assert gps["lat"] == pytest.approx(position["lat"], abs=20_000 if submerged else 2000), "1e-7 degrees are 1.1 cm"
    (target,) = found["NAV_CONTROLLER_OUTPUT"]
    assert 50 < target["wp_dist"] < 650
    assert abs(target["target_bearing"]) < 20, "the plan goes north"
    assert found["BATTERY_STATUS"][0]["voltages"][0] == found["SYS_STATUS"][0]["voltage_battery"]
    assert 10_000 < found["BATTERY_STATUS"][0]["voltages"][0] < 65_000
    q = [found["ATTITUDE_QUATERNION"][0][f"q{n}"] for n in range(1, 5)]
    assert math.hypot(*q) == pytest.approx(1.0, abs=1e-5)
    yaw = math.atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] ** 2 + q[3] ** 2))
    assert yaw == pytest.approx(found["ATTITUDE"][0]["yaw"], abs=1e-5)
    (odometry,), (local,) = found["ODOMETRY"], found["LOCAL_POSITION_NED"]
    assert [odometry[name] for name in ("x", "y", "z")] == [local[name] for name in ("x", "y", "z")]
    assert (odometry["frame_id"], odometry["child_frame_id"]) == (1, 12)
    assert list(odometry["q"]) == pytest.approx(q)
    along = [odometry[name] for name in ("vx", "vy", "vz")]
    assert math.hypot(*along) == pytest.approx(math.hypot(*(local[name] for name in ("vx", "vy", "vz"))), rel=1e-5)
    assert along[0] == pytest.approx(speed, abs=1.2), "it goes forward"
    assert odometry["pose_covariance"][0] > 0.0
    assert math.isnan(odometry["velocity_covariance"][0]), "nobody knows it"
    mode = found["CURRENT_MODE"][0]
    assert mode["custom_mode"] == found["HEARTBEAT"][0]["custom_mode"]
    assert mode["standard_mode"] == 6
    imu = found["HIGHRES_IMU"][0]
    assert math.hypot(imu["xacc"], imu["yacc"], imu["zacc"]) == pytest.approx(9.8, abs=2.0)
    assert found["RAW_IMU"][0]["zacc"] == pytest.approx(imu["zacc"] / 9.80665e-3, abs=1.0)
    assert found["ESTIMATOR_STATUS"][0]["pos_horiz_accuracy"] < 20.0


def test_depths_add_up(said):
    profile, found, _, flown = said
    if not found["DISTANCE_SENSOR"]:
        return
    (down,) = [m for m in found["DISTANCE_SENSOR"] if m["orientation"] == 25]
    state = flown.link.endpoint.model.latest.state
    assert down["current_distance"] == pytest.approx(100 * state.alt, abs=1.0)
    if profile in VESSELS:
        assert found["WATER_DEPTH"][0]["distance"] == pytest.approx(state.alt + state.depth, abs=0.1)
    assert found["ALTITUDE"][0]["bottom_clearance"] == pytest.approx(state.alt, abs=0.1)


def test_pressures_are_those_of_the_water_and_the_air_with_their_temperatures(said):
    profile, found, truth, _ = said
    for values in found["SCALED_PRESSURE2"]:
        assert values["press_abs"] == pytest.approx(1013.25 + 100.5 * truth.z, abs=50.0), "hPa; 1 m is 100.5 hPa"
        assert values["temperature"] == 1500
    for values in found["SCALED_PRESSURE"]:
        assert values["press_abs"] == pytest.approx(1013.25 - 0.12 * (truth.height - truth.z), abs=2.0)
        assert values["temperature"] == pytest.approx(1500 - 0.65 * (truth.height - truth.z), abs=2.0)
    assert bool(found["SCALED_PRESSURE2"]) == (profile == "lauv-noptilus-1")
    assert bool(found["SCALED_PRESSURE"]) == (profile == "hexa-00")


def test_silent_sensors_are_not_repeated(said):
    _, _, _, flown = said
    sources = flown.link.endpoint.telemetry.sources
    model = sources.model
    kept = model.latest._found
    try:
        model.latest._found = {kind: dict(found) for kind, found in kept.items()}
        model.latest._age = lambda time: flown.link.now + 11.0 - time
        model.forget_old()
        names = {name for name, s in STREAMS.items() if s.build_message_fields(sources, FLAVORS["px4"], flown.link.now)}
    finally:
        model.latest._found, model.latest._age = kept, model.age
        model.health.supervisor_silent = False
    assert not names & {
        "GPS_RAW_INT",
        "ATTITUDE",
        "GLOBAL_POSITION_INT",
        "BATTERY_STATUS",
        "RAW_IMU",
        "DISTANCE_SENSOR",
        "SCALED_PRESSURE",
        "SCALED_PRESSURE2",
    }


@pytest.mark.parametrize("flavor", FLAVORS.values())
def test_no_stream_raises_without_a_vehicle(desk, flavor: Flavor):
    for stream in STREAMS.values():
        stream.build_message_fields(desk.endpoint.telemetry.sources, flavor, desk.now)
    desk.locate(lat=math.nan, phi=math.inf, alt=-1.0, psi=math.nan)
    nan, inf = math.nan, math.inf
    for message in (
        imc.GpsFix(validity=0xFFFF, lat=nan, lon=inf, hdop=nan, sog=inf, cog=nan, hacc=nan, vacc=inf),
        imc.GpsFix(validity=0xFFFF, lat=0.7, height=1e30, hacc=1e38, hdop=inf),
        imc.Voltage(value=nan),
        imc.Current(value=inf),
        imc.Temperature(value=nan),
        imc.Pressure(value=inf),
        imc.Acceleration(x=nan, y=inf),
        imc.AngularVelocity(x=1e300),
        imc.NavigationUncertainty(x=nan, y=-1.0),
        imc.PathControlState(end_lat=nan, end_lon=inf),
        imc.SetThrusterActuation(value=nan),
        imc.FuelLevel(value=nan),
        imc.Distance(value=nan),
    ):
        desk.endpoint.update_state(message, "Echo Sounder", desk.now)
        for name, stream in STREAMS.items():
            for fields in stream.build_message_fields(desk.endpoint.telemetry.sources, flavor, desk.now):
                DIALECT.by_name[name].pack(fields)


def test_a_vehicle_without_a_path_has_no_distance_to_a_target(desk):
    desk.locate(psi=-0.5, phi=0.1)
    stream = STREAMS["NAV_CONTROLLER_OUTPUT"]
    (fields,) = stream.build_message_fields(desk.endpoint.telemetry.sources, FLAVORS["ardupilot"], desk.now)
    values = DIALECT.by_name[stream.name].unpack(DIALECT.by_name[stream.name].pack(fields))
    assert (values["nav_bearing"], values["target_bearing"], values["wp_dist"], values["xtrack_error"]) == (
        -29,
        -29,
        0,
        0,
    )
    assert values["nav_roll"] == pytest.approx(math.degrees(0.1))


def test_named_values_are_any_numbers_of_the_bus(tmp_path):
    values = [
        "SoundSpeed",
        "warmth=Temperature:CTD Simulator",
        "drift=NavigationUncertainty.x",
        "Rpm",
        "gone=Salinity:Nobody",
    ]
    flown = Commanded("lauv-noptilus-1", tmp_path, named_values=values)
    flown.vehicle.start()
    flown.vehicle.run(30.0)
    sources = flown.link.endpoint.telemetry.sources
    found = STREAMS["NAMED_VALUE_FLOAT"].build_message_fields(sources, FLAVORS["px4"], flown.link.now)
    flown.vehicle.close()
    named = {fields["name"]: fields["value"] for fields in found}
    assert set(named) == {b"SoundSpeed", b"warmth", b"drift", b"Rpm"}
    assert 1450 < named[b"SoundSpeed"] < 1560
    assert 5 < named[b"warmth"] < 35


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Salinty", "did you mean Salinity"),
        ("Salinity.valu", "no number 'valu'; it has value"),
        ("LogBookEntry", "no number 'value'; it has type, htime"),
        ("NavigationUncertainty", "no number 'value'; it has x, y"),
        ("IndicatedSpeed", "give it a name of 1 to 10 letters: NAME=IndicatedSpeed"),
        ("salinité=Salinity", "1 to 10 letters"),
        ("", "there is no message"),
    ],
)
def test_wrong_named_values_are_explained(text, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        parse_named_value(text)


def test_the_documentation_lists_the_streams():
    section = PAGE.read_text().partition("## Outgoing messages")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([A-Z0-9_]+) \| (.+?) \| (.+?) \|$", section, re.MULTILINE)

    parameters = {parameter.attribute: parameter for parameter in MAVLink.parameters().values()}

    def rate(stream):
        if isinstance(stream.rate, str):
            parameter = parameters[stream.rate]
            return f"`{parameter.name}`, {parameter.default:g}"
        return f"{stream.rate:g}" if stream.rate else "on request"

    assert [(name, hertz, sources) for name, hertz, sources in rows if name in STREAMS] == [
        (stream.name, rate(stream), stream.sources) for stream in STREAMS.values()
    ]
