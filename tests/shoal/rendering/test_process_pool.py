"""Several processes do what is to be done, each thing once."""

import os
from contextlib import closing
from functools import partial
from operator import truediv

import pytest

from shoal.rendering.process_pool import IndexedWork, RenderPool


@pytest.mark.heavy
def test_all_is_done_once_by_whoever_has_time():
    with closing(RenderPool(2)) as crew:
        assert sorted(crew.run(IndexedWork(hex, 500))) == sorted(map(hex, range(500)))


@pytest.mark.heavy
def test_helpers_do_their_share():
    names = set()
    with closing(RenderPool(1)) as crew:
        for name in crew.run(IndexedWork(_name, 10**9)):
            names.add(name)
            if len(names) == 2:
                break
    assert os.getpid() in names


def test_what_goes_wrong_is_raised():
    with closing(RenderPool(1)) as crew, pytest.raises(ZeroDivisionError):
        list(crew.run(IndexedWork(partial(truediv, 1.0), 5)))


def _name(number):
    return os.getpid()
