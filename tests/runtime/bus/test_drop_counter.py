"""Who sends most is named, whatever others send."""

from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.bus import DropCounter
from runtime.bus.drop_counter import MOST_NAMED

CONSOLE = 0x4001


def test_many_names_hide_nobody_who_sends_more() -> None:
    excess = DropCounter(UNKNOWN_SYSTEM)
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
    excess = DropCounter(UNKNOWN_SYSTEM)
    excess.count(CONSOLE)
    assert excess.drain() == {CONSOLE: 1}
    assert excess.drain() == {}
    assert excess.total == 1
