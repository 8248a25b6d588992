"""Who sends most is named, whatever others send."""

import sys
import threading

from imc.addresses import UNKNOWN_SYSTEM
from runtime.bus import Excess
from runtime.bus.excess import MOST_NAMED

CONSOLE = 0x4001


def test_many_names_hide_nobody_who_sends_more() -> None:
    excess = Excess()
    for source in range(10 * MOST_NAMED):
        excess.count(source)
    for _ in range(50):
        excess.count(CONSOLE)
    for source in range(10 * MOST_NAMED):
        excess.count(source)
    counts = excess.drain()
    assert counts[CONSOLE] == 50
    assert len(counts) <= MOST_NAMED + 1
    assert counts.total() == excess.total == 20 * MOST_NAMED + 50
    assert counts.most_common(1)[0][0] == UNKNOWN_SYSTEM


def test_counts_begin_again_once_they_were_read() -> None:
    excess = Excess()
    excess.count(CONSOLE)
    assert excess.drain() == {CONSOLE: 1}
    assert excess.drain() == {}
    assert excess.total == 1


def test_no_count_is_lost_while_others_are_read() -> None:
    excess, each, seen = Excess(), 20_000, 0
    senders = [
        threading.Thread(target=lambda: [excess.count(number % 500) for number in range(each)]) for _ in range(2)
    ]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for sender in senders:
            sender.start()
        while any(sender.is_alive() for sender in senders):
            seen += sum(number for _, number in excess.drain().items())
    finally:
        sys.setswitchinterval(interval)
        for sender in senders:
            sender.join()
    assert seen + excess.drain().total() == excess.total == 2 * each
