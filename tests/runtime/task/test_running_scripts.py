"""Scripts as parts of their task: order, errors and ends."""

import pytest

import imc
from runtime import Task
from runtime.testing import START, simulate
from tests.runtime.task.clockwork import Clockwork


def test_a_script_waits_hears_and_acts_in_order():
    async def mission(script):
        state = await script.receive(imc.Depth, where=lambda depth: depth.value > 5.0)
        await script.sleep(2.0)
        script.publish(imc.Pressure(value=state.value))
        with pytest.raises(TimeoutError, match="no Temperature within 1 s"):
            await script.receive(imc.Temperature, timeout=1.0)
        return script.now

    class Captain(Task):
        """Runs a mission."""

        def start(self):
            self.script = self.start_script(mission)

    run = simulate(Captain, [imc.Depth(value=v, timestamp=float(v)) for v in range(9)], seconds=20.0)
    assert [(p.value, p.timestamp - START) for p in run.of(imc.Pressure)] == [(6.0, 8.0)]
    assert run.task.script.done
    assert run.task.script.result == START + 9.0


def test_an_error_in_a_script_is_the_tasks_error():
    async def mission(script):
        await script.sleep(1.0)
        raise ValueError("no such waypoint")

    class Captain(Task):
        """Fails."""

        def start(self):
            self.start_script(mission)

    with pytest.raises(ValueError, match="no such waypoint") as caught:
        simulate(Captain, seconds=5.0)
    assert "Captain" in caught.value.__notes__[0]
    assert "1.000 s" in caught.value.__notes__[0]


class Captain(Task):
    """Runs the scripts that it is given."""

    def run_all(self, *scripts):
        self.orders = [self.start_script(script) for script in scripts]


def captain(*scripts):
    class Nemo(Captain):
        """Runs the scripts when it starts."""

        def start(self):
            self.run_all(*scripts)

    return Nemo


def test_a_script_that_cancels_itself_ends_where_it_waits_next():
    steps = []

    async def mission(script):
        try:
            script.cancel()
            steps.append("on")
            await script.sleep(1.0)
            steps.append("never")
        finally:
            steps.append("ended")

    run = simulate(captain(mission), seconds=5.0)
    assert steps == ["on", "ended"]
    assert run.task.orders[0].done


def test_an_error_in_where_is_raised_where_the_script_waits():
    def vague(depth):
        raise ValueError(f"what is {depth.value}?")

    async def careful(script):
        with pytest.raises(ValueError, match="what is 1"):
            await script.receive(imc.Depth, where=vague)
        return "caught"

    async def careless(script):
        await script.receive(imc.Depth, where=vague)

    feed = [imc.Depth(value=1.0, timestamp=1.0)]
    assert simulate(captain(careful), feed).task.orders[0].result == "caught"
    with pytest.raises(ValueError, match="what is 1") as caught:
        simulate(captain(careless), feed)
    assert "Nemo" in caught.value.__notes__[0]


def test_a_script_that_does_not_end_in_order_does_not_keep_the_others_from_it():
    ended = []

    async def stubborn(script):
        try:
            await script.sleep(100.0)
        finally:
            await script.sleep(1.0)

    async def orderly(script):
        try:
            await script.sleep(100.0)
        finally:
            ended.append(script)

    with pytest.raises(RuntimeError, match="GeneratorExit"):
        simulate([captain(orderly, stubborn, orderly), Clockwork], seconds=1.0)
    assert len(ended) == 2


def test_a_script_is_an_async_function():
    def plain(script):
        return 1

    with pytest.raises(TypeError, match="write async def"):
        simulate(captain(plain), seconds=1.0)
