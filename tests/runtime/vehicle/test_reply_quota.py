"""Questions are answered as far as an asker has an allowance."""

import imc
from runtime import Task, consume
from runtime.testing import simulate
from runtime.vehicle.reply_quota import BURST, MOST_ASKERS, RATE, ReplyQuota

CONSOLE, OTHER = 0x4001, 0x4002


def test_an_asker_gets_a_burst_and_then_a_rate_and_others_keep_theirs() -> None:
    allowance = ReplyQuota()
    assert sum(allowance.try_acquire(CONSOLE, 1, 0.0) for _ in range(1000)) == BURST
    assert sum(allowance.try_acquire(CONSOLE, 1, 1.0) for _ in range(1000)) == RATE
    assert allowance.refused.drain() == {CONSOLE: 2000 - BURST - RATE}
    assert allowance.try_acquire(OTHER, 50, 1.0)
    assert allowance.try_acquire(CONSOLE, 10_000, 100.0), "more than a burst is granted to who has it whole"


def test_who_asks_in_many_names_gets_no_more() -> None:
    allowance = ReplyQuota()
    granted = sum(allowance.try_acquire(asker, 40, 0.0) for asker in range(5000))
    assert granted == 30
    assert allowance.refused.total == 5000 - 30
    assert len(allowance._own) == MOST_ASKERS


class Ear(Task):
    """Counts what is published about entities."""

    def configure(self) -> None:
        self.infos = 0
        self.texts: list[str] = []

    @consume
    def hear(self, message: imc.EntityInfo | imc.LogBookEntry) -> None:
        if isinstance(message, imc.LogBookEntry):
            self.texts.append(message.text)
        else:
            self.infos += 1


def test_a_vehicle_answers_some_of_many_questions_and_says_who_asks_too_much() -> None:
    feed = [
        imc.QueryEntityInfo(src=CONSOLE, dst=0x1A, dst_ent=0xFF, timestamp=1.0 + number / 2000)
        for number in range(4000)
    ]
    run = simulate(Ear, feed, seconds=20.0)
    assert BURST <= run.task.infos <= BURST + 3 * RATE
    told = [text for text in run.task.texts if text.startswith("dropped because too many arrive")]
    assert len(told) == 2, "at once, and ten seconds later"
    assert all("requests from 0x4001" in text for text in told)


def test_a_vehicle_says_whose_packets_were_dropped_those_of_the_worst_first() -> None:
    class Flood(Ear):
        """Does what a bus does when more arrives than the vehicle can take."""

        def start(self) -> None:
            for number in range(300):
                self.vehicle.bus.inbox.dropped.count(0x5000 + number)
                self.vehicle.bus.inbox.dropped.count(CONSOLE)

    run = simulate(Flood, seconds=20.0)
    (told,) = [text for text in run.task.texts if text.startswith("dropped because too many arrive")]
    assert told.startswith("dropped because too many arrive: 300 packets from 0x4001, ")
