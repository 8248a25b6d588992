"""Commands to an autopilot: repeated, acknowledged, refused, given up, dropped; without a vehicle or a socket."""

import pytest

from mavlink.autopilot.command_client import DROPPED, LONGEST_QUEUE, SILENT, WITHDRAWN, CommandClient, result_text


class Line:
    """Records what is sent, and the results."""

    def __init__(self):
        self.sent, self.results = [], []
        self.orders = CommandClient(lambda _, fields: self.sent.append((fields["command"], fields.get("confirmation"))))

    def give(self, command, now, **how):
        self.orders.send("COMMAND_LONG", {"command": command}, lambda r: self.results.append((command, r)), now, **how)


def test_a_command_is_repeated_until_it_is_acknowledged_and_only_its_own_answer_counts():
    line = Line()
    line.give(400, 0.0)
    line.give(176, 0.0)
    line.orders.tick(1.0)
    line.orders.receive(176, 0, 1.1)
    line.orders.receive(400, 5, 1.1)
    line.orders.tick(5.0)
    assert line.sent == [(400, 0), (400, 1)]
    line.orders.receive(400, 2, 6.0)
    line.orders.receive(176, 0, 6.1)
    assert line.results == [(400, 2), (176, 0)]
    assert line.sent[2:] == [(176, 0)]


def test_a_command_without_an_answer_is_given_up_and_urgent_ones_overtake():
    line = Line()
    for command in (1, 2):
        line.give(command, 0.0)
    line.give(3, 0.0, urgent=True)
    for tenth in range(80):
        line.orders.tick(tenth / 10.0)
    assert line.results == [(3, SILENT)]
    assert [command for command, _ in line.sent] == [1, *[3] * 6, 1, 1]


@pytest.mark.parametrize("urgent", [False, True])
def test_a_command_that_is_dropped_since_too_many_wait_is_answered_with_the_reason(urgent):
    line = Line()
    for command in range(LONGEST_QUEUE + 1):  # the first is sent, the others wait
        line.give(command, 0.0)
    assert line.results == []
    line.give(1000, 0.0, urgent=urgent)
    assert line.results == [(LONGEST_QUEUE, DROPPED)]
    assert result_text(DROPPED) == "not sent: 64 other commands wait"
    for command in (0, *range(1, LONGEST_QUEUE), 1000) if not urgent else (1000, *range(LONGEST_QUEUE)):
        line.orders.receive(command, 0, 1.0)
    assert [command for command, result in line.results if result == 0].count(1000) == 1
    assert len(line.results) == LONGEST_QUEUE + 2
    assert not line.orders.busy


@pytest.mark.parametrize(("urgent", "left"), [(True, []), (False, [3])])
def test_a_command_that_is_cancelled_has_a_result_too(urgent, left):
    line = Line()
    for command in (1, 2):
        line.give(command, 0.0)
    line.give(3, 0.0, urgent=True)
    line.orders.cancel(urgent=urgent)
    assert sorted(line.results) == [(command, WITHDRAWN) for command in (1, 2, 3) if command not in left]
    assert line.orders.busy == bool(left)
    line.give(4, 1.0)
    for command in (*left, 4):
        line.orders.receive(command, 0, 1.1)
    assert line.results[-1] == (4, 0)
    assert result_text(WITHDRAWN) == "withdrawn"
