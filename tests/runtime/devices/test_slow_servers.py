"""A device or a server of requests that is silent, slow or endless costs a bounded time and memory, and is named."""

import tracemalloc

import pytest

from runtime import Script, State
from runtime.devices.tcp_request import TcpRequester
from tasks.vision.airsim_api.rpc_messages import MessageEnd
from tests.runtime.devices.slow_servers import Speech, endless, mute, rubbish, served, trickle
from tests.runtime.devices.sounder import depths, played, sounder_of, until


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("speak", "words"),
    [(mute, "no data for 0.6 s"), (trickle, "nothing valid for 0.6 s, in"), (endless, "nothing valid")],
)
def test_a_device_that_says_nothing_whole_is_named_and_keeps_little_memory(speak: Speech, words: str) -> None:
    beats = []

    async def script(script: Script) -> None:
        task = sounder_of(script)
        await until(script, lambda: words in task.entity.description)
        assert task.entity.state is State.ERROR
        assert task.entity.description.startswith(f"tcp://127.0.0.1:{port}: ")
        for _ in range(20):
            beats.append(script.task.vehicle.kernel.now_ns)
            await script.sleep(0.02)
        assert task.sounder._splitter.unfinished_bytes <= 1024

    with served(speak) as port:
        run = played(script, kind="tcp", port="127.0.0.1", number=port)
    assert depths(run) == []
    assert len(run.log) < 20
    assert len(beats) == 20


@pytest.mark.heavy
def test_a_device_that_sends_rubbish_without_end_is_counted_and_named_ever_more_rarely() -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        await until(script, lambda: task.sounder.bad > 2000)
        await script.sleep(0.3)

    with served(rubbish) as port:
        run = played(script, kind="tcp", port="127.0.0.1", number=port)
    assert 3 <= sum(f"tcp://127.0.0.1:{port}" in text for text in run.log) < 20


@pytest.mark.heavy
@pytest.mark.parametrize("speak", [mute, trickle])
def test_a_request_ends_at_its_deadline_however_slowly_the_answer_comes(speak: Speech) -> None:
    with served(speak) as port:
        requester = TcpRequester("127.0.0.1", port, 0.4)
        with pytest.raises(TimeoutError, match="no answer within"):
            requester.request(b"x", MessageEnd().is_complete)
        assert not requester.is_open
        requester.close()


@pytest.mark.heavy
def test_an_answer_without_end_is_refused_at_its_largest_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("runtime.devices.tcp_request.LARGEST_ANSWER", 4 << 20)
    with served(endless) as port:
        requester = TcpRequester("127.0.0.1", port, 20.0)
        tracemalloc.start()
        try:
            with pytest.raises(ValueError, match="an answer of more than 4 MiB"):
                requester.request(b"x", MessageEnd().is_complete)
            assert tracemalloc.get_traced_memory()[1] < 16 << 20
        finally:
            tracemalloc.stop()
        requester.close()


def test_rubbish_is_refused_at_its_first_byte() -> None:
    with served(rubbish) as port:
        requester = TcpRequester("127.0.0.1", port, 20.0)
        with pytest.raises(ValueError, match="0xc1 is no msgpack"):
            requester.request(b"x", MessageEnd().is_complete)
        requester.close()
