"""Scenario files that include others, and variants of one file."""

import pytest

from shoal.cli.options import parse_values
from shoal.scenarios import ScenarioFileError, load_document, run

BASE = """\
scenario: base
vehicle: {profile: otter, plan: plans/there.yaml, parameters: {Simulators.GPS: {HACC: 3}}}
limit: 60 s
world: {current: {north: 0.1, east: 0.2}}
events:
  - {name: outage, at: 20 s, silent: Simulators.GPS, for: 5 s}
expect:
  - {name: shallow, always: SimulatedState.z < 5 m}
  - {name: fixes, always: age(GpsFix) < 3 s}
metrics:
  drift: {max: 'distance(SimulatedState, EstimatedState)'}
"""
PLAN = "plan: there\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\ndepth: 0 m\nmaneuvers: [{goto: {north: 30}}]\n"
OWN = """\
include: lib/base.yaml
world: {current: {north: 0.4}}
events:
  - {at: 30 s, drain: 40 %}
expect:
  - {name: fixes, always: age(GpsFix) < 9 s}
  - {name: accurate, metric: drift, at most: 5 m}
variants:
  calm: {world: {current: null}, limit: 50 s}
  storm:
    world: {current: {north: 0.9 m/s}}
    vehicle: {parameters: {Simulators.GPS: {HACC: 8 m}}}
    events:
      - {at: 3 s, every: 2 s, times: 3, set: {Simulators.GPS: {HACC: 9}}, for: 1 s}
"""


@pytest.fixture
def own(tmp_path):
    """A scenario that includes one in another folder."""
    (tmp_path / "lib" / "plans").mkdir(parents=True)
    (tmp_path / "lib" / "base.yaml").write_text(BASE)
    (tmp_path / "lib" / "plans" / "there.yaml").write_text(PLAN)
    path = tmp_path / "own.scenario.yaml"
    path.write_text(OWN)
    return path


def settings(scenario):
    return {f"{s.section}:{s.option}": s.value for s in scenario.vehicles[0].settings}


def test_a_file_says_what_differs_from_the_one_that_it_includes(own):
    scenario = load_document(own).scenario()
    assert scenario.name == "own"
    assert [event.timing.at for event in scenario.events] == [20.0, 30.0]
    assert [expected.name for expected in scenario.expectations] == ["shallow", "fixes", "accurate"]
    assert scenario.expectations[1].condition.text == "age(GpsFix) < 9 s"
    assert scenario.expectations[1].origin == f"{own}:6"
    assert scenario.expectations[0].origin == f"{own.parent}/lib/base.yaml:8"
    assert scenario.vehicles[0].plan.plan_id == "there"
    found = settings(scenario)
    assert found["Simulators.StreamVelocity:Default Speed North"] == "0.4"
    assert found["Simulators.StreamVelocity:Default Speed East"] == "0.2"


def test_variants_are_merged_by_the_same_rule(own):
    document = load_document(own)
    assert document.variant_names == ["calm", "storm"]
    calm, storm = (document.scenario({"variant": name}) for name in document.variant_names)
    assert (calm.name, storm.name) == ("own [calm]", "own [storm]")
    assert not any("StreamVelocity" in key for key in settings(calm))
    assert calm.limit == 50.0
    assert settings(storm)["Simulators.StreamVelocity:Default Speed North"] == "0.9"
    assert settings(storm)["Simulators.GPS:HACC"] == "8.0"
    assert len(storm.events) == 3
    assert document.scenario({"variant": "storm", "world/current/north": 0.6}).vehicles[0].settings[0].value == "0.6"
    changed = document.scenario({"variant": "storm", "variants/storm/world/current/north": 0.7})
    assert changed.vehicles[0].settings[0].value == "0.7"


@pytest.mark.heavy
def test_a_variant_may_have_a_number_as_name(own):
    own.write_text(OWN.replace("  calm:", "  2:").replace("  storm:", "  1.50:"))
    document = load_document(own)
    assert document.variant_names == ["2", "1.50"]
    for text, name in (("2", "2"), ("1.50", "1.50"), ("'2'", "2")):
        given = parse_values([f"variant={text}"])
        assert document.scenario(given).name == f"own [{name}]", "as the command says that repeats a run"
    assert document.scenario({"variant": 2}).name == "own [2]", "of a study"


def test_a_variant_runs_on_a_shipped_profile(own):
    result = run(load_document(own).scenario({"variant": "storm"}))
    assert not result.error
    assert result.passed, result.verdicts
    assert result.metrics["drift"] > 0.0


