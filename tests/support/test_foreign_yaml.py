"""YAML of other programs."""

import pytest
import yaml

from support.foreign_yaml import load_yaml


def test_mappings_that_are_merged_may_replace_keys_of_each_other():
    text = "inner:\n  one: &one {x: 1}\n  two: &two {<<: *one, x: 2}\nouter: {<<: *two, y: 3}\n"
    assert load_yaml(text) == yaml.safe_load(text)
    assert load_yaml(text)["inner"] == {"one": {"x": 1}, "two": {"x": 2}}


@pytest.mark.parametrize("text", ["x: 1\nx: 2\n", "a:\n- {x: 1, y: 2, x: 3}\n", "a: &a {x: 1, x: 2}\nb: *a\n"])
def test_a_key_that_occurs_twice_is_rejected_at_its_line(text: str):
    with pytest.raises(yaml.YAMLError, match=r"'x' occurs twice[\s\S]*line \d"):
        load_yaml(text)
