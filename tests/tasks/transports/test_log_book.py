"""The log book on request."""

import imc
from runtime import Task
from runtime.testing import simulate
from tasks.transports.log_book import LONGEST_REPLY, LogBook

CONSOLE, VEHICLE = 0x4000, 0x001A
Command = imc.LogBookControl.Command
Type = imc.LogBookEntry.Type


class Talker(Task):
    """Writes much into the log book."""

    def start(self) -> None:
        for number in range(200):
            self.log.info(f"{number} " + "ü" * 500)


def get(time=0.5, command=Command.GET, **fields):
    return imc.LogBookControl(command=command, src=CONSOLE, dst=VEHICLE, timestamp=time, **fields)


def entry(text, time, kind=Type.INFO):
    return imc.LogBookEntry(type=kind, htime=time, text=text, context="Somebody", timestamp=time)


def test_a_reply_has_the_latest_entries_that_fit():
    (reply,) = simulate([LogBook, Talker], [get()]).of(imc.LogBookControl)
    texts = [item.text.split(" ")[0] for item in reply.msg]
    assert texts[-1] == "199"
    assert texts == [str(number) for number in range(200 - len(texts), 200)]
    assert LONGEST_REPLY - 1100 < len(imc.encode(reply)) < LONGEST_REPLY + 100


def test_entries_since_a_time_and_errors_alone():
    book = [entry("one", 0.1), entry("two", 0.2, Type.ERROR), entry("three", 0.3, Type.CRITICAL), entry("4", 0.4, 77)]
    feed = [*book, get(), get(htime=0.2), get(command=Command.GET_ERR), get(command=Command.GET_ERR, htime=0.25)]
    replies = simulate(LogBook, feed).of(imc.LogBookControl)
    assert [[item.text for item in reply.msg] for reply in replies] == [
        ["one", "two", "three", "4"],
        ["two", "three", "4"],
        ["two", "three"],
        ["three"],
    ]
    assert {reply.dst for reply in replies} == {CONSOLE}


def test_only_the_latest_entries_are_kept():
    feed = [entry(str(number), 0.001 * number) for number in range(1, 20)]
    (reply,) = simulate(LogBook, [*feed, get()], maximum_entries=3).of(imc.LogBookControl)
    assert [item.text for item in reply.msg] == ["17", "18", "19"]


def test_replies_are_fewer_than_the_questions_of_a_flood():
    run = simulate(LogBook, [entry("one", 0.0), *(get(0.0001 * i) for i in range(1, 1000))])
    assert 10 < len(run.of(imc.LogBookControl)) < 40
