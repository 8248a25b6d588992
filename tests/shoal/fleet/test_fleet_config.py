"""What a fleet file says: names, ids, ports, start positions and seeds, none of them twice."""

import math
import re
from pathlib import Path

import pytest

from mavlink import SYSTEMS, mavlink_system_id
from runtime.profile import load_profile
from runtime.vehicle import check_profile, find_task
from shoal.fleet import FleetConfig, FleetFileError, load_fleet
from shoal.fleet.ports import port_overrides, shift_link
from support.diagnostics import ProfileError
from tests.shoal.fleet.settings import option, setting

FLEET = """
name: leixoes
per_process: 4
seed: 7
spacing: 30
start: [41.2, -8.7]
vehicles:
  - name: lauv-{number}
    count: 10
  - name: lauv-noptilus-1
  - name: otter
    count: 2
    profile: otter
    start: [41.3, -8.8]
    modes: Simulation
    set: ["Simulators.GPS:Number of Satellites=7"]
"""


def roster(folder: Path, text: str) -> FleetConfig:
    file = folder / "fleet.yaml"
    file.write_text(text)
    return load_fleet(file)


def test_nothing_of_two_vehicles_is_the_same(tmp_path: Path) -> None:
    made = roster(tmp_path, FLEET)
    members = made.vehicles
    assert [member.name for member in members[-3:]] == ["lauv-noptilus-1", "otter-1", "otter-2"]
    assert [len(crew) for crew in made.process_groups] == [4, 4, 4, 1]
    for values in (
        [member.system for member in members],
        [member.seed for member in members],
        [option(member, "Initial Position") for member in members],
        [setting(member, "Transports.MAVLink", "Links") for member in members],
        [setting(member, "Transports.UDP", "Local Port") for member in members],
        [setting(member, "Transports.TCP.Server", "Port") for member in members],
        [setting(member, "Transports.FTP", "Control Port") for member in members],
    ):
        assert len(set(values)) == len(members)
    assert members[10].system == 0x001A, "the id of its name"
    assert "IMC Addresses:lauv-3=" in " ".join(members[0].overrides), "all know the names of all"


def test_vehicles_start_in_rows_from_west_to_east(tmp_path: Path) -> None:
    made = roster(tmp_path, FLEET)
    places = [tuple(map(float, option(member, "Initial Position").split(","))) for member in made.vehicles]
    assert places[0] == pytest.approx((41.2, -8.7), abs=1e-7)
    meter = math.degrees(1 / 6378137)
    assert places[1][1] - places[0][1] == pytest.approx(30 * meter / math.cos(math.radians(41.2)), rel=0.01)
    assert places[10][0] - places[0][0] == pytest.approx(30 * meter, rel=0.01), "the second row"
    assert places[-2] == pytest.approx((41.3, -8.8), abs=1e-7), "a place of its own"
    assert places[-1][1] - places[-2][1] == pytest.approx(30 * meter / math.cos(math.radians(41.3)), rel=0.01)