def test_a_file_may_choose_its_variant(own):
    own.write_text(OWN + "variant: calm\n")
    document = load_document(own)
    assert document.variant_names == []
    assert document.scenario().name == "own [calm]"
    assert document.scenario({"variant": "storm"}).name == "own [storm]"
    assert document.scenario({"variant": ""}).name == "own"


def test_what_is_included_is_a_source_and_part_of_the_digest(own):
    document = load_document(own)
    base = own.parent / "lib" / "base.yaml"
    assert {base, own.parent / "lib" / "plans" / "there.yaml"} <= document.dependencies().files
    before = document.digest
    assert load_document(own).digest == before
    base.write_text(BASE.replace("< 5 m", "< 4 m"))
    assert load_document(own).digest != before


def test_a_changed_tree_stands_alone(own, tmp_path):
    from shoal.campaigns.search.export import write_scenario

    folder = tmp_path / "found" / "here"
    folder.mkdir(parents=True)
    path = write_scenario(own, {"variant": "storm", "world/current/east": 0.3}, folder, ["found by a test"])
    assert "include" not in path.read_text()
    scenario = load_document(path).scenario()
    assert settings(scenario) == settings(load_document(own).scenario({"variant": "storm", "world/current/east": 0.3}))
    assert scenario.vehicles[0].plan.plan_id == "there"


def test_includes_of_includes_and_several(own):
    lib = own.parent / "lib"
    (lib / "faults.yaml").write_text("include: more/leak.yaml\nevents: [{at: 9 s, abort: true}]\nseed: 5\n")
    (lib / "more").mkdir()
    (lib / "more" / "leak.yaml").write_text("events: [{at: 7 s, drain: 20 %}]\n")
    own.write_text(OWN.replace("lib/base.yaml", "[lib/base.yaml, lib/faults.yaml]"))
    document = load_document(own)
    scenario = document.scenario()
    assert [event.timing.at for event in scenario.events] == [20.0, 7.0, 9.0, 30.0]
    assert scenario.seed == 5
    assert {path.name for path in document.included_files} == {"base.yaml", "leak.yaml", "faults.yaml"}


@pytest.mark.parametrize(
    ("old", "new", "where", "reason"),
    [
        ("lib/base.yaml", "lib/bse.yaml", "own.scenario.yaml:1", "no file 'lib/bse.yaml'"),
        ("lib/base.yaml", "own.scenario.yaml", "own.scenario.yaml:1", "own.scenario.yaml includes itself"),
        ("lib/base.yaml", "lib", "own.scenario.yaml:1", "there is no file 'lib'"),
        ("lib/base.yaml", "{a: b}", "own.scenario.yaml:1", "expected text"),
        ("  storm:", "  sto rm:", "own.scenario.yaml:10", "'sto rm' cannot be the name of a variant"),
        ("calm: {world", "calm: {wold", "own.scenario.yaml:9", "unknown key 'wold' (did you mean 'world'?)"),
        ("calm: {", "calm: {variant: storm, ", "own.scenario.yaml:9", "belongs to the file, not to a variant"),
        ("variants:", "variant: clm\nvariants:", "own.scenario.yaml:8", "no variant 'clm' (did you mean 'calm'?)"),
        ("    events:\n", "    events: 3\n    expect:\n", "own.scenario.yaml:15", "expected one of metric"),
    ],
)
def test_mistakes_are_reported_with_file_and_line(own, old, new, where, reason):
    own.write_text(OWN.replace(old, new))

    def load_all():
        document = load_document(own)
        for name in document.variant_names or [None]:
            document.scenario({"variant": name} if name else {})

    with pytest.raises(ScenarioFileError) as caught:
        load_all()
    assert f"{where}: " in str(caught.value)
    assert reason in str(caught.value)


def test_a_mistake_in_an_included_file_names_that_file(own):
    (own.parent / "lib" / "base.yaml").write_text(BASE.replace("SimulatedState.z <", "SimulatedState.qq <"))
    with pytest.raises(ScenarioFileError, match=r"lib/base.yaml:8: .*has no numeric field 'qq'"):
        load_document(own).scenario()
    (own.parent / "lib" / "base.yaml").write_text("include: ../own.scenario.yaml\n")
    with pytest.raises(ScenarioFileError, match=r"lib/base.yaml:1: .*includes itself, by way of others"):
        load_document(own)


def test_variants_and_includes_are_named_if_there_are_none(document):
    with pytest.raises(ScenarioFileError, match="has no variants"):
        document().scenario({"variant": "storm"})
    with pytest.raises(ScenarioFileError, match="include is not a value"):
        document().scenario({"include": "a.yaml"})
