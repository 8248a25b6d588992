"""What a fleet file says: names, ids, ports, start positions and seeds, none of them twice."""

import math
from pathlib import Path

import pytest

from runtime.problem import ProfileError
from runtime.profile import load_profile
from runtime.vehicle import check, find_task
from shoal.fleet import Roster, load_roster
from shoal.fleet.ports import own_ports
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
  - name: otter-1
    profile: otter
    start: [41.3, -8.8]
    modes: Simulation
    set: ["Simulators.GPS:Number of Satellites=7"]
"""


def roster(folder: Path, text: str) -> Roster:
    file = folder / "fleet.yaml"
    file.write_text(text)
    return load_roster(file)


def test_nothing_of_two_vehicles_is_the_same(tmp_path: Path) -> None:
    made = roster(tmp_path, FLEET)
    members = made.members
    assert [member.name for member in members[-3:]] == ["lauv-10", "lauv-noptilus-1", "otter-1"]
    assert [len(crew) for crew in made.crews] == [4, 4, 4]
    for values in (
        [member.system for member in members],
        [member.seed for member in members],
        [option(member, "Initial Position") for member in members],
        [setting(member, "Transports.MAVLink", "Links") for member in members],
    ):
        assert len(set(values)) == len(members)
    assert members[10].system == 0x001A, "the id of its name"
    assert "IMC Addresses:lauv-3=" in " ".join(members[0].overrides), "all know the names of all"


def test_vehicles_start_in_rows_from_west_to_east(tmp_path: Path) -> None:
    made = roster(tmp_path, FLEET)
    places = [tuple(map(float, option(member, "Initial Position").split(","))) for member in made.members]
    assert places[0] == pytest.approx((41.2, -8.7), abs=1e-7)
    metre = math.degrees(1 / 6378137)
    assert places[1][1] - places[0][1] == pytest.approx(30 * metre / math.cos(math.radians(41.2)), rel=0.01)
    assert places[10][0] - places[0][0] == pytest.approx(30 * metre, rel=0.01), "the second row"
    assert places[-1] == pytest.approx((41.3, -8.8), abs=1e-7), "a place of its own"


def test_the_settings_of_each_member_are_valid(tmp_path: Path) -> None:
    for member in roster(tmp_path, FLEET).members[-3:]:
        profile = load_profile(member.profile, [tmp_path], vehicle=member.name, overrides=member.overrides)
        problems = check(profile, {}, profile.select(member.modes), find_task)
        assert [p for p in problems if p.severity == "error"] == []
        assert profile.system == member.system
        assert "Hear=Abort, Announce, Heartbeat" in " ".join(member.overrides)


def test_ids_that_follow_from_names_do_not_clash(tmp_path: Path) -> None:
    members = roster(tmp_path, "vehicles: [{name: 'v-{number}', count: 600}]").members
    assert len({member.system for member in members}) == 600
    assert all(0xA000 <= member.system < 0xC000 for member in members)


def test_only_ports_at_which_a_vehicle_listens_are_moved() -> None:
    profile = load_profile("lauv-noptilus-1")
    assert own_ports(profile, 0) == []
    (links,) = [text for text in own_ports(profile, 2) if ":Links=" in text]
    assert "udpin:127.0.0.1:14571:ardupilot" in links
    assert "udpout:127.0.0.1:14550:ardupilot" in links, "the ground station stays where it is"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("vehicles: []", "length >= 1"),
        ("vehicels: [{name: a}]", "did you mean 'vehicles'"),
        ("vehicles: [{name: a, cuont: 2}]", "did you mean 'count'"),
        ("vehicles: [{name: a}, {name: a}]", "two vehicles are called 'a'"),
        ("vehicles: [{name: 'a b'}]", "'a b' is not a name"),
        ("vehicles: [{name: a}]\nper_process: 0", "per_process"),
        ("vehicles: [{name: a}]\nrestart: always", "'always' is not one of on-failure, never"),
        ("vehicles: [{name: a}]\nstagger: soon", "stagger: 'soon' is not a duration"),
        ("vehicles: [{name: a, profile: submarine}]", "submarine"),
        ("vehicles: [", "no YAML"),
        ("- a", "Expected `object`"),
    ],
)
def test_a_mistake_is_named_with_the_file(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ProfileError, match=words) as caught:
        roster(tmp_path, text)
    assert "fleet.yaml" in str(caught.value) or "submarine" in words
