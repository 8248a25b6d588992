"""Scripts with subscriptions: nothing is lost, and no subscription remains."""

import pytest

import imc
from runtime import Task, consume
from runtime.testing import simulate


class Twice(Task):
    """Answers a Heartbeat with two messages in one step."""

    @consume
    def answer(self, _: imc.Heartbeat) -> None:
        for value in (1.0, 2.0):
            self.publish(imc.Temperature(value=value))


def test_an_inbox_loses_nothing_that_comes_in_one_step():
    heard = []

    async def mission(script):
        inbox = script.listen(imc.Temperature)
        script.publish(imc.Heartbeat())
        for _ in range(2):
            heard.append((await inbox.next()).value)
            await script.sleep(0.5)

    simulate(Twice, script=mission, seconds=3.0)
    assert heard[:2] == [1.0, 2.0]


def test_an_inbox_keeps_what_comes_while_the_script_sleeps():
    heard = []

    async def mission(script):
        inbox = script.listen(imc.Temperature, imc.Pressure)
        await script.sleep(2.5)
        heard.extend([type(await inbox.next()).__name__, (await inbox.next()).value])

    simulate(Twice, [imc.Pressure(timestamp=1.0), imc.Temperature(timestamp=2.0, value=7.0)], script=mission, seconds=4)
    assert heard[0] in ("Pressure", "Temperature")
    assert len(heard) == 2


def test_next_says_when_nothing_came():
    ended = []

    async def mission(script):
        with pytest.raises(TimeoutError, match=r"no message within 0\.5 s"):
            await script.listen(imc.Pressure).next(timeout=0.5)
        ended.append(script.now)

    simulate(Twice, script=mission, seconds=2)
    assert ended == [pytest.approx(1_767_225_600.5)]


def test_an_inbox_is_closed_when_its_script_ends():
    inboxes = []

    async def mission(script):
        inboxes.append(script.listen(imc.Pressure))

    run = simulate(Twice, [imc.Pressure(timestamp=1.0)], script=mission, seconds=2)
    assert not inboxes[0]._messages
    assert all(s.handler != inboxes[0]._take for s in run.vehicle.bus._subscriptions)
