"""YAML with lines: types as YAML has them, and what is refused."""

import datetime

import pytest

from support.diagnostics import LocatedError
from support.located_yaml import parse_yaml_tree

TEXT = """
name: pool
count: 3
ratio: 1.5e-3
flag: yes
nothing: ~
day: 2026-01-01
quoted: "3"
items: [1, two, {three: 3}]
small: 1e-3
beyond: 1e309
"1e3": "1e3"
"""


class Refused(LocatedError):
    """What the caller wants to be raised."""


def test_values_have_the_types_of_yaml():
    tree = parse_yaml_tree(TEXT, "pool.yaml", Refused)
    assert tree.value() == {
        "name": "pool",
        "count": 3,
        "ratio": 0.0015,
        "small": "1e-3",
        "beyond": "1e309",
        "1e3": "1e3",
        "flag": True,
        "nothing": None,
        "day": datetime.date(2026, 1, 1),
        "quoted": "3",
        "items": [1, "two", {"three": 3}],
    }


def test_nodes_know_their_lines():
    tree = parse_yaml_tree(TEXT, "pool.yaml", Refused)
    nodes = tree.mapping()
    assert [nodes[name].line for name in ("name", "day", "items")] == [2, 7, 9]
    with pytest.raises(Refused, match=r"^pool\.yaml:3: too few$"):
        nodes["count"].fail("too few")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: 1\na: 2", "f:2: 'a' occurs twice"),
        ("a: &x 1\nb: *x", "f:1: anchors and aliases"),
        ("a: !!python/name:os.system", "f:1: tags such as"),
        ("a: [1", "f:[12]: not YAML"),
        ("a:\n\tb: 1", "f:2: not YAML: .*; indent with spaces, not tabs"),
        ("", "f:1: the file is empty"),
        ("a: 1\n---\nb: 2", "f:1: expected one YAML document, not several"),
        ("a: @b", "f:1: not YAML: [^;]*$"),
        ("[" * 30 + "]" * 30, "f:1: nested too deeply"),
        ("a: 1\nb: " + "[" * 5000, "f:2: nested too deeply"),
        ("a: 1\nb: " + "{x: [" * 5000, "f:2: nested too deeply"),
        ("- " * 5000, "f:1: nested too deeply"),
        ("- [" + "'['," * 20 + '"[\\"[",' * 20 + "@", "f:1: not YAML"),
    ],
)
def test_what_is_refused(text, reason):
    with pytest.raises(Refused, match=reason):
        parse_yaml_tree(text, "f", Refused)


def test_an_integer_beyond_any_float_is_named_with_its_line():
    tree = parse_yaml_tree("a: 1\nb: 1" + 400 * "0", "f", Refused).mapping()
    with pytest.raises(Refused, match=r"f:2: .* is not a value"):
        tree["b"].value()
    with pytest.raises(Refused, match=r"f:2: .* too large a number"):
        tree["b"].number()


def test_a_date_that_is_none_is_named_with_its_line():
    with pytest.raises(Refused, match="f:2: '2026-13-41' is not a value"):
        parse_yaml_tree("a: 1\nb: 2026-13-41", "f", Refused).value()
