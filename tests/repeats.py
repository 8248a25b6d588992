"""Cases that repeat what others of the same test show: marked `campaign`, which `.ci/campaigns` runs."""

from collections.abc import Collection, Iterable

import pytest


def all_but(kept: Collection[object], cases: Iterable[object]) -> list[object]:
    """The cases for `pytest.mark.parametrize`, in their order: those that are not in `kept` are marked `campaign`.

    ValueError if one of `kept` is no case.
    """
    cases = list(cases)
    if unknown := [each for each in kept if each not in cases]:
        raise ValueError(f"no cases: {unknown}")
    return [case if case in kept else repeat(case) for case in cases]


def repeat(case: object) -> object:
    """One case, a tuple if it has several values, marked `campaign`."""
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.campaign)
