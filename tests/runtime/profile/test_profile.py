"""Profiles: where they are found, their contents, and how they are written back."""

from pathlib import Path
from typing import Any

import pytest
from fastcrc import crc16
from hypothesis import given
from hypothesis import strategies as st

from runtime.profile import (
    Profile,
    available_profiles,
    default_label,
    derived_id,
    find_profile,
    format_sections,
    load_profile,
    own_etc,
    read_config,
    search_path,
)
from support.diagnostics import ProfileError

TREE = Path(__file__).parents[2] / "data/profiles"
MANTARAY = TREE / "lauv-mantaray-7.ini"


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SHOAL_ETC", str(tmp_path / "user"))


def profile(text: str, name: str = "auv.ini", **options: Any) -> Profile:
    Path(name).write_text(text)
    return load_profile(Path(name), **options)


def values(profile: Profile) -> dict[str, dict[str, str]]:
    return {name: {o.name: o.value for o in s.options.values()} for name, s in profile.config.sections.items()}


def test_a_tree_in_the_manner_of_dune() -> None:
    mantaray = load_profile("lauv-mantaray-7", [TREE])
    assert [Path(file).relative_to(TREE).as_posix() for file in mantaray.config.files] == [
        "lauv-mantaray-7.ini",
        "auv/basic.ini",
        "common/addresses.ini",
        "common/transports.ini",
        "common/numbers.ini",
        "auv/transports.ini",
        "common/transports.ini",
        "auv/simulator.ini",
        "hardware/box/basic.ini",
    ]
    assert (mantaray.name, mantaray.vehicle, mantaray.system_id) == ("lauv-mantaray-7", "lauv-mantaray-7", 0x1F)
    assert mantaray.systems == {"lauv-mantaray-7": 0x1F, "ccu-harbor": 16417}
    assert values(mantaray)["Transports.Speaker"] == {
        "Enabled": "Always",
        "Entity Label": "Speaker",
        "Transports": "EstimatedState,  Abort, Temperature, VehicleState, Salinity, SoundSpeed",
        "Local Port": "6002",
        "Filtered Entities": "Temperature:CTD+Depth Sensor, Voltage:Batteries",
    }
    swimmer = mantaray.config.sections["Simulators.Swimmer"].options
    assert swimmer["Drag"].value == "-2.4, -23.0, -23.0, -0.3, -9.7, -9.7"
    assert swimmer["Initial Position"].value == "41.18, -8.70"
    assert swimmer["Seed"].value == "42"
    assert swimmer["Active"].attributes == {"scope": "maneuver", "visibility": "user"}
    assert mantaray.config.value("General", "Absolute Maximum Depth") == "40"
    assert [str(p) for p in mantaray.file_problems if "not-everybody" not in p.text] == []
    assert [problem.line for problem in mantaray.file_problems] == [6]
    again = Profile(MANTARAY, parse_text(mantaray.dump()))
    assert values(again) == values(mantaray)
    assert again.config.sections["Simulators.Swimmer"].options["Active"].attributes == swimmer["Active"].attributes
    assert not again.file_problems


def parse_text(text: str):
    Path("text.ini").write_text(text, encoding="utf-8", errors="surrogateescape")
    return read_config("text.ini")


def test_values_of_any_section() -> None:
    mantaray = load_profile("lauv-mantaray-7", [TREE])
    assert mantaray.value("Simulators.Swimmer", "Drag") == "-2.4, -23.0, -23.0, -0.3, -9.7, -9.7"
    assert mantaray.value("Simulators.Swimmer", "Unknown", "0.5") == "0.5"
    assert mantaray.value("Nowhere", "Unknown") == ""


def test_a_value_knows_who_had_the_last_word() -> None:
    depth = load_profile(MANTARAY).config.option("General", "Absolute Maximum Depth")
    assert depth is not None
    assert str(depth.origin) == f"{TREE / 'hardware/box/basic.ini'}:7"
    assert [str(origin) for origin in depth.overwritten_origins] == [f"{TREE / 'auv/basic.ini'}:9"]


