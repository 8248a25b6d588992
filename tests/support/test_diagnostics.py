"""Errors of files name the place first, and keep it apart from the reason."""

import pickle

import pytest

from support.diagnostics import LocatedError, Origin
from support.located_yaml import parse_yaml_tree


def test_an_error_begins_with_its_place():
    with pytest.raises(LocatedError) as error:
        parse_yaml_tree("a: 1\nb: 2", "pool.yaml").mapping("a")
    assert error.value.where == "pool.yaml:2"
    assert error.value.reason == "unknown key 'b' (known: a)"
    assert str(error.value) == "pool.yaml:2: unknown key 'b' (known: a)"


def test_an_error_without_a_place_is_its_reason():
    assert str(LocatedError("nothing is there")) == "nothing is there"


def test_an_error_passes_between_processes():
    error = LocatedError("is not a number", Origin("pool.yaml", 3))
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.where, copy.reason) == (str(error), "pool.yaml:3", "is not a number")
