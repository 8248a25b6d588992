"""From a profile to a vehicle: created tasks, skipped tasks, and errors with file and line."""

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build, check_profile, find_task
from support.diagnostics import COMMAND_LINE, ProfileError
from tests.outside import FILE_EXISTS


def made(tmp_path, text, selected=("Simulation",), **more):
    (tmp_path / "mine.ini").write_text(f"[General]\nVehicle = mine\n{text}")
    profile = load_profile(tmp_path / "mine.ini")
    return build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path / "log", **more)


def refused(tmp_path, text):
    with pytest.raises(ProfileError) as caught:
        made(tmp_path, text)
    return str(caught.value)


def test_sections_become_tasks_in_byte_order(tmp_path):
    vehicle = made(
        tmp_path,
        "[Simulators.IMU/B]\nEnabled=Simulation\n[Simulators.IMU/A]\nEnabled=Always\n[Simulators.GPS]\nEnabled=Never\n",
    ).vehicle
    assert [task.name for task in vehicle.tasks] == ["Daemon", "Simulators.IMU/A", "Simulators.IMU/B"]
    assert [task.entity.label for task in vehicle.tasks] == ["Daemon", "IMU/A", "IMU/B"]
    vehicle.close()


def test_what_is_skipped_is_listed_with_the_reason(tmp_path):
    build = made(tmp_path, "[Simulators.LBL]\nEnabled=Always\n[Transports.MAVLink]\nEnabled=Always\n")
    assert [(len(names), reason.split(",")[0]) for reason, names in build.skipped.items()] == [
        (1, "not in Shoal"),
        (1, "needs the network"),
    ]
    build.vehicle.close()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[Transports.UDP]\nEnabled=Always\nLocal Port=99999\n", "mine.ini:5: error: Transports.UDP: Local Port"),
        ("[Transports.UDP]\nEnabled=Always\nAddress=nowhere\n", "mine.ini:5: error: Transports.UDP: Address"),
        ("[Transports.TCP.Server]\nEnabled=Always\nMaximum Rate=1\n", "mine.ini:5: error: Transports.TCP.Server: Max"),
    ],
)
def test_a_virtual_run_rejects_wrong_options_of_links_too(tmp_path, text, words):
    assert words in refused(tmp_path, text)


def test_links_that_virtual_time_skips_are_checked_without_a_second_pass_over_the_profile():
    """A campaign builds a vehicle for each of thousands of runs."""
    profile = load_profile("lauv-noptilus-1")
    built = build(profile, ["Simulation"], clock=VirtualClock(profile.start_time_ns))
    built.vehicle.close()
    assert "Transports.UDP" in built.off
    for option in ("Seed", "Selected"):
        found = profile.config.option("General", option)
        assert found is not None
        assert [assigned.origin.file for assigned in found.history].count(COMMAND_LINE.file) == 1


def test_bad_values_and_labels_name_file_and_line(tmp_path):
    text = refused(tmp_path, "[Simulators.GPS]\nEnabled = Always\nHDOP = -1\n[Simulators.IMU]\nEnabled = Always\n")
    assert "mine.ini:5: error: Simulators.GPS: HDOP: -1 is below the minimum" in text
    text = refused(
        tmp_path,
        "[Simulators.GPS]\nEnabled=Always\nEntity Label=X\n[Simulators.IMU]\nEnabled=Always\nEntity Label=X\n",
    )
    assert "mine.ini:8: error: Simulators.IMU: the entity label 'X' is taken by Simulators.GPS" in text


def test_values_of_other_sections_are_named_with_their_own_line(tmp_path):
    battery = "[Simulators.Battery]\nEnabled = Always\n[Monitors.FuelLevel]\nEnabled = Always\n"
    text = refused(tmp_path, f"Battery Capacity = none\n{battery}")
    for task in ("Simulators.Battery", "Monitors.FuelLevel"):
        assert f"mine.ini:3: error: {task}: Battery Capacity: [General] has 'none', which is not a number" in text
    for task, option, word in (
        ("Control.AUV.Attitude", "Absolute Maximum Depth", "nan"),
        ("Monitors.Medium", "Underwater Depth Threshold", "deep"),
    ):
        text = refused(tmp_path, f"{option} = {word}\n[{task}]\nEnabled = Always\n")
        assert f"mine.ini:3: error: {task}: {option}: [General] has {word!r}, which is not a number" in text
    hull = "[Simulators.VSIM]\nEnabled = Always\n[VSIM/Model/hull]\nType = ASV\nMass = heavy\n"
    assert "mine.ini:8: error: Simulators.VSIM: " in refused(tmp_path, f"Vehicle Type = hull\n{hull}")
    text = refused(tmp_path, f"Vehicle Type = Hull\n{hull.replace('heavy', '3')}")
    words = "no section [VSIM/Model/Hull] describes this vehicle (did you mean 'hull'?)"
    assert f"mine.ini:3: error: Simulators.VSIM: Vehicle Type: {words}" in text