def test_folders_are_searched_in_order(tmp_path: Path) -> None:
    for folder in ("given", ".", "etc", "user"):
        (tmp_path / folder).mkdir(exist_ok=True)
    expected = {Path("given"): "given/auv.ini", Path(): "auv.ini", Path("etc"): "etc/auv.ini"}
    assert search_path(["given"])[:4] == [*expected, tmp_path / "user"]
    assert search_path()[-1] == own_etc()
    for folder in reversed([*expected, Path("user")]):
        (folder / "auv.ini").touch()
        assert find_profile("auv", ["given"]) == (
            tmp_path / "user/auv.ini" if folder == Path("user") else folder / "auv.ini"
        )
    assert find_profile("auv.ini", ["given"]) == Path("auv.ini")
    Path("auv-saved.ini").touch()
    assert available_profiles(["given"])["auv"] == Path("given/auv.ini")
    assert "auv-saved" not in available_profiles()


def test_the_users_own_folder_follows_xdg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SHOAL_ETC")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))
    assert tmp_path / "xdg/shoal/etc" in search_path()
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert tmp_path / ".config/shoal/etc" in search_path()


def test_names_may_have_a_folder(tmp_path: Path) -> None:
    (tmp_path / "etc/development").mkdir(parents=True)
    (tmp_path / "etc/development/ais.ini").touch()
    assert find_profile("development/ais") == Path("etc/development/ais.ini")


@pytest.mark.parametrize(
    "name",
    [
        "../secret",
        "a/../../secret",
        "/etc/passwd",
        "/tmp/secret",
        "a\0b",
        "",
        ".",
        "..",
        "~/x",
        "a\\..\\b",
        "a\nb",
        "x" * 999,
    ],
)
def test_names_that_lead_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "etc").mkdir()
    (tmp_path / "secret.ini").write_text("[A]\n")
    with pytest.raises(ProfileError) as refused:
        find_profile(name, [tmp_path / "etc"])
    assert str(refused.value).replace("\n", "").isprintable()


def test_the_path_of_a_file_is_taken(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "mine.ini").write_text("[General]\n")
    for path in ("mine.ini", "sub/../mine.ini", str(tmp_path / "mine.ini"), tmp_path / "mine.ini"):
        assert load_profile(path).name == "mine"
    with pytest.raises(ProfileError, match="no such file"):
        load_profile("sub/mine.ini")


def test_an_unknown_name_says_the_nearest_and_where_it_was_looked_for(tmp_path: Path) -> None:
    Path("lauv-one.ini").touch()
    with pytest.raises(ProfileError, match=r"no profile 'lauv-onne' in .*user.* \(did you mean 'lauv-one'\?\)"):
        find_profile("lauv-onne")


def test_errors_are_all_said_at_once() -> None:
    with pytest.raises(ProfileError) as refused:
        profile("X = 1\n[A]\n| y\n[Require no.ini]\n[General]\nVehicle = ../x")
    assert [problem.line for problem in refused.value.problems] == [1, 3, 4, 6]
    assert "auv.ini:6: error: [General] Vehicle: '../x' cannot be the name of a vehicle" in str(refused.value)
    assert len(profile("X = 1\n[A]\nY = 1", strict=False).config.errors) == 1


@pytest.mark.parametrize("name", ["..", "a/b", "a\\b", "a:b", "x" * 101])
def test_a_vehicle_name_must_do_for_a_folder(name: str) -> None:
    with pytest.raises(ProfileError, match=r"auv\.ini:2: error: \[General\] Vehicle"):
        profile(f"[General]\nVehicle = {name}")


def test_vehicle_and_system() -> None:
    auv = profile("[General]\nVehicle = auv-x")
    assert auv.system_id == derived_id("auv-x") == 0xA000 | crc16.arc(b"auv-x") & 0x1FFF
    assert profile("[A]").vehicle == "auv"
    assert derived_id("") == derived_id("unknown") == 0xFFFF
    auv = profile("[General]\nVehicle = a\n[IMC Addresses]\na = 26\nb = 0x001B\nc = many\nd = 99999\n", vehicle="b")
    assert (auv.vehicle, auv.system_id, auv.systems) == ("b", 27, {"a": 26, "b": 27})


