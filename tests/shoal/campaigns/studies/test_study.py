"""Studies: what varies is written in files, and drawn from seed, name and run alone."""

import math

import numpy as np
import pytest

from shoal.campaigns.sampling.design import SamplingDesign, hashed_uniform, run_seed
from shoal.campaigns.sampling.distributions import StudyFileError, parse_distribution
from shoal.campaigns.studies.study import load_study
from support.located_yaml import parse_yaml_tree
from tests.shoal.campaigns.standin import STUDY, StandInDraft, write_study


def made(text):
    return parse_distribution(parse_yaml_tree(text, "s.yaml", StudyFileError))


def load(path, **options):
    return load_study(path, make_draft=StandInDraft, **options)


SHARES = [(i + 0.5) / 20_000 for i in range(20_000)]


@pytest.mark.parametrize(
    ("text", "mean", "deviation", "low", "high"),
    [
        ("{uniform: [1, 3]}", 2.0, 2 / math.sqrt(12), 1, 3),
        ("{uniform: {from: 1, to: 3}}", 2.0, 2 / math.sqrt(12), 1, 3),
        ("{normal: [2, 0.5]}", 2.0, 0.5, -2, 6),
        ("{truncated: {mean: 0, deviation: 1, from: -1, to: 1}}", 0.0, 0.5396, -1, 1),
        ("{triangular: [0, 0, 3]}", 1.0, 3 / math.sqrt(18), 0, 3),
        ("{log uniform: [0.1, 10]}", 9.9 / math.log(100), 2.4969, 0.1, 10),
        ("{integer: [1, 6]}", 3.5, math.sqrt(35 / 12), 1, 6),
        ("{choice: {1: 3, 5: 1}}", 2.0, math.sqrt(3), 1, 5),
        ("{scipy: weibull_min, c: 2, scale: 0.3}", 0.3 * math.gamma(1.5), 0.139, 0, 2),
    ],
)
def test_a_distribution_has_its_mean_deviation_and_support(text, mean, deviation, low, high):
    values = np.array(made(text).quantiles(SHARES), float)
    assert values.mean() == pytest.approx(mean, abs=2e-3)
    assert values.std() == pytest.approx(deviation, rel=5e-3)
    assert values.min() >= low
    assert values.max() <= high


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{uniform: [3, 1]}", "this distribution has no values: 3 is not below 1"),
        ("{normal: [3, 0]}", "no values: the deviation 0 is not above 0"),
        ("{truncated: {mean: 0, deviation: 1, from: 6, to: 5}}", "no values: 6 is not below 5"),
        ("{choice: []}", "no values: the list is empty"),
        ("{choice: {a: 0, b: 0}}", "no values: expected weights"),
        ("{choice: {a: -1, b: 2}}", "no values: expected weights"),
        ("{triangular: [0, 5, 3]}", "no values"),
        ("{log uniform: [0, 3]}", "no values"),
        ("{uniform: [1 m, 3 s]}", "need one unit, not 'm', 's'"),
        ("{uniform: [1, 2, 3]}", "expected 2 numbers: from, to"),
        ("{uniform: [1, inf]}", "'inf' is not a number"),
        ("{integer: [1, 2.5]}", "expected two integers"),
        ("{grid: {from: 0, to: 1, steps: 1}}", "steps"),
        ("{unifrom: [1, 2]}", "there is no distribution 'unifrom' (did you mean 'uniform'?)"),
        ("{scipy: gama, a: 2}", "did you mean 'gamma'?"),
        ("{scipy: gamma}", "gamma needs a"),
        ("{scipy: gamma, a: -1}", "no values"),
        ("{scipy: gamma, a: 1, scael: 2}", "did you mean 'scale'?"),
    ],
)
def test_a_distribution_that_is_none_is_refused_with_its_line(text, words):
    with pytest.raises(StudyFileError) as caught:
        made(f"\n{text}")
    assert words in str(caught.value)
    assert str(caught.value).startswith("s.yaml:2: ")


def test_a_unit_stays_with_the_number():
    drawn = made("{uniform: [0 m/s, 0.5 m/s]}")
    assert drawn.append_unit(drawn.quantiles([0.5])[0]) == "0.25 m/s"
    assert made("{choice: [on, 3]}").levels == (True, 3)
    assert made("{choice: [10 %, 20 %]}").append_unit(10.0) == "10.0 %"


def test_draws_depend_on_seed_name_and_run_alone(tmp_path):
    both = load(write_study(tmp_path))
    one = load(write_study(tmp_path, STUDY.replace("  world/current/north: {normal: [0, 0.5]}\n", "")))
    longer = load(write_study(tmp_path, STUDY.replace("40", "4000")))
    other = load(write_study(tmp_path, STUDY.replace("seed: 5", "seed: 6")))
    east = "world/current/east"
    for run in (0, 7, 39, 1500):
        assert both.scenario_values(run)[east] == one.scenario_values(run)[east] == longer.scenario_values(run)[east]
        assert both.scenario_values(run)[east] != other.scenario_values(run)[east]
    assert both.digest == longer.digest
    assert len({one.digest, other.digest, both.digest}) == 3
    assert len({run_seed(5, run) for run in range(1000)}) == 1000


def test_draws_are_the_same_on_every_computer():
    assert hashed_uniform(7, "world/current/north", 412) == 0.8311128195352449
    assert run_seed(7, 412) == 1585402754


def test_a_latin_hypercube_has_one_run_in_each_stratum():
    design = SamplingDesign(
        {"a": made("{uniform: [0, 50]}"), "b": made("{uniform: [0, 50]}")}, "latin hypercube", 3, 50
    )
    for name in "ab":
        assert sorted(int(design.raw_values(run)[name]) for run in range(50)) == list(range(50))
    assert [design.raw_values(run)["a"] for run in range(50)] != [design.raw_values(run)["b"] for run in range(50)]


