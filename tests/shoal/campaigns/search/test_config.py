"""What a search can be told, and what it writes: axes, mistakes in files, trees of YAML."""

import json

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from shoal.campaigns.sampling.distributions import StudyFileError, parse_distribution
from shoal.campaigns.search.export import to_yaml
from shoal.campaigns.search.search_space import change_size, make_axis
from shoal.campaigns.studies.study import load_study
from shoal.scenarios import ScenarioFileError
from support.located_yaml import parse_yaml_tree
from tests.shoal.campaigns.search.slope import SCENARIO, STUDY, write

TEXTS = st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=12)
TREES = st.recursive(
    TEXTS | st.integers() | st.floats(allow_nan=False) | st.booleans(),
    lambda below: st.lists(below, max_size=4) | st.dictionaries(TEXTS.filter(bool), below, max_size=4),
    max_leaves=12,
)


@pytest.mark.parametrize(
    ("text", "low", "high", "ordered"),
    [
        ("{uniform: [1, 3]}", 1.0, 3.0, True),
        ("{normal: [0, 1]}", -3.0902, 3.0902, True),
        ("{log uniform: [0.001, 10]}", 0.001, 10.0, True),
        ("{scipy: weibull_min, c: 2, scale: 1}", 0.0, 2.6283, True),
        ("{integer: [-2, 2]}", -2, 2, True),
        ("{choice: [1, 5]}", 1, 5, True),
        ("{choice: {low: 1, no: 0, high: 2}}", "low", "high", False),
        ("{choice: [true, false]}", True, False, False),
    ],
)
def test_it_goes_from_one_end_of_a_distribution_to_the_other(text, low, high, ordered):
    axis = make_axis("x", parse_distribution(parse_yaml_tree(text, "s.yaml", StudyFileError)), None)
    assert axis.levels[0] == pytest.approx(low, abs=1e-4)
    assert axis.levels[-1] == pytest.approx(high, abs=1e-4)
    assert axis.is_ordered is ordered
    assert all(axis.value_at(axis.position_of(cell)) == cell for cell in axis.levels)
    assert "no" not in axis.levels


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("margin of stays", "margin of stay"), r"l:6: the scenario has no expectation 'stay'.*'margin of stays'"),
        (("margin of stays", "metrics.fare"), r"l:6: the scenario has no metric 'metrics.fare'.*'metrics.far'"),
        (
            ("margin of stays", "margins.stays"),
            r"l:6: the scenario has no margin or metric 'margins.stays'",
        ),
        (("minimize", "minimum"), r"l:6: search: unknown key 'minimum'.*'minimize'"),
        (("shrink: 40", "minimise: margin"), r"l:6: search: minimise and minimize are the same: write minimize only"),
        (("minimize: margin of stays, ", ""), r"l:6: a search has either minimize or maximize"),
        (("shrink: 40", "maximize: margin"), r"l:6: a search has either minimize or maximize"),
        (("shrink: 40", "shrink: -1"), r"l:6: shrink: expected 0 to 100000, not -1"),
        (
            ("minimize: margin of stays", "maximize: margin"),
            r"l:6: shrink has no effect: only a search for the smallest",
        ),
        (("minimize: margin of stays", "minimize: metrics.far"), r"l:6: shrink has no effect"),
        (("shrink: 40", "at a time: 0"), r"l:6: at a time: expected 1 to 1000, not 0"),
        (("shrink: 40", "of: pass"), r"l:6: of: expected all or passed, not 'pass'.*'passed'"),
        (("shrink: 40", "of: passed"), r"l:6: a run that passes has no margin that fails"),
        (("runs: 30", "until: {pass rate known to: 1 %}"), r"l:7: search and until exclude each other"),
        (("runs: 30", "sampling: saltelli"), r"l:7: search and sampling exclude each other"),
        (("integer: [1, 9]", "grid: [1, 9]"), r"l:5: .*HACC: a search chooses values itself: .* instead of grid"),
        (("integer: [1, 9]", "choice: [3]"), r"l:5: .*HACC: a search needs two values at least"),
        (("search: {minimize: margin of stays, shrink: 40}", "search: margin"), r"l:6: expected a mapping"),
    ],
)
def test_a_search_that_makes_no_sense_is_refused_at_its_line(tmp_path, change, words):
    path = write(tmp_path, STUDY.replace(*change))
    with pytest.raises((StudyFileError, ScenarioFileError), match=words):
        load_study(path)


@pytest.mark.parametrize(("old", "new"), [("minimise", "minimize"), ("maximise", "maximize")])
def test_a_british_key_works_and_is_reported_with_its_line(tmp_path, old, new):
    current = load_study(write(tmp_path, STUDY.replace("minimize: margin of stays, shrink: 40", f"{new}: metrics.far")))
    found = load_study(write(tmp_path, STUDY.replace("minimize: margin of stays, shrink: 40", f"{old}: metrics.far")))
    assert found.search.objective == current.search.objective
    assert found.digest == current.digest, "a campaign begun with the old key is resumed with the new one"
    assert current.search.deprecations == ()
    (text,) = found.search.deprecations
    assert text.endswith(f"l:6: search: {old} is deprecated: write {new}")


def test_a_search_of_nothing_is_refused(tmp_path):
    text = "scenario: dive.scenario.yaml\nsearch: {minimize: margin}\n"
    with pytest.raises(StudyFileError, match="l:2: a search needs something to vary"):
        load_study(write(tmp_path, text))
    bare = SCENARIO[: SCENARIO.index("expect:")] + "limit: 20 s\n"
    with pytest.raises(StudyFileError, match="l:6: the scenario expects nothing, so it has no margin"):
        load_study(write(tmp_path, STUDY.replace("margin of stays", "margin"), bare))


@pytest.mark.heavy
@given(st.dictionaries(TEXTS.filter(bool), TREES, min_size=1, max_size=4))
def test_any_tree_reads_as_it_was_written(values):
    text = json.dumps(values, ensure_ascii=False)
    tree = parse_yaml_tree(text, "s.yaml")
    again = parse_yaml_tree(to_yaml(tree), "s.yaml")
    assert again.value() == tree.value()
    assert yaml.safe_load(to_yaml(tree)) == yaml.safe_load(text)  # YAML 1.1, for which 5e-324 is a text


def test_fewer_changes_are_smaller_than_short_ones():
    axes = {"x": {"default": 0.0, "span": 2.0}, "y": {"default": None, "span": None}}
    assert change_size({"x": 1.0}, axes) == (1, 0.5)
    assert change_size({"x": 1.0}, axes) < change_size({"y": "b"}, axes) < change_size({"x": 0.1, "y": "b"}, axes)
