"""Frames that wait for a slow viewer: all answers, and the newest messages."""

import asyncio

import pytest

from shoal.console.foxglove.viewer_queue import MOST_ANSWER_BYTES, MOST_ANSWERS, MOST_BYTES, MOST_MESSAGES, ViewerQueue


def taken(queue, number):
    async def take():
        return [await asyncio.wait_for(queue.next(), 1.0) for _ in range(number)]

    return asyncio.run(take())


def test_the_oldest_messages_are_dropped_and_counted():
    queue = ViewerQueue()
    for number in range(MOST_MESSAGES + 5):
        queue.put_message(number.to_bytes(4, "big"))
    assert queue.dropped == 5
    assert taken(queue, 1) == [(5).to_bytes(4, "big")]


def test_large_messages_are_limited_by_their_bytes_but_one_always_fits():
    queue = ViewerQueue()
    for _ in range(4):
        queue.put_message(bytes(MOST_BYTES // 2))
    assert queue.dropped == 2
    queue.put_message(bytes(MOST_BYTES * 2))
    assert queue.dropped == 4
    assert [len(frame) for frame in taken(queue, 1)] == [MOST_BYTES * 2]
    queue.put_message(b"x")
    assert (queue.dropped, taken(queue, 1)) == (4, [b"x"])


def test_answers_go_first_and_none_is_dropped():
    queue = ViewerQueue()
    queue.put_message(b"message")
    for number in range(MOST_ANSWERS):
        queue.put_answer(str(number))
    assert not queue.is_overrun
    assert taken(queue, MOST_ANSWERS + 1) == [*map(str, range(MOST_ANSWERS)), b"message"]


def test_a_viewer_that_takes_no_answers_is_overrun():
    queue = ViewerQueue()
    for _ in range(MOST_ANSWERS + 1):
        queue.put_answer("x")
    assert queue.is_overrun
    assert taken(queue, 1) == [None]


def test_who_waits_is_woken():
    queue = ViewerQueue()

    async def take():
        waiting = asyncio.create_task(queue.next())
        await asyncio.sleep(0)
        queue.put_message(b"x")
        return await asyncio.wait_for(waiting, 1.0)

    assert asyncio.run(take()) == b"x"


@pytest.mark.parametrize("size", [0, 1])
def test_the_size_of_what_was_taken_counts_no_more(size):
    queue = ViewerQueue()
    for _ in range(10):
        queue.put_message(bytes(MOST_BYTES - size))
        taken(queue, 1)
    assert queue.dropped == 0


def test_answers_are_limited_by_their_bytes():
    queue = ViewerQueue()
    queue.put_answer("x" * MOST_ANSWER_BYTES)
    assert not queue.is_overrun
    assert [len(frame) for frame in taken(queue, 1)] == [MOST_ANSWER_BYTES]
    queue.put_answer("x")
    queue.put_answer("x" * MOST_ANSWER_BYTES)
    assert queue.is_overrun