def test_modes() -> None:
    auv = profile(
        "[Profiles]\nTank = In the tank.\n[A.B]\nEnabled = Tank, Hardware\n[A.C]\nEnabled = Always\n[A.D]\nX = 1"
    )
    assert set(auv.selectable_modes) == {"Hardware", "Simulation", "Hardware/Simulation", "Tank"}
    assert auv.parse_modes("Tank, Simulation") == auv.parse_modes(["Tank", "Simulation"]) == {"Tank", "Simulation"}
    assert auv.parse_modes("") == frozenset()
    sections = ("A.B", "A.C", "A.D", "A.E")
    assert [auv.is_task_enabled(section, ["Hardware"]) for section in sections] == [True, True, False, False]
    assert [auv.is_task_enabled(section, ["Simulation"]) for section in sections] == [False, True, False, False]
    with pytest.raises(ProfileError, match=r"unknown mode 'simulation' \(did you mean 'Simulation'\?\)"):
        auv.parse_modes("simulation")


def test_tasks_come_in_the_order_of_bytes() -> None:
    auv = profile("[b.T]\nEnabled = Always\n[B.T/2]\nEnabled = Simulation\n[B.T]\nEnabled = Always\n[General]\nX = 1")
    names = [section.name for section in auv.config.sorted_sections()]
    assert [name for name in names if name != "General"] == ["B.T", "B.T/2", "b.T"]


def test_start_time() -> None:
    assert profile("[A]").start_time == 1767225600.0
    assert profile("[General]\nStart Time = 2026-03-01 12:00:00.5").start_time_ns == 1772366400_500_000_000
    assert profile("[General]\nStart Time = 2026-03-01T12:00:00+02:00").start_time == 1772359200
    assert profile("[General]\nStart Time = 2026-01-01T00:00:00.75Z").start_time == 1767225600.75
    for text in ("tomorrow", "1969-12-31", "2026-13-01", "0001-01-01T00:00:00+14:00"):
        with pytest.raises(ProfileError, match=r"auv\.ini:2: error: \[General\] Start Time: .*2026-01-01T00:00:00Z"):
            _ = profile(f"[General]\nStart Time = {text}").start_time


def test_bus() -> None:
    assert profile("[A]").bus_transport == "inprocess"
    assert profile("[General]\nBus = zenoh").bus_transport == "zenoh"
    with pytest.raises(ProfileError, match=r"auv\.ini:2: error: .*'Zeno'.*did you mean 'zenoh'"):
        _ = profile("[General]\nBus = Zeno").bus_transport


def test_overrides() -> None:
    auv = profile("[A.B/C]\nX = 1\n[A:B]\nZ = 1", overrides=["A.B/C:X=2 3", "new.Task:Enabled = Always", "A:B:Z=a:b=c"])
    assert values(auv) == {"A.B/C": {"X": "2 3"}, "A:B": {"Z": "a:b=c"}, "new.Task": {"Enabled": "Always"}}
    option = auv.config.option("A.B/C", "X")
    assert option is not None
    assert (str(option.origin), str(option.overwritten_origins[0])) == ("command line", "auv.ini:2")
    assert auv.options("new.Task") == {}
    auv.override("A.B/C:X=")
    assert auv.options("A.B/C") == {"X": ""}


@pytest.mark.parametrize(
    "text", ["", "A", "A:B", "A=B", ":B=1", "A:=1", "A:B=1;2", "A:B=1\n[C]", "A]:B=1", "A:[B=1", "A\nB:C=1"]
)
def test_what_is_no_override_is_refused(text: str) -> None:
    auv = profile("[A]\nB = 1")
    with pytest.raises(ProfileError, match="command line: error: "):
        auv.override(text)
    assert values(auv) == {"A": {"B": "1"}}


