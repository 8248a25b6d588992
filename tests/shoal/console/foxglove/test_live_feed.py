"""Channels and messages of vehicles for viewers, without a network."""

import asyncio
import json
import struct

import pytest

import imc
from shoal.console.foxglove import live_feed
from shoal.console.foxglove.connection_graph import consumed_messages
from shoal.console.foxglove.live_feed import LiveFeed
from shoal.console.foxglove.parameters import ParameterAccess, value_text, values_of
from shoal.console.foxglove.vehicle_services import VehicleServices
from shoal.console.foxglove.viewer_session import ViewerSession
from shoal.network import Network
from shoal.network.link import NetworkError
from tests.shoal.console.foxglove.packet_radio import Radio

HEADER = {"timestamp": 1.7e9, "src": 0x1A, "src_ent": 7}
LABELS = imc.EntityList(op=imc.EntityList.Op.REPORT, list="Navigation=7;CTD=8", **HEADER)


def nobody(name, order=""):
    raise NetworkError("there is no such vehicle")


def permit(vehicle, order, words):
    pass


def session_of(feed, *, may_operate=False):
    parameters = ParameterAccess(feed.network, nobody)
    return ViewerSession(feed, parameters, VehicleServices(), nobody, permit, may_operate=may_operate)


async def frames_of(session, duration=0.3):
    """The frames that a viewer gets within some time."""
    found = []
    try:
        async with asyncio.timeout(duration):
            while True:
                found.append(await session.queue.next())
    except TimeoutError:
        return found


def topics_of(frames):
    said = [json.loads(frame) for frame in frames if isinstance(frame, str)]
    return [channel["topic"] for each in said if each["op"] == "advertise" for channel in each["channels"]]


def data_of(frames):
    """Subscription, time and payload of each message."""
    return [(*struct.unpack_from("<IQ", frame, 1), frame[13:]) for frame in frames if frame[:1] == b"\x01"]


def run(work):
    async def inside():
        radio = Radio()
        async with Network([radio]) as network:
            feed = LiveFeed(network)
            await work(radio, feed)

    asyncio.run(inside())


def test_a_topic_has_the_label_of_its_entity_also_if_that_comes_later():
    async def work(radio, feed):
        session = session_of(feed)
        radio.bring(imc.Depth(value=1.0, **HEADER))
        session.start()
        assert topics_of(await frames_of(session)) == []
        radio.bring(LABELS, imc.Depth(value=1.0, **HEADER))
        assert "/lauv_noptilus_1/Depth/Navigation" in topics_of(await frames_of(session))

    run(work)


def test_an_entity_without_a_label_has_its_number_after_a_while(monkeypatch):
    monkeypatch.setattr(live_feed, "LABEL_PATIENCE", 0.2)

    async def work(radio, feed):
        session = session_of(feed)
        session.start()
        for _ in range(4):
            radio.bring(imc.Depth(value=1.0, **HEADER))
            frames = await frames_of(session, 0.2)
        assert topics_of(frames) + topics_of(await frames_of(session)) or feed.channels
        assert [channel["topic"] for channel in feed.channels.values()] == ["/lauv_noptilus_1/Depth/entity_7"]

    run(work)


