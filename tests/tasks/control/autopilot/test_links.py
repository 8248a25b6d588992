"""The links to an autopilot: real sockets, a pseudo terminal, signatures; and others who are on the link."""

import pytest

import imc
from tests.repeats import all_but
from tests.tasks.control.autopilot.bodies import PATIENT, SERIAL

LEG = "  - goto: {north: 12, speed: 4 m/s, depth: 0}\n"
ADDRESSES = {
    "udpin": ("udpin://127.0.0.1:{port}",),
    "udpout": ("udpout://127.0.0.1:{port}", "--waits"),
    "udpout by name": ("udpout://localhost:{port}", "--waits"),
    "tcpout": ("tcpout://127.0.0.1:{port}", "--tcp"),
    "serial": (SERIAL,),
}
LOST = [("false", 7), ("true", 7), ("true", 1014), ("true", 1038)]


def go(boat):
    boat.ready()
    boat.said[imc.PlanControlState].clear()
    boat.start(LEG)
    assert boat.wait(boat.outcome) == "SUCCESS", "\n".join(boat.texts())


@pytest.mark.heavy
@pytest.mark.parametrize("address", [name for name in ADDRESSES if name != "udpin"])  # of all other tests
def test_a_plan_is_carried_out_over_each_link(body, address):
    place, *options = ADDRESSES[address]
    boat = body("autopilot-rover", *options, kind="boat", address=place)
    go(boat)


@pytest.mark.heavy
def test_an_autopilot_that_is_restarted_is_found_again_over_tcp(body):
    boat = body("autopilot-rover", "--tcp", kind="boat", address="tcpout://127.0.0.1:{port}", overrides=())
    boat.ready()
    boat.autopilot.kill()
    boat.wait(lambda: boat.state("Autopilot").startswith("ERROR"))
    boat.wait(lambda: not boat.state("Navigation").startswith("NORMAL"))
    boat.autopilot = boat.stand_in("--tcp", kind="boat")
    boat.wait(lambda: all(boat.state(label).startswith("NORMAL") for label in ("Autopilot", "Navigation", "GPS")))
    boat.said[imc.VehicleState].clear()
    go(boat)


def key(tmp_path, words="left luggage"):
    file = tmp_path / "key"
    file.write_text(words + "\n")
    return file


@pytest.mark.heavy
def test_on_a_signed_link_only_the_key_counts(body, tmp_path):
    address = f"udpin://127.0.0.1:{{port}}?key={key(tmp_path)}"
    boat = body("autopilot-rover", "--key", "left luggage", kind="boat", address=address)
    boat.ready()
    for _ in range(10):
        boat.tell("forge")
    go(boat)
    counts = boat.vehicle.task_by_label("Autopilot").connection.counts
    assert counts["unsigned"] >= 10
    assert counts["damaged"] >= 10
    assert counts["forged"] == counts["replayed"] == 0
    assert max(state.lat for state in boat.said[imc.EstimatedState]) < 1.0


def test_an_autopilot_with_another_key_is_not_heard(body, tmp_path):
    address = f"udpin://127.0.0.1:{{port}}?key={key(tmp_path)}"
    boat = body("autopilot-rover", "--key", "right luggage", kind="boat", address=address)
    task = boat.vehicle.task_by_label("Autopilot")
    boat.wait(lambda: hasattr(task, "connection") and task.connection.counts["forged"] > 3)
    assert not task.connection.has_received_heartbeat
    assert not boat.said[imc.EstimatedState]


@pytest.mark.heavy
def test_a_second_autopilot_with_the_same_id_has_no_effect_and_is_reported(body):
    boat = body("autopilot-rover", kind="boat", overrides=[*PATIENT])
    boat.ready()
    other = boat.stand_in("--north", "3000", kind="boat")
    boat.wait(lambda: any("another autopilot has the same MAVLink system id, 7" in text for text in boat.texts()))
    go(boat)
    north = max(state.lat for state in boat.said[imc.EstimatedState]) - 0.7188138
    assert north * 6378137.0 < 100.0
    assert other.runs


@pytest.mark.heavy
def test_acknowledgments_for_others_are_none(body):
    boat = body("autopilot-rover", kind="boat")
    boat.ready()
    boat.tell("mumble")
    go(boat)


@pytest.mark.heavy
@pytest.mark.parametrize(("memory", "seed"), all_but([("false", 7), ("true", 1014)], LOST))
def test_a_tenth_of_all_messages_may_be_lost_each_way(body, memory, seed):
    """With the last two, often the acknowledgment of the whole mission, and the word that it was carried out."""
    overrides = [*PATIENT, f"Control.Autopilot.MAVLink:Plans In Memory={memory}"]
    boat = body("autopilot-rover", "--loss", "0.1", "--seed", str(seed), kind="boat", overrides=overrides)
    go(boat)


def test_fixes_of_another_sensor_become_the_gps_of_the_autopilot(body):
    aided = [*PATIENT, "Control.Autopilot.MAVLink:Aiding Entity=Surface GPS"]
    boat = body("autopilot-rover", kind="boat", overrides=aided)
    boat.ready()
    sensor = boat.vehicle.entities.reserve("Surface GPS", "test")
    fix = imc.GpsFix(validity=imc.GpsFix.Validity.VALID_POS, lat=0.7, lon=-0.1)
    boat.publish(fix, (boat.vehicle.system, sensor.id))
    boat.wait(lambda: any(text.startswith("GPS 401070457 -57295780 3") for text in boat.texts()))
