"""All parameters of a vehicle, appended to its profile, make a profile that is right and changes nothing."""

from itertools import product
from pathlib import Path

import pytest

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import Vehicle, build
from shoal.network import VehicleParameters, parameter_file_text
from tests.command import shoal
from tests.repeats import all_but

CAMERA = "Simulation,Camera"


def built(profile: str, modes: str, folder: Path) -> Vehicle:
    loaded = load_profile(profile)
    clock = VirtualClock(loaded.start_time_ns)
    return build(loaded, loaded.parse_modes(modes), clock=clock, log_root=folder).vehicle


def texts(vehicle: Vehicle) -> dict[str, dict[str, str]]:
    return {
        task.name: {known.name: task.parameter_set.text(known) for known in task.parameters().values()}
        for task in vehicle.tasks
    }


def dump(vehicle: Vehicle, path: Path, head: str) -> Path:
    values = {task.entity.label: texts(vehicle)[task.name] for task in vehicle.tasks}
    found = VehicleParameters(
        vehicle.name, vehicle.system, 1.7e9, values, {t.entity.label: t.name for t in vehicle.tasks}
    )
    path.write_text(head + parameter_file_text(found, ".ini"))
    return path


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "modes"),
    all_but(
        [("lauv-noptilus-1", CAMERA), ("otter", "Simulation"), ("caravel", CAMERA), ("hexa-00", "Simulation")],
        product(["lauv-noptilus-1", "otter", "caravel", "hexa-00"], ["Simulation", CAMERA]),
    ),
)
def test_a_dump_that_is_appended_to_its_profile_is_right_and_changes_nothing(
    profile: str, modes: str, tmp_path: Path
) -> None:
    vehicle = built(profile, modes, tmp_path)
    path = dump(vehicle, tmp_path / "today.ini", f"[Require {profile}.ini]\n")
    done = shoal("check", str(path), "-p", modes)
    assert (done.exit_code, done.output) == (0, f"{path}: nothing wrong\n")
    again = built(str(path), modes, tmp_path)
    assert texts(again) == texts(vehicle)


@pytest.mark.parametrize(
    ("world", "section", "option", "expected"),
    [
        ("Sounding Radius = 45", "Simulators.Environment", "Sounding Radius", "45.0"),
        ("Out Of Bounds Depth = 33", "Simulators.Environment", "Out Of Bounds Depth", "33.0"),
        ("Gliders = none", "Simulators.MUGDetectionCamera", "MUGs", "none"),
        ("Gliders = 2 3, 4 5", "Simulators.MUGDetectionCamera/Aft", "MUGs", "2 3, 4 5"),
        ("Gliders Lie On = Depth\nGliders Depth = 4", "Simulators.MUGDetectionCamera", "Target Depth", "4.0"),
        ("Gliders Lie On = Surface", "Simulators.MUGDetectionCamera", "Target Plane", "Surface"),
    ],
)
def test_options_of_older_places_have_the_values_of_the_world(
    world: str, section: str, option: str, expected: str, tmp_path: Path
) -> None:
    own = f"[{section}]\nEnabled = Simulation\n" + ("Entity Label = Aft\n" if "/" in section else "")
    profile = tmp_path / "one.ini"
    profile.write_text(f"[Require lauv-noptilus-1.ini]\n[World]\n{world}\n{own}")
    vehicle = built(str(profile), "Simulation", tmp_path)
    assert texts(vehicle)[section][option] == expected
    path = dump(vehicle, tmp_path / "today.ini", f"[Require {profile}]\n")
    done = shoal("check", str(path), "-p", "Simulation")
    assert (done.exit_code, done.output) == (0, f"{path}: nothing wrong\n")