def test_saved_parameters_have_the_last_word_but_for_the_command_line(tmp_path: Path) -> None:
    text = "[General]\nVehicle = auv\n[A]\nX = 1\nY = 1\nZ = 1\n"
    Path("auv-saved.ini").write_text("[A]\nX = 2\nY = 2\nZ = 2\n")
    (tmp_path / "db").mkdir()
    (tmp_path / "db/auv-saved.ini").write_text("[A]\nY = 3\nZ = 3\n")
    auv = profile(text, name="auv.ini", saved=tmp_path / "db", overrides=["A:Z=4"])
    assert auv.options("A") == {"X": "2", "Y": "3", "Z": "4"}
    Path("auv-saved.ini").write_bytes(b"| garbage\n\0\n[A]\nX = 5\n")
    auv = profile(text)
    assert auv.options("A")["X"] == "5"
    assert {(p.severity, p.line) for p in auv.file_problems} == {("warning", 1), ("warning", 2)}


def test_the_effective_configuration_is_the_same_wherever_the_files_are(tmp_path: Path) -> None:
    text = "[b]\nX {scope: idle} = 1\n[B.C]\nL = a\nL+ = b\nE =\n[a]\nY = 2"
    (tmp_path / "other").mkdir()
    first, second = profile(text).dump(), profile(text, name="other/auv.ini").dump()
    assert first == second
    assert first == (
        "# The effective configuration of 'auv'.\n\n[B.C]\nE =\nL = a, b\n\n[a]\nY = 2\n\n[b]\nX {scope: idle} = 1\n"
    )


NAMES = st.text("ABab éŽ-./()0", min_size=1, max_size=12).map(str.strip).filter(bool)


@pytest.mark.heavy
@given(st.dictionaries(NAMES, st.dictionaries(NAMES, st.text("abc, 0.1=$({})", max_size=80).map(str.strip))))
def test_profiles_are_read_again_from_their_dump(
    tmp_path_factory: pytest.TempPathFactory, sections: dict[str, dict[str, str]]
) -> None:
    path = tmp_path_factory.getbasetemp() / "auv.ini"
    try:
        path.write_text(format_sections(sections), encoding="utf-8")
    except ValueError:
        return
    auv = Profile(path, read_config(path))
    assert not auv.file_problems
    dump = auv.dump()
    path.write_text(dump, encoding="utf-8")
    assert Profile(path, read_config(path)).dump() == dump
    assert values(Profile(path, read_config(path))) == sections


def test_default_labels() -> None:
    assert [default_label(name) for name in ("Simulators.GPS", "Simulators.IMU/AHRS", "my.own.Whistle", "Daemon")] == [
        "GPS",
        "IMU/AHRS",
        "Whistle",
        "Daemon",
    ]


def test_a_profile_of_ones_own_builds_on_shoals(tmp_path: Path) -> None:
    """A required file that is not in the same folder comes from Shoal's own profiles."""
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[General]\nVehicle = mine\n")
    profile = load_profile(tmp_path / "mine.ini")
    assert profile.vehicle == "mine"
    assert profile.is_task_enabled("Simulators.GPS", ["Simulation"])


def test_a_required_file_is_searched_in_the_folders_of_profiles_and_the_error_lists_them(tmp_path: Path) -> None:
    shared, mine = tmp_path / "shared", tmp_path / "mine"
    for folder in (shared / "common", mine):
        folder.mkdir(parents=True)
    (shared / "common" / "team.ini").write_text("[General]\nVehicle = lauv-team-1\n")
    (mine / "boat.ini").write_text("[Require lauv-noptilus-1.ini]\n[Require common/team.ini]\n")
    assert load_profile(mine / "boat.ini", [shared]).vehicle == "lauv-team-1"
    with pytest.raises(ProfileError, match=r"common/team\.ini cannot be read: .*; searched also in .*/etc, and it is"):
        load_profile(mine / "boat.ini")
