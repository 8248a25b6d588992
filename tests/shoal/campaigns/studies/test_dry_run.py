"""Values that the scenario of a study cannot have are refused before the first run, at the line of the distribution."""

import pytest

from shoal.campaigns import load_study
from shoal.campaigns.study_execution import run_study

SCENARIO = """\
vehicle:
  profile: lauv-noptilus-1
  modes: Kinematic
  parameters: {Control.Path.VectorField: {Corridor -- Width: 2.5}}
world: {current: {north: 0}}
events:
  - {at: 1 s, silent: Simulators.GPS/Kinematic, for: 1 s}
expect:
  - {name: stays, always: SimulatedState.x < 3 m, from: 0 s, to: 2 s}
limit: 3 s
"""
GAINS = "vehicle/parameters/Control.AUV.Attitude/Heading PID Gains"


def load(folder, place, distribution, more="", scenario=SCENARIO):
    (folder / "calm.scenario.yaml").write_text(scenario)
    path = folder / "calm.study.yaml"
    path.write_text(f"scenario: calm.scenario.yaml\nvary:\n  {place}: {distribution}\n{more}")
    return load_study(path)


@pytest.mark.parametrize(
    ("place", "distribution", "more", "words"),
    [
        ("world/current/north", "{uniform: [0 kg, 1 kg]}", "", r"3: world/current/north = .*kg' is not a number"),
        (
            "events/0/for",
            "{uniform: [-3, -1]}",
            "",
            r"3: events/0/for = -[\d.]+ in run 0: .*calm.scenario.yaml:7: -.* is not a time",
        ),
        ("events/0/for", "{normal: [2, 1]}", "runs: 900", r"3: events/0/for = -[\d.]+ in run \d+: .* truncated: "),
        (
            "events/0/for",
            "{uniform: [-0.01, 9]}",
            "search: {minimize: margin}",
            "3: events/0/for = -0.01: .* not a time",
        ),
        ("events/0/at", "{choice: [1 s, 2 s, -1 s]}", "", r"3: events/0/at = -1.0 s in run \d+: "),
        (
            f"{GAINS}/0",
            "{uniform: [1, 2]}",
            "",
            r"3: .*; that of the profile is parameters: {Control.*Gains: \[1.5, 0, 0",
        ),
        (f"{GAINS}/x", "{uniform: [1, 2]}", "", "3: .* is no value of the scenario"),
        (
            "vehicle/parameters/Simulators.GPS/Kinematic/Number of Satellites",
            "{uniform: [1, 2]}",
            "",
            "is not an integer .expects in",
        ),
    ],
)
def test_it_is_refused(tmp_path, place, distribution, more, words):
    with pytest.raises(ValueError, match=rf"calm\.study\.yaml:{words}" if words[0] == "3" else words):
        load(tmp_path, place, distribution, more)


def test_what_is_never_drawn_does_not_matter(tmp_path):
    assert load(tmp_path, "events/0/for", "{normal: [20, 2]}", "runs: 900").stopping_rule.max_runs == 900


def test_values_that_do_not_go_together_are_a_failed_row_with_the_reason(tmp_path):
    both = "  expect/0/to: {uniform: [0.5, 2.5]}\nruns: 3\nseed: 7\n"
    data = run_study(load(tmp_path, "expect/0/from", "{uniform: [0, 2]}", both), tmp_path / "runs", workers=0)
    wrong = [row for row in data.counted_rows if row["values.expect/0/from"] > row["values.expect/0/to"]]
    assert wrong
    for row in data.counted_rows:
        assert (row in wrong) == ("calm.scenario.yaml:9: ends before it begins" in row["error"])
        assert not (row in wrong and row["passed"])


@pytest.mark.parametrize("more", ["runs: 100\n", "search: {minimize: margin}\n"])
def test_values_that_only_sometimes_go_together_are_no_mistake(tmp_path, more):
    """Some starts are later than the end of the scenario, and later than that of the first run."""
    wide = "  expect/0/to: {uniform: [1.5, 2.5]}\nseed: 6\n"
    study = load(tmp_path, "expect/0/from", "{uniform: [0, 2.3]}", wide + more)
    firsts = study.scenario_values(0)
    assert firsts["expect/0/from"] > firsts["expect/0/to"]


def test_a_scenario_that_is_wrong_as_it_is_blames_no_value(tmp_path):
    wrong = SCENARIO.replace("Kinematic, for", "Kinematic, fro")
    with pytest.raises(ValueError, match=r"^[^:]*calm\.scenario\.yaml:7: unknown key 'fro'"):
        load(tmp_path, "vehicle/seed", "{integer: [1, 3]}", scenario=wrong)
    with pytest.raises(ValueError, match=r"^[^:]*calm\.scenario\.yaml:7: there is no task 'Simulators.GBS"):
        load(tmp_path, "events/0/for", "{uniform: [1, 3]}", scenario=SCENARIO.replace("GPS", "GBS"))
