"""What is no frame of the vehicle is counted and dropped."""

import itertools
import logging
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh

from runtime.bus import Frame
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from runtime.zenoh.camera_frames import FrameHeader, ZenohFrames
from runtime.zenoh.key_expressions import subscription_keys
from tests.outside import until
from tests.runtime.zenoh.processes import Network

SIBLING = "5b"
HEAD = msgspec.msgpack.encode(FrameHeader(12.5, "Front", 7, 2, 3, {"fov": 1.5}))
PIXELS = bytes(range(24))


def sample(pixels: bytes = PIXELS, head: bytes | None = HEAD, zid: str | None = SIBLING) -> Any:
    source = None if zid is None else SimpleNamespace(source_id=SimpleNamespace(zid=zid))
    attachment = None if head is None else zenoh.ZBytes(head)
    return SimpleNamespace(
        source_info=source, attachment=attachment, payload=zenoh.ZBytes(pixels), key_expr="imc/v/@frame/Front"
    )


@pytest.fixture
def frames() -> ZenohFrames:
    return ZenohFrames("v", lambda zid: zid == SIBLING, logging.getLogger("shoal.zenoh").warning)


def test_a_frame_arrives_as_it_was(frames: ZenohFrames) -> None:
    frame = frames._taken(sample())
    assert frame is not None
    assert (frame.time, frame.camera, frame.index, frame.info) == (12.5, "Front", 7, {"fov": 1.5})
    assert np.array_equal(frame.image, np.frombuffer(PIXELS, np.uint8).reshape(2, 3, 4))
    assert not frame.image.flags.writeable


@pytest.mark.parametrize(
    "wrong",
    [
        sample(zid=None),
        sample(zid="ff"),
        sample(head=None),
        sample(head=b"nonsense"),
        sample(head=msgspec.msgpack.encode({"time": "now"})),
        sample(pixels=PIXELS[:-1]),
        sample(pixels=b""),
        sample(head=msgspec.msgpack.encode(FrameHeader(1.0, "Front", 1, -1, 3, {}))),
        sample(head=msgspec.msgpack.encode(FrameHeader(1.0, "Front", 1, 1 << 40, 1 << 40, {}))),
    ],
)
def test_strangers_and_rubbish_are_counted(frames: ZenohFrames, wrong: Any, caplog: pytest.LogCaptureFixture) -> None:
    assert frames._taken(wrong) is None
    assert frames.malformed.total == 1
    assert "imc/v/@frame/Front" in caplog.text


def test_frames_of_4_mb_arrive_without_shared_memory(network: Network) -> None:
    def joined(process: str, entities: int) -> ZenohTransport:
        config = ZenohConfig(local_port=network.local_port, scouting="none", vehicle="v")
        part = ProcessPart("v", 1, entities, process)
        transport = ZenohTransport(config, "0x{:04X}".format, lambda *_: "Daemon", part=part)
        transport.open(lambda packet: None)
        return transport

    with ThreadPoolExecutor() as pool:
        main, vision = pool.map(joined, ("main", "vision"), (0b001, 0b010))
    assert main.frames is not None
    sender = vision.frames
    assert sender is not None
    got: list[Frame] = []
    main.frames.subscribe(got.append)
    sender._shares = False
    image = np.full((1024, 1024, 4), 7, np.uint8)
    numbers = itertools.count()
    until(lambda: sender.send(Frame(1.0, "Front", next(numbers), image, {})) or len(got) > 3, every=0.05)
    assert all(np.array_equal(frame.image, image) for frame in got)
    assert sender.unsent.total == 0
    for transport in (main, vision):
        transport.close()


def test_a_frame_that_the_network_takes_too_long_for_is_counted_and_reported(
    frames: ZenohFrames, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = iter([10.0, 10.9, 20.0, 21.001])  # before and after each put; zenoh drops a frame after a second
    monkeypatch.setattr("runtime.zenoh.camera_frames.time", SimpleNamespace(monotonic=times.__next__))
    sent: list[bytes] = []
    status = SimpleNamespace(matching=True)
    frames._publishers["Front"] = SimpleNamespace(
        matching_status=status, put=lambda pixels, **_: sent.append(pixels), id=None, undeclare=lambda: None
    )
    monkeypatch.setattr(zenoh, "SourceInfo", lambda *_: None)
    frames._shares = False
    frames.send(Frame(1.0, "Front", 1, np.zeros((1024, 1024, 4), np.uint8), {}))
    frames.send(Frame(2.0, "Front", 2, np.zeros((1024, 1024, 4), np.uint8), {}))
    until(lambda: caplog.text, every=0.01)
    assert (len(sent), frames.unsent.total) == (2, 1)
    assert "Front: the network takes longer than 1 s for 4.19 MB" in caplog.text
    frames.close()


def test_a_vehicle_hears_of_others_only_what_it_wants() -> None:
    assert subscription_keys("v", None) == (["imc/**"], ["imc/*/@cmd/**"])
    of_all, commands = subscription_keys("v", ("Announce",))
    assert of_all == ["imc/v/**", "imc/*/Announce/*"]
    assert commands == ["imc/v/@cmd/**", "imc/0xFFF0/@cmd/**"]
