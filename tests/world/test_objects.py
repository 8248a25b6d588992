"""Where gliders lie."""

import pytest

from world.objects import parse_positions


def test_pairs_or_single_numbers():
    assert (
        parse_positions(["1.0 0.3", "25 -5"])
        == parse_positions(["1.0", "0.3", "25", "-5"])
        == ((1.0, 0.3), (25.0, -5.0))
    )
    assert parse_positions([]) == ()


@pytest.mark.parametrize(
    "texts", [["1"], ["1 2 3"], ["1 2 3 4"], ["1 2", "3"], ["1 2", ""], ["x y"], ["1 nan"], ["1 inf"]]
)
def test_anything_else_is_refused(texts):
    with pytest.raises(ValueError, match="expected north and east"):
        parse_positions(texts)