def test_sobol_numbers_fill_the_square_evenly_and_start_anywhere():
    varied = {"a": made("{uniform: [0, 1]}"), "b": made("{uniform: [0, 1]}")}
    design, late = SamplingDesign(varied, "sobol", 3, 0), SamplingDesign(varied, "sobol", 3, 0)
    points = [tuple(design.raw_values(run).values()) for run in range(2048)]
    cells = {(int(16 * a), int(16 * b)) for a, b in points[:256]}
    assert len(cells) == 256
    assert tuple(late.raw_values(2047).values()) == points[2047]
    assert tuple(SamplingDesign(varied, "sobol", 4, 0).raw_values(0).values()) != points[0]


def test_saltelli_changes_one_value_at_a_time():
    varied = {name: made("{uniform: [0, 1]}") for name in "abc"}
    design = SamplingDesign(varied, "saltelli", 3, 5 * 300)
    for block in (0, 250):  # one that spans two blocks of the table, too
        rows = [design.raw_values(5 * block + kind) for kind in range(5)]
        for kind, name in enumerate("abc", 1):
            assert rows[kind] == {**rows[0], name: rows[4][name]}
        assert not set(rows[0].values()) & set(rows[4].values())


def test_the_runs_of_a_block_of_saltelli_share_a_seed(tmp_path):
    study = load(write_study(tmp_path, STUDY.replace("runs: 40", "runs: 40\nsampling: saltelli")))
    seeds = [study.run_seed(run) for run in range(40)]
    assert [len(set(seeds[start : start + 4])) for start in range(0, 40, 4)] == [1] * 10
    assert len(set(seeds)) == 10


def test_a_grid_has_all_combinations(tmp_path):
    text = """\
scenario: dive.scenario.yaml
vary:
  world/current/north: {grid: {from: 0, to: 1, steps: 3}}
  vehicle/parameters/Simulators.GPS/HACC: {choice: [1, 2]}
sampling: grid
"""
    study = load(write_study(tmp_path, text))
    assert study.stopping_rule.max_runs == 6
    assert [tuple(study.scenario_values(run).values()) for run in range(6)] == [
        *((0.0, 1), (0.0, 2), (0.5, 1), (0.5, 2), (1.0, 1), (1.0, 2)),
    ]


def test_a_distribution_may_stand_in_place_of_a_value(tmp_path):
    inline = "scenario:\n  world: {current: {north: {uniform: [1, 2]}, east: 0}}\nruns: 3\n"
    study = load(write_study(tmp_path, inline))
    assert study.scenario_path == study.file
    assert 1.0 < study.scenario_values(2)["world/current/north"] < 2.0
    fixed = load(write_study(tmp_path, inline), fixed={"world/current/north": 1.5})
    assert fixed.scenario_values(2) == {"world/current/north": 1.5}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("runs: 40", "rusn: 40", "dive.study.yaml:5: unknown key 'rusn' (did you mean 'runs'?)"),
        ("current/east", "curent/east", ":4: world/curent/east is no value of the scenario (did you mean 'world/curr"),
        ("runs: 40", "study: ../../x", ":5: '../../x' cannot be the name of a study"),
        ("runs: 40", "study: /tmp/x", ":5: '/tmp/x' cannot be the name of a study"),
        ("runs: 40", "study: ..", ":5: '..' cannot be the name of a study"),
        ("runs: 40", "runs: 0", ":5: expected 1 to 10000000 runs"),
        ("runs: 40", "runs: 40\nsampling: latin", ":6: sampling: unknown 'latin'"),
        ("runs: 40", "runs: 40\nsampling: grid", ":6: sampling: grid needs values to choose from"),
        ("runs: 40", "runs: 40\nsampling: saltelli", "a multiple of 4 runs"),
        ("runs: 40", "runs: 41\nsampling: saltelli", ":5: sampling: saltelli of 2 values needs a multiple of 4 runs"),
        ("runs: 40", "runs: 40\nuntil: {pass rate known to: 1 %}", ":6: runs and until exclude each other"),
        ("runs: 40", "until: {pass rate known to: 0 %}", ":5: expected a percentage above 0 %"),
        ("runs: 40", "until: {at most: 3}", "'pass rate known to' is missing"),
        ("runs: 40", "until: {pass rate known to: 1 %}\nsampling: sobol", ":5: sampling: sobol needs a number of runs"),
        ("runs: 40", "until: {pass rate known to: 1 %}\nsampling: latin hypercube", "needs a number of runs"),
        ("dive.scenario", "dvie.scenario", ":1: there is no file 'dvie.scenario.yaml' (did you mean 'dive.scenario"),
        ("scenario: dive.scenario.yaml\n", "", "'scenario' is missing"),
    ],
)
def test_mistakes_are_named_with_their_line(tmp_path, old, new, words):
    if words == "a multiple of 4 runs":
        assert load(write_study(tmp_path, STUDY.replace(old, new))).stopping_rule.max_runs == 40
        return
    with pytest.raises(StudyFileError) as caught:
        load(write_study(tmp_path, STUDY.replace(old, new)))
    assert words in str(caught.value)


def test_until_has_defaults(tmp_path):
    text = STUDY.replace("runs: 40", "until: {pass rate known to: 2 %, at most: 500, confidence: 99 %}")
    ending = load(write_study(tmp_path, text)).stopping_rule
    assert (ending.max_runs, ending.target_width, ending.confidence) == (500, 0.02, 0.99)
