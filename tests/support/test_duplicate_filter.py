"""A copy counts once."""

from support.duplicate_filter import DuplicateFilter


def test_the_last_packets_are_remembered() -> None:
    recent = DuplicateFilter(3)
    found = [recent.is_duplicate(data) for data in (b"a", b"b", b"a", b"c", b"d", b"a")]
    assert found == [False, False, True, False, False, False]


def test_what_comes_again_later_is_no_copy() -> None:
    recent = DuplicateFilter(2, 0.5)
    assert [recent.is_duplicate(("order", 1), now) for now in (10.0, 10.4, 10.5, 10.9)] == [False, True, False, True]
    assert not recent.is_duplicate(("order", 2), 10.9)
    assert not recent.is_duplicate(("order", 3), 10.9)
    assert not recent.is_duplicate(("order", 1), 10.9), "two later ones have taken its place"