def test_a_module_that_does_not_import_is_an_error_that_names_it(tmp_path, monkeypatch):
    (tmp_path / "broken_task_module.py").write_text("import no_such_library\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert "no_such_library" in refused(tmp_path, "[broken_task_module.Broken]\nEnabled = Always\n")


@pytest.mark.parametrize("section", ["runtime.task.task.Task", "os.path", "imc.Message", "..x.Y", "subprocess.Popen"])
def test_a_section_cannot_name_what_is_no_task(tmp_path, section):
    assert f"error: [{section}] is not a task" in refused(tmp_path, f"[{section}]\nEnabled = Always\n")


def test_attributes_of_the_ini_redeclare_a_parameter(tmp_path):
    vehicle = made(
        tmp_path, "[Simulators.GPS]\nEnabled=Always\nHDOP {scope: plan, visibility: user, editable: false} = 1.5\n"
    ).vehicle
    parameter = vehicle.task("Simulators.GPS").parameter_set.find("HDOP")
    assert (parameter.scope, parameter.visibility, parameter.editable) == ("plan", "user", False)
    assert vehicle.task("Simulators.GPS").parameters()["HDOP"].editable
    vehicle.close()


def test_the_effective_configuration_has_seed_and_modes(tmp_path):
    build = made(tmp_path, "Seed = 12\n")
    assert build.vehicle.seed == 12
    build.vehicle.close()
    build = made(tmp_path, "Seed = 12\n", seed=5)
    assert build.vehicle.seed == 5
    assert "Seed = 5" in build.vehicle.profile.dump()
    assert "Selected = Simulation" in build.vehicle.profile.dump()
    build.vehicle.close()
    assert "'twelve' is not a seed" in refused(tmp_path, "Seed = twelve\n")


def test_processes_of_a_vehicle_agree_on_ids_and_a_later_task_changes_none(tmp_path):
    sections = [f"[Simulators.GPS/{n}]\nEnabled = {'Simulation' if n % 2 else 'Payload'}\n" for n in range(120)]
    profile = "[Profiles]\nPayload = x\n" + "".join(sections)
    ids = {}
    for selected in ("Simulation", "Payload"):
        vehicle = made(tmp_path, profile, [selected]).vehicle
        ids |= {entity.label: entity.id for entity in vehicle.entities}
        vehicle.close()
    assert len(ids) == len(set(ids.values())) == 121
    vehicle = made(tmp_path, profile + "[Simulators.AIS]\nEnabled=Always\n[Simulators.IMU]\nEnabled=Always\n").vehicle
    assert {entity.label: entity.id for entity in vehicle.entities if entity.label in ids}.items() <= ids.items()
    vehicle.close()


def test_the_effective_configuration_gives_the_same_ids_again(tmp_path):
    text = "".join(f"[Simulators.GPS/{n}]\nEnabled=Always\n" for n in reversed(range(60)))
    vehicle = made(tmp_path, text).vehicle
    ids = {entity.label: entity.id for entity in vehicle.entities}
    (tmp_path / "again.ini").write_text(vehicle.profile.dump())
    vehicle.close()
    profile = load_profile(tmp_path / "again.ini")
    again = build(profile, ["Simulation"], clock=VirtualClock(0), log_root=tmp_path).vehicle
    assert {entity.label: entity.id for entity in again.entities} == ids
    again.close()
    assert "cannot be the id of 'GPS'" in refused(tmp_path, "[Entity Ids]\nGPS = 300\n")


def test_saved_parameters_are_read_back_by_the_next_run(tmp_path):
    text = "[Simulators.GPS]\nEnabled=Always\nEntity Label=GPS\n"
    vehicle = made(tmp_path, text, state_folder=tmp_path / "db").vehicle
    wish = imc.SetEntityParameters(name="GPS", params=(imc.EntityParameter(name="HDOP", value="2.5"),))
    vehicle.start()
    vehicle.kernel.after(1.0, vehicle.task("Simulators.GPS").publish, wish)
    vehicle.kernel.after(2.0, vehicle.task("Simulators.GPS").publish, imc.SaveEntityParameters(name="GPS"))
    vehicle.run(3.0)
    assert vehicle.profile.options("Simulators.GPS")["HDOP"] == "2.5"
    vehicle.close()
    assert "HDOP = 2.5" in (tmp_path / "db" / "mine-saved.ini").read_text()
    again = load_profile(tmp_path / "mine.ini", saved=tmp_path / "db")
    assert again.options("Simulators.GPS")["HDOP"] == "2.5"


def test_what_prevents_that_parameters_are_saved_is_reported_without_numbers_of_errors(tmp_path):
    (tmp_path / "db").write_text("a file where the folder should be")
    vehicle = made(
        tmp_path, "[Simulators.GPS]\nEnabled=Always\nEntity Label=GPS\n", state_folder=tmp_path / "db"
    ).vehicle
    told = []
    vehicle.observe(imc.LogBookEntry, lambda entry: told.append(entry.text))
    vehicle.start()
    vehicle.kernel.after(1.0, vehicle.task("Simulators.GPS").publish, imc.SaveEntityParameters(name="GPS"))
    vehicle.run(2.0)
    vehicle.close()
    assert f"parameters of GPS not saved: {tmp_path / 'db'}: {FILE_EXISTS}" in told


@pytest.mark.parametrize("value", ["a;b", "a\nb", "x" * 70_000, "a#b", "a|b"])
def test_texts_that_an_ini_cannot_carry_are_refused_over_the_bus(tmp_path, value):
    vehicle = made(tmp_path, "[Transports.Replay]\nEnabled=Always\nEntity Label=Replay\n").vehicle
    wish = imc.SetEntityParameters(
        name="Replay", params=(imc.EntityParameter(name="Replay Messages", value=value[:60_000]),)
    )
    vehicle.start()
    vehicle.kernel.after(1.0, vehicle.daemon.publish, wish.replace(src=0x4001))
    vehicle.run(3.0)
    assert "Replay Messages" not in vehicle.profile.options("Transports.Replay")
    vehicle.close()


def test_options_that_are_no_parameter_are_said_in_the_log_with_the_nearest_name(tmp_path):
    text = "[Simulators.GPS]\nEnabled = Always\nHDPO = 2\nExecution Priority = 10\n"
    vehicle = made(tmp_path, text).vehicle
    said = []
    vehicle.observe(imc.LogBookEntry, said.append)
    vehicle.start()
    vehicle.run(1.0)
    vehicle.close()
    assert [entry.text for entry in said] == ["mine.ini:5: 'HDPO' is not a parameter; did you mean 'HDOP'?"]
    assert said[0].context == "Simulators.GPS"


def test_a_value_on_the_command_line_for_a_section_that_is_not_there_is_refused(tmp_path):
    (tmp_path / "mine.ini").write_text("[General]\nVehicle = mine\n[Simulators.GPS]\nEnabled = Always\n")
    for section in ("Simulators.GSP", "SimulatorsGPS"):
        with pytest.raises(ProfileError, match=rf"no section \[{section}\] \(did you mean 'Simulators.GPS'"):
            load_profile(tmp_path / "mine.ini", overrides=[f"{section}:HDOP=2", "Zenoh:Mode=peer"])


CARELESS = '''"""A task that cannot be made."""

from runtime import Task


class Careless(Task):
    """Fails in configure()."""

    def configure(self):
        self.table = {}["no such key"]
'''


def test_an_error_in_configure_names_the_section_and_the_place_in_the_code(tmp_path, monkeypatch):
    (tmp_path / "careless.py").write_text(CARELESS)
    monkeypatch.syspath_prepend(tmp_path)
    text = refused(tmp_path, "[careless.Careless]\nEnabled = Always\n")
    assert "mine.ini:3: error: careless.Careless: KeyError: 'no such key' (careless.py:10 in configure)" in text


@pytest.mark.parametrize(
    ("code", "words"),
    [("raise SystemExit(3)", "SystemExit(3)"), ("1 / 0", "ZeroDivisionError"), ("a b", "SyntaxError")],
)
def test_a_package_of_ones_own_that_fails_is_an_error_that_names_it(tmp_path, monkeypatch, code, words):
    name = f"failing_package_{words[:3].lower()}"
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text(code + "\n")
    (tmp_path / name / "mine.py").write_text("from runtime import Task\n")
    monkeypatch.syspath_prepend(tmp_path)
    text = refused(tmp_path, f"[{name}.mine.Mine]\nEnabled = Always\n")
    assert words in text
    assert f"{name}.mine" in text


def test_modules_of_sections_that_do_not_run_are_left_alone(tmp_path, monkeypatch):
    (tmp_path / "untouched.py").write_text("raise SystemExit('imported')\n")
    monkeypatch.syspath_prepend(tmp_path)
    text = "[untouched.A]\nEnabled = Never\n[untouched.B]\nEnabled = Hardware\n[untouched.C]\nValue = 1\n"
    build = made(tmp_path, text)
    assert build.skipped == {}
    build.vehicle.close()
    problems = check_profile(load_profile(tmp_path / "mine.ini"), {}, ["Simulation"], find_task)
    assert [p.text for p in problems if "untouched.A" in p.text] == []
    assert any("untouched.B" in p.text and "SystemExit" in p.text for p in problems)


def test_the_class_that_all_tasks_derive_from_is_no_task(tmp_path, monkeypatch):
    (tmp_path / "own_module.py").write_text("from runtime import Task\n")
    monkeypatch.syspath_prepend(tmp_path)
    text = refused(tmp_path, "[own_module.Task]\nEnabled = Always\n")
    assert "error: [own_module.Task] is not a task" in text
