"""A log that viewers of Foxglove's protocol play, pause and move, together with the page."""

import json
import struct

import pytest

import imc
from shoal.console import LogLink
from shoal.console.foxglove import protocol
from shoal.logs.log_states import LogStates
from tests.shoal.console.foxglove.viewer import Viewer
from tests.shoal.console.page_of_nobody import served_page

NAME, START, SECONDS = "lauv-noptilus-1", 1.7e9, 60
DEPTH = "/lauv_noptilus_1/Depth/entity_1"
PLAYING, PAUSED, ENDED = 0, 1, 3


@pytest.fixture
def page(tmp_path):
    head = {"src": 0x1A, "src_ent": 1}
    announce = imc.Announce(sys_name=NAME, sys_type=imc.SystemType.UUV, timestamp=START, **head)
    depths = [imc.Depth(value=float(number), timestamp=START + number, **head) for number in range(SECONDS + 1)]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, (announce, *depths))))
    player = LogLink(LogStates(tmp_path / "Data.lsf"))
    with served_page(player, player=player, log_root=tmp_path) as found:
        found.log_in()
        yield found


def replay(page, **words):
    return json.loads(page.request("POST", "/api/replay", words)[1])


def depths(viewer):
    return [viewer.decode(DEPTH, data).value for _, _, data in viewer.messages]


def test_a_viewer_moves_plays_and_pauses_the_log_of_the_page(page):
    with Viewer(page.server.foxglove_link(operate=True)) as viewer:
        info = viewer.until(lambda: viewer.of("serverInfo"))[0]
        assert "playbackControl" in info["capabilities"]
        assert info["dataStartTime"] == {"sec": int(START), "nsec": 0}
        assert info["dataEndTime"]["sec"] == int(START) + SECONDS
        viewer.subscribe(DEPTH, 7)
        answer = viewer.control("to 30", plays=False, speed=2.0, seek=START + 30.0)
        assert answer == (PAUSED, START + 30.0, 2.0, True, "to 30")
        viewer.until(lambda: viewer.messages and depths(viewer)[-1] == 30.0)
        assert replay(page, playing=False)["position"] == 30.0
        assert viewer.control("back", plays=False, seek=START + 10.0)[1:4] == (START + 10.0, 2.0, True)
        viewer.until(lambda: depths(viewer)[-1] == 10.0)
        viewer.until(lambda: viewer.times[-1] == round((START + 10.0) * 1e9))  # the time has gone back, too
        assert viewer.control("play", plays=True, speed=100.0)[0] == PLAYING
        viewer.until(lambda: viewer.playback[-1][0] == ENDED)
        assert viewer.playback[-1][1] == START + SECONDS
        viewer.until(lambda: depths(viewer)[-1] == SECONDS)
        again = viewer.control("again", plays=True, speed=1.0)  # from the start
        assert (again[0], again[3]) == (PLAYING, True)
        assert viewer.control("stop", plays=False)[1] < START + 30.0


def test_a_viewer_sees_what_the_page_does(page):
    with Viewer(page.server.foxglove_link(operate=True)) as viewer:
        viewer.until(lambda: viewer.playback)
        assert viewer.playback[0] == (PAUSED, START, 1.0, False, "")
        replay(page, position=20.0, speed=5)
        viewer.until(lambda: viewer.playback[-1] == (PAUSED, START + 20.0, 5.0, True, ""))
        replay(page, playing=True)
        viewer.until(lambda: viewer.playback[-1][0] == PLAYING)


def test_who_may_watch_only_moves_nothing_and_a_wrong_request_is_answered(page):
    wrong = struct.pack("<BBfBQI", 3, 0, float("nan"), 0, 0, 0), struct.pack("<BBfBQI", 3, 9, 1.0, 0, 0, 0)
    long, short = struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 4000) + bytes(4000), b"\x03\x00"
    with Viewer(page.server.foxglove_link(operate=True)) as viewer:
        for frame, reason in zip((*wrong, long, short), ("speed nan", "command 9", "length", "is longer"), strict=True):
            viewer.connection.send(frame)
            viewer.status(reason)
        answer = viewer.control("beyond", plays=False, speed=1e30, seek=START + 1e6)
        assert answer[:3] == (ENDED, START + SECONDS, 1000.0)
    with Viewer(page.server.foxglove_link()) as viewer:
        assert "playbackControl" not in viewer.until(lambda: viewer.of("serverInfo"))[0]["capabilities"]
        viewer.connection.send(struct.pack("<BBfBQI", 3, 0, 1.0, 1, 0, 0))
        viewer.status("this viewer may watch only: the log was not moved")
        assert viewer.playback == []
    assert replay(page)["position"] == SECONDS


@pytest.mark.parametrize("reason", ["speed", "command", "failed", "busy"])
def test_each_request_is_answered_with_its_id_and_the_present_state(page, monkeypatch, reason):
    async def fail(player, words):
        raise RuntimeError("no memory")

    if reason == "failed":
        monkeypatch.setattr(LogLink, "control", fail)
    if reason == "busy":
        monkeypatch.setattr("shoal.console.foxglove.viewer_session.MOST_AT_WORK", 0)
    speed, command = {"speed": (-1.0, 0), "command": (1.0, 9)}.get(reason, (1.0, 0))
    with Viewer(page.server.foxglove_link(operate=True)) as viewer:
        viewer.until(lambda: viewer.playback)
        viewer.connection.send(struct.pack("<BBfBQI", 3, command, speed, 1, round((START + 5.0) * 1e9), 2) + b"id")
        viewer.status({"failed": "no memory", "busy": "are waiting"}.get(reason, reason))
        viewer.until(lambda: viewer.playback[-1][-1] == "id")
    assert viewer.playback[-1] == (PAUSED, START, 1.0, False, "id")


def test_where_no_log_is_played_a_request_is_rejected():
    with served_page() as page, Viewer(page.server.foxglove_link(operate=True)) as viewer:
        assert "dataStartTime" not in viewer.until(lambda: viewer.of("serverInfo"))[0]
        viewer.connection.send(struct.pack("<BBfBQI", 3, 0, 1.0, 0, 0, 0))
        viewer.status("no log is played here")


def test_the_state_has_the_layout_of_the_specification():
    data = protocol.playback_state_data(protocol.PlaybackStatus.ENDED, 0x0102030405060708, 2.5, "ab", did_seek=True)
    assert data.hex() == "0503080706050403020100002040" + "01" + "02000000" + "6162"
