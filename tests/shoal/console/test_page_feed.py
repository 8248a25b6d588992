"""A slow page loses old frames, and then gets everything anew."""

import asyncio

from shoal.console.page_feed import Viewer


def test_a_page_that_misses_a_frame_gets_everything_anew():
    viewer = Viewer()
    viewer.needs_all = False
    for frame in (b"1", b"2"):
        viewer.put(frame)
    assert (viewer.needs_all, viewer.dropped) == (False, 0)
    viewer.put(b"3")
    assert (viewer.needs_all, viewer.dropped) == (True, 2)
    viewer.put(b"all")
    assert asyncio.run(viewer.next()) == b"all"