def test_one_message_goes_to_each_subscription_and_is_encoded_once(monkeypatch):
    async def work(radio, feed):
        sessions = [session_of(feed), session_of(feed)]
        for session in sessions:
            session.start()
        radio.bring(LABELS, imc.Depth(value=1.0, **HEADER))
        await frames_of(sessions[0])
        (number,) = [number for number, each in feed.channels.items() if "/Depth/" in each["topic"]]
        encoded = []
        encode = LiveFeed._encode
        monkeypatch.setattr(LiveFeed, "_encode", lambda *words: encoded.append(1) or encode(*words))
        for session, numbers in zip(sessions, ([1, 2], [9]), strict=True):
            subscriptions = [{"id": each, "channelId": number} for each in numbers]
            session.take(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        assert sorted(each[0] for each in data_of(await frames_of(sessions[0]))) == [1, 2]  # the last one, at once
        await frames_of(sessions[1])
        encoded.clear()
        radio.bring(imc.Depth(value=2.0, **HEADER))
        for session, numbers in zip(sessions, ([1, 2], [9]), strict=True):
            found = data_of(await frames_of(session))
            assert [each[0] for each in found] == numbers
            assert {each[1] for each in found} == {1_700_000_000 * 10**9}
            assert struct.unpack("<f", found[0][2][-4:]) == (2.0,)
        assert len(encoded) == 1

    run(work)


def test_nothing_is_taken_without_viewers():
    async def work(radio, feed):
        session = session_of(feed)
        running = session.start()
        await asyncio.sleep(0.05)
        assert feed.network._listeners
        session.end()
        await asyncio.gather(running, return_exceptions=True)
        assert not feed.network._listeners

    run(work)


def test_all_messages_are_asked_for_only_while_somebody_receives_them():
    async def work(radio, feed):
        asked = []
        radio.subscribe = lambda system, messages: asked.append(("+", system, *messages))
        radio.unsubscribe = lambda system, messages: asked.append(("-", system, *messages))
        for _ in range(2):
            sessions = [session_of(feed), session_of(feed)]
            running = [session.start() for session in sessions]
            await asyncio.sleep(0.05)
            assert asked == [("+", "*")]
            sessions[0].end()
            await asyncio.sleep(0.05)
            assert asked == [("+", "*")]
            sessions[1].end()
            await asyncio.gather(*running, return_exceptions=True)
            assert asked == [("+", "*"), ("-", "*")]
            asked.clear()

    run(work)


def test_a_request_that_fails_in_the_console_is_answered(monkeypatch):
    async def fail(*words):
        raise ZeroDivisionError("of a test")

    async def work(radio, feed):
        monkeypatch.setattr(ParameterAccess, "get", fail)
        monkeypatch.setattr("shoal.console.foxglove.viewer_session.carry_out", fail)
        session = session_of(feed, may_operate=True)
        session._find = lambda name, order: None
        radio.bring(LABELS)
        session.start()
        house = asyncio.create_task(session.keep_house())
        await frames_of(session, 0.1)
        session.take(json.dumps({"op": "getParameters", "parameterNames": [], "id": "a"}))
        number = next(number for number, each in session._services.by_number.items() if each.order == "abort")
        session.take(struct.pack("<BIII", 2, number, 5, 4) + b"json{}")
        said = [json.loads(frame) for frame in await frames_of(session) if isinstance(frame, str)]
        text = "the console has failed: ZeroDivisionError: of a test"
        assert [each["message"] for each in said if each["op"] == "status"] == [text]
        assert [(each["callId"], each["message"]) for each in said if each["op"] == "serviceCallFailure"] == [(5, text)]
        assert feed.counts["requests that failed: ZeroDivisionError"] == 2
        house.cancel()

    run(work)


def test_a_time_stamp_that_is_no_time_is_replaced_by_now():
    async def work(radio, feed):
        session = session_of(feed)
        session.start()
        radio.bring(LABELS, imc.Depth(value=1.0, **{**HEADER, "timestamp": 1e300}))
        await frames_of(session)
        (number,) = [number for number, each in feed.channels.items() if "/Depth/" in each["topic"]]
        session.take(json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": number}]}))
        ((_, moment, _),) = data_of(await frames_of(session))
        assert 1.7e18 < moment < 4e18

    run(work)


def test_too_many_requests_at_once_are_rejected():
    async def work(radio, feed):
        session = session_of(feed)
        session.start()
        for number in range(20):
            session.take(json.dumps({"op": "getParameters", "parameterNames": ["a/b/c"], "id": str(number)}))
        said = [json.loads(frame) for frame in await frames_of(session) if isinstance(frame, str)]
        assert len([each for each in said if each["op"] == "parameterValues"]) == 16
        rejected = [each["message"] for each in said if "are waiting for vehicles" in each.get("message", "")]
        assert len(rejected) == 4

    run(work)


def test_a_viewer_has_few_subscriptions_of_a_channel():
    """Each gets every message once more, so that thousands keep a vehicle's page from all else."""

    async def work(radio, feed):
        session = session_of(feed)
        session.start()
        radio.bring(LABELS, imc.Depth(value=1.0, **HEADER))
        await frames_of(session)
        (number,) = [number for number, each in feed.channels.items() if "/Depth/" in each["topic"]]
        for each in range(6):
            session.take(json.dumps({"op": "subscribe", "subscriptions": [{"id": each, "channelId": number}]}))
        frames = await frames_of(session)
        assert [each[0] for each in data_of(frames)] == [0, 1, 2, 3]
        said = [json.loads(frame) for frame in frames if isinstance(frame, str)]
        assert [each["message"] for each in said if "at most 4 subscriptions of a channel" in each.get("message", "")]

    run(work)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("true", {"value": True}),
        ("0.05", {"value": 0.05, "type": "float64"}),
        ("-3e-2", {"value": -0.03, "type": "float64"}),
        ("007", {"value": "007"}),
        ("nan", {"value": "nan"}),
        ("1, 2", {"value": "1, 2"}),
        ("a\x1bb", {"value": "a\\x1bb"}),
    ],
)
def test_values_have_the_types_of_json(text, value):
    ((found),) = values_of("v", "e", {"p": text})
    assert found == {"name": "v/e/p", **value}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (5.0, "5"),
        (0.07, "0.07"),
        (1e300, "1e+300"),
        ([1, 2.5], "1, 2.5"),
        ("x", "x"),
        (None, None),
        ({}, None),
        ([[1]], None),
        ([None], None),
    ],
)
def test_values_of_json_are_texts_of_profiles(value, text):
    assert value_text(value) == text


def test_the_name_of_a_task_from_the_network_imports_nothing_else():
    assert "EstimatedState" in consumed_messages("Plan.Engine")
    assert consumed_messages("antigravity.Task") == frozenset()
    assert consumed_messages("") == frozenset()
