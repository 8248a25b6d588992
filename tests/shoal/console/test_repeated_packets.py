"""Packets that come twice to a page: nothing is shown twice."""

import json
import time

import imc
from tests.outside import until
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.page_of_nobody import served_page

NAME, OWN = "lauv-noptilus-1", 0x1A


class EchoRadio(Radio):
    """A radio that brings every packet twice."""

    def bring(self, *messages, system=NAME):
        super().bring(*(message for message in messages for _ in range(2)), system=system)


def test_a_packet_that_comes_twice_counts_once():
    radio = EchoRadio()
    with served_page(radio) as page:
        page.log_in()
        with page.frames() as frames:

            def news() -> dict:
                return json.loads(frames.recv(10))

            assert news()["all"]
            now = time.time()
            radio.bring(imc.Announce(sys_name=NAME, sys_type=imc.SystemType.UUV, src=OWN, timestamp=now))
            until(lambda: NAME in news()["vehicles"])
            entry = imc.LogBookEntry(htime=now, context="Test", text="once", src=OWN, timestamp=now)
            state = imc.EstimatedState(lat=0.7, lon=-0.15, depth=2.0, src=OWN, timestamp=now)
            radio.bring(entry, state)
            found = [news() for _ in range(8)]
        texts = [line[4] for frame in found for line in frame["log"]]
        states = [frame["vehicles"][NAME]["state"] for frame in found if "state" in frame["vehicles"].get(NAME, {})]
        assert texts == ["once"]
        assert [each["depth"] for each in states][-1:] == [2.0]
