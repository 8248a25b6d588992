"""Names of parameters in MAVLink: readable, and the same in each release, since stations store them by name."""

from pathlib import Path

import pytest

from mavlink.vehicle.parameters.names import BASE32, LONGEST, parameter_id, parameter_ids
from mavlink.vehicle.parameters.table import ParameterTable
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.transports.mavlink_links.parameters_and_cameras import task_parameters

KEPT = Path(__file__).with_name("mavlink_names.txt")
PROFILES = ["lauv-noptilus-1", "otter", "caravel", "hexa-00"]


def kept():
    """The names by entity label and parameter."""
    found = {}
    for line in KEPT.read_text().splitlines():
        label, _, parameter = line[LONGEST + 1 :].partition(": ")
        found[label, parameter] = line[:LONGEST].rstrip()
    return found


def shown(profile, tmp_path):
    loaded = load_profile(profile)
    made = build(
        loaded,
        loaded.parse_modes(["Simulation"]),
        clock=parse_clock("virtual", loaded.start_time_ns),
        log_root=tmp_path / "log",
        state_folder=tmp_path / "db",
    )
    return {(e.view.label, e.declaration.name): e.id for e in ParameterTable(task_parameters(made.vehicle.tasks))}


@pytest.mark.parametrize("profile", PROFILES)
def test_shipped_vehicles_keep_the_names_of_their_parameters(profile, tmp_path):
    names, known = shown(profile, tmp_path), kept()
    changed = {pair: (known[pair], name) for pair, name in names.items() if known.get(pair, name) != name}
    assert changed == {}
    assert len(names.keys() & known.keys()) > 0.8 * len(names)
    assert all(name == parameter_id(*pair) for pair, name in names.items()), "none needs a checksum"


def test_all_that_are_kept_follow_from_the_label_and_the_parameter():
    known = kept()
    assert len(known) > 400
    assert {pair: parameter_id(*pair) for pair in known} == known
    assert len(set(parameter_ids(known).values())) == len(known)


def test_parameters_that_would_have_the_same_name_get_a_checksum():
    alike = [("Path Control", "Cross-track -- Monitor Time"), ("Path Control", "Cross track Monitor Time")]
    assert len({parameter_id(*pair) for pair in alike}) == 1
    names = parameter_ids([*alike, ("IMU", "Gyro Noise")])
    assert names["IMU", "Gyro Noise"] == "IMU_GYRO_NOISE"
    assert len(set(names.values())) == 3
    assert all(name[-3] == "_" and set(name[-2:]) <= set(BASE32) for name in names.values() if "IMU" not in name)
    assert parameter_ids(reversed(alike)) == parameter_ids(alike)