GROUPS = """
spacing: 29
vehicles:
  - {name: a, count: 2, start: [41.2, -8.7]}
  - {name: b, start: [41.2, -8.69964]}
"""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (GROUPS, r"fleet.yaml:5: a-2 and b start 1\.\d m apart, at least 5 m are needed"),
        ("spacing: 1\nvehicles: [{name: a, count: 2}]\n", "a-1 and a-2 start 1.0 m apart"),
        (
            "set: ['Simulators.GPS:HDPO=1']\nvehicles: [{name: a}]\n",
            r"fleet.yaml:1: set: .*'HDPO'.*did you mean 'HDOP'",
        ),
        (
            "vehicles:\n- name: a\n  set:\n  - Simulators.GPS:Nonsense=1\n",
            r"fleet.yaml:4: vehicles\[0\].set: .*'Nonsense'",
        ),
        ("set: ['General:Nonsense=1']\nvehicles: [{name: a}]\n", r"set: \[General\] has no option 'Nonsense'"),
        ("vehicles: [{name: a, set: ['Simulators.VSIM:Initial Position=inf, 0']}]\n", "Initial Position"),
        ("vehicles: [{name: a, set: ['Simulators.VSIM:Initial Position=nan, 0']}]\n", "Initial Position"),
        ("vehicles: [{name: a}]\nhear: [Abort, Annonce]\n", "fleet.yaml:2: hear: there is no message 'Annonce'"),
    ],
)
def test_what_the_file_sets_is_checked_as_in_a_scenario(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(FleetFileError, match=reason):
        roster(tmp_path, text)


def test_the_settings_of_each_member_are_valid(tmp_path: Path) -> None:
    for member in roster(tmp_path, FLEET).vehicles[-3:]:
        profile = load_profile(member.profile, [tmp_path], vehicle=member.name, overrides=member.overrides)
        problems = check_profile(profile, {}, profile.parse_modes(member.modes), find_task)
        assert [p for p in problems if p.severity == "error"] == []
        assert profile.system_id == member.system
        assert "Zenoh:Hear=Abort, Announce" in member.overrides


@pytest.mark.heavy
def test_ids_that_follow_from_names_do_not_clash(tmp_path: Path) -> None:
    members = roster(tmp_path, "vehicles: [{name: 'v-{number}', count: 600}]").vehicles
    assert len({member.system for member in members}) == 600
    assert all(0xA000 <= member.system < 0xC000 for member in members)


def test_only_ports_at_which_a_vehicle_listens_are_moved() -> None:
    profile = load_profile("lauv-noptilus-1")
    assert port_overrides(profile, 0) == []
    (links,) = [text for text in port_overrides(profile, 2) if ":Links=" in text]
    assert "udpin://127.0.0.1:14571" in links
    assert "udpout://127.0.0.1:14550" in links, "the ground station stays where it is"


@pytest.mark.parametrize(
    ("link", "moved"),
    [
        ("udpin:127.0.0.1:14551:px4", "udpin:127.0.0.1:14571:px4"),
        ("udpin://127.0.0.1:14551?flavor=px4", "udpin://127.0.0.1:14571?flavor=px4"),
        ("tcpin://", "tcpin://:5780"),
        ("tcpin://[::1]?key=/etc/key", "tcpin://[::1]:5780?key=/etc/key"),
        ("udpin://:14550", "udpin://:14570"),
        *[(link, link) for link in ("udpbcast://10.0.0.255:14550", "tcpout://a", "serial:///dev/ttyS0", "wrong", "")],
    ],
)
def test_only_links_that_listen_are_moved(link: str, moved: str) -> None:
    assert shift_link(link, 2) == moved


def test_numbers_may_be_words_and_words_numbers(tmp_path: Path) -> None:
    text = "vehicles: [{name: 12}]\nzenoh: {Local Port: 17447}\nspacing: 1e3\nstagger: 0.5\nstart: null"
    made = roster(tmp_path, text)
    assert [member.name for member in made.vehicles] == ["12"]
    assert (made.zenoh, made.stagger) == ({"Local Port": "17447"}, 0.5)


def test_what_a_profile_warns_of_is_passed_on_once(tmp_path: Path) -> None:
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[Simulators.GPS]\nNumber of Satelites = 7\n")
    made = roster(tmp_path, 'profile: mine\nvehicles:\n  - {name: "a-{number}", count: 3}\n')
    assert [warning.text.partition(" ")[0] for warning in made.warnings] == ["[Simulators.GPS]"]
    assert "mine.ini:3: warning" in str(made.warnings[0])


@pytest.mark.heavy
def test_no_two_vehicles_have_one_mavlink_id(tmp_path: Path) -> None:
    """The ids that follow from the names of ten vehicles are eight MAVLink ids."""
    members = roster(tmp_path, "vehicles: [{name: 'lauv-{number}', count: 240}, {name: lauv-noptilus-1}]").vehicles
    assert len({mavlink_system_id(member.system) for member in members[:10]}) == 8
    given = [setting(member, "Transports.MAVLink", "System Id") for member in members]
    ids = [int(text or 0) or mavlink_system_id(member.system) for text, member in zip(given, members, strict=True)]
    assert len(set(ids)) == len(members)
    assert set(ids) <= set(range(1, SYSTEMS + 1))


def test_one_mavlink_id_for_two_vehicles_is_refused_with_both_names_and_the_option(tmp_path: Path) -> None:
    given = 'set: ["Transports.MAVLink:System Id=7"]'
    both = f"vehicles:\n  - name: a\n    {given}\n  - name: b\n    {given}\n  - name: c\n"
    with pytest.raises(FleetFileError) as refused:
        roster(tmp_path, both)
    words = "fleet.yaml:5: a and b have the same MAVLink id 7 (set [Transports.MAVLink] System Id of one of them"
    assert words in str(refused.value)
    with pytest.raises(FleetFileError, match=r"a-1 and a-2 have the same MAVLink id 7"):
        roster(tmp_path, f"vehicles:\n  - name: a\n    count: 3\n    {given}\n")
    with pytest.raises(FleetFileError, match=r"lauv-noptilus-1 and b have the same MAVLink id 26"):
        roster(tmp_path, "vehicles: [{name: lauv-noptilus-1}, {name: b, set: ['Transports.MAVLink:System Id=26']}]")
    silent = both.replace("Id=7", "Id=7, Transports.MAVLink:Enabled=Never".replace(", ", '", "'), 1)
    assert len(roster(tmp_path, silent).vehicles) == 3


@pytest.mark.heavy
def test_vehicles_for_which_no_mavlink_id_is_left_do_not_speak_it(tmp_path: Path) -> None:
    made = roster(tmp_path, "vehicles: [{name: 'v-{number}', count: 252}]")
    silent = [member.name for member in made.vehicles if "Transports.MAVLink:Enabled=Never" in member.overrides]
    assert silent == ["v-251", "v-252"]
    assert "MAVLink has 250 ids: it is off in v-251, v-252, 2 of the 252 vehicles" in str(made.warnings[-1])
    quiet = roster(tmp_path, "vehicles: [{name: a, count: 2}]\nset: ['Transports.MAVLink:Enabled=Never']")
    assert not any("MAVLink" in str(warning) for warning in quiet.warnings)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "fleet.yaml:1: the file is empty"),
        ("vehicles: []", "fleet.yaml:1: vehicles: expected a list that is not empty"),
        ("vehicels: [{name: a}]", "fleet.yaml:1: unknown key 'vehicels' (did you mean 'vehicles'?)"),
        ("name: m\nvehicles:\n  - name: a\n    cuont: 2", "unknown key 'cuont' (did you mean 'count'?)"),
        ("name: m", "'vehicles' is missing"),
        ("vehicles: [{name: a}, {name: a}]", "two vehicles are called 'a'"),
        ("vehicles: [{name: a}]\nname: x\nname: y", "fleet.yaml:3: 'name' occurs twice"),
        ("vehicles: [{name: 'a b'}]", "'a b' is not a name"),
        (f"vehicles: [{{name: {'a' * 65}}}]", "is not a name"),
        ("vehicles:\n  - name: a\n    count: no", "fleet.yaml:3: vehicles[0].count: expected a whole number, not text"),
        ("vehicles: [{name: a}]\nper_process: 0", "fleet.yaml:2: per_process: expected a whole number not below 1"),
        ("vehicles: [{name: a}]\nrestart: always", "'always' is not one of on-failure, never"),
        ("vehicles: [{name: a}]\nstagger: soon", "fleet.yaml:2: stagger: 'soon' is not a duration"),
        ("vehicles: [{name: a}]\nspacing: inf", "spacing: expected a number not above"),
        ("vehicles: [{name: a}]\nstart: [nan, 3]", "start[0]: expected a number not below -90"),
        ("vehicles: [{name: a}]\nstart: [41, 500]", "start[1]: expected a number not above 180"),
        (
            "vehicles:\n  - name: a\n  - name: b\n    profile: submarine",
            "fleet.yaml:4: vehicles[1].profile: there is no profile 'submarine'",
        ),
        ("vehicles: [{name: a}]\nprofile: ./no.ini", "fleet.yaml:2: profile: ./no.ini: there is no such file"),
        (
            "vehicles:\n  - name: a\n    modes: Simulaton",
            "fleet.yaml:3: vehicles[0].modes: unknown mode 'Simulaton' (did",
        ),
        (
            "vehicles: [{name: a}]\nmodes: Simulation, Kine",
            "fleet.yaml:2: modes: Simulation, Kine: unknown mode 'Kine'",
        ),
        ("vehicles: [{name: a, set: nonsense}]", "set: expected a list, not text"),
        ("vehicles: [{name: a, set: [nonsense]}]", "fleet.yaml: error: 'nonsense': it must be Section:Option=value"),
        ("vehicles: [{name: a, set: ['Foo:Bar=1']}]", "fleet.yaml: error: there is no section [Foo]"),
        ("vehicles: [{name: a, set: ['nowhere.Task:Enabled=Always']}]", "[nowhere.Task] is not a task"),
        ("vehicles: [{name: a}]\nzenoh: {Mode: peer}", "fleet.yaml:2: zenoh: Mode cannot be set"),
        ("vehicles: [{name: a}]\nzenoh: {Local Port: 0}", "fleet.yaml:2: zenoh: Local Port cannot be 0"),
        ("vehicles: [{name: a}]\nzenoh: {Lisen: x}", "fleet.yaml:2: [Zenoh] Lisen: unknown option"),
        ("vehicles: [", "not YAML"),
        ("- a", "fleet.yaml:1: expected a mapping, not a list"),
    ],
)
def test_a_mistake_is_named_with_file_and_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises((FleetFileError, ProfileError), match=re.escape(words)):
        roster(tmp_path, text)
