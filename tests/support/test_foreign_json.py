"""JSON of other programs."""

import pytest

from support.foreign_json import load_json


def test_a_name_that_occurs_twice_is_an_error_and_not_its_last_value():
    assert load_json('{"a": {"b": 1}, "b": 2}') == {"a": {"b": 1}, "b": 2}
    with pytest.raises(ValueError, match="'b' occurs twice in an object"):
        load_json('[{"a": {"b": 1, "b": 2}}]')
