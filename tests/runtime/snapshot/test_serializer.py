"""The values of tasks that a snapshot keeps."""

import math
from collections import Counter, deque
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from runtime import State
from runtime.snapshot import load, restore, take_snapshot
from runtime.snapshot.serializer import StateReader, StateWriter
from tests.runtime.snapshot.keeper import Box, Pair, keeper, through

VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(), st.binary()),
    lambda inner: st.one_of(
        st.lists(inner), st.dictionaries(st.one_of(st.text(), st.integers()), inner), st.lists(inner).map(tuple)
    ),
    max_leaves=8,
)


@pytest.mark.heavy
@given(VALUES)
def test_plain_values_come_back(value: object) -> None:
    writer, reader = StateWriter(lambda _: None), StateReader(lambda _: None)
    plain = msgspec.msgpack.decode(msgspec.msgpack.encode(writer.to_plain_value(value, "here")))
    assert reader.from_plain_value(plain) == value
    assert type(reader.from_plain_value(plain)) is type(value)


@pytest.mark.parametrize(
    "value",
    [
        Counter(a=2),
        deque([1, 2], maxlen=2),
        {1, 2},
        frozenset({(1, "ü")}),
        Pair(1, "x"),
        State.FAULT,
        imc.GpsFix(lat=0.1, hacc=1.1, timestamp=5.0, src=3),
        imc.MsgList(msgs=(imc.Heartbeat(), None)),
        imc.Unknown(id=9999, payload=b"abc"),
        imc.EstimatedState,
        Path("a/b"),
        2**100,
        "\udcff",
        math.inf,
    ],
    ids=repr,
)
def test_values_of_tasks_come_back(value: object) -> None:
    back = through(value).items
    assert back == value
    assert type(back) is type(value)


def test_arrays_and_random_numbers_come_back() -> None:
    image, random = np.arange(6, dtype=np.uint8).reshape(2, 3), np.random.default_rng(7)
    random.random()
    back_image, back_random, number = through([image, random, np.float32(1.5)]).items
    assert (back_image == image).all()
    assert back_image.dtype == image.dtype
    assert back_random.random() == random.random()
    assert number == np.float32(1.5)


def test_what_is_shared_stays_shared() -> None:
    shared = [1]
    first, second, box = through([shared, shared, Box(shared)]).items
    assert first is second is box.value
    assert box.me is box


def test_what_belongs_to_the_vehicle_is_the_vehicles() -> None:
    vehicle = keeper()
    task: Any = vehicle.task("Keeper")
    vehicle.close()
    items = through([task, task.entity]).items
    assert items[0].items is items
    assert items[1] is items[0].entity


def test_timers_go_on_also_those_that_a_task_holds() -> None:
    vehicle = keeper()
    vehicle.start()
    vehicle.run(1.0)
    again = keeper(vehicle.kernel.now_ns)
    restore(again, load(take_snapshot(vehicle)))
    task: Any = again.task("Keeper")
    assert (task.later.function, task.later.args) == (task.say, ("late", 3))
    assert task.over.function is None
    heard: list[str] = []
    again.observe(imc.LogBookEntry, lambda entry: heard.append(entry.text))
    again.run(0.9)
    assert heard == []
    again.run(0.2)
    assert [text[:6] for text in heard] == ["late 3"]
    assert task.count == 7
    vehicle.close()
    again.close()
