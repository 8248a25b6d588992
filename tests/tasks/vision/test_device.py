"""Real cameras, as OpenCV sees them: streams over the network, devices that are not there."""

import http.server
import threading

import cv2
import numpy as np
import pytest

from runtime import ParameterError, State, Task, periodic
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.vision.device import Device

BORDER = b"--border\r\n"


class Camera(http.server.BaseHTTPRequestHandler):
    """Sends pictures that grow brighter, 50 a second: as many as the server has, and then nothing or the end."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=border")
        self.end_headers()
        self.server.asked += 1
        try:
            for number in range(self.server.count):
                _, data = cv2.imencode(".jpg", np.full((48, 64, 3), (0, 0, 20 + number % 200), np.uint8))
                head = f"Content-Type: image/jpeg\r\nContent-Length: {data.size}\r\n\r\n".encode()
                self.wfile.write(BORDER + head + data.tobytes() + b"\r\n")
                self.wfile.flush()
                self.server.end.wait(0.02)
            if self.server.hangs:
                self.server.end.wait(20.0)
        except OSError:
            pass

    def log_message(self, *_):
        pass


@pytest.fixture
def server():
    made = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Camera)
    made.daemon_threads = True
    made.count, made.hangs, made.asked, made.end = 1000, False, 0, threading.Event()
    thread = threading.Thread(target=made.serve_forever, daemon=True)
    thread.start()
    yield made
    made.end.set()
    made.shutdown()
    made.server_close()
    thread.join()


def address(server):
    return f"http://127.0.0.1:{server.server_address[1]}/camera.mjpg"


def watched(until, limit=15.0, **options):
    """A run in real time that ends as soon as `until(task)` holds."""

    class Watcher(Task):
        @periodic(20.0)
        def look(self):
            device = next(task for task in self.vehicle.tasks if isinstance(task, Device))
            if until(device):
                self.vehicle.kernel.stop()

    return simulate([(Device, options), Watcher], seconds=limit, clock=WallClock())


def test_a_stream_is_shared_at_its_own_rate(server):
    run = watched(lambda device: device.taken >= 20, address=address(server))
    assert len(run.frames) >= 20
    reds = [int(frame.image[20, 20, 0]) for frame in run.frames]
    assert reds == sorted(reds)
    assert run.frames[0].image.shape == (48, 64, 4)
    assert run.frames[0].image[20, 20, 1:].tolist() == pytest.approx([0, 0, 255], abs=6)
    assert run.task.entity.state is State.NORMAL


@pytest.mark.heavy
def test_a_stream_is_thinned_out(server):
    run = watched(lambda device: device.taken >= 5, address=address(server), frame_rate=10.0)
    assert np.diff([frame.time for frame in run.frames]).min() >= 0.09


@pytest.mark.heavy
def test_a_stream_that_ends_is_opened_again(server):
    server.count = 10
    run = watched(lambda device: server.asked >= 2 and device.taken >= 12, address=address(server))
    assert run.task.taken >= 12
    assert f"{address(server)}: no more frames" in run.log
    assert f"{address(server)} sends again" in run.log


@pytest.mark.heavy
def test_a_stream_that_hangs_is_opened_again_and_the_vehicle_goes_on(server):
    server.count, server.hangs = 10, True
    run = watched(lambda device: server.asked >= 2, address=address(server), timeout=0.5)
    assert server.asked >= 2
    assert run.task.failed >= 1


@pytest.mark.parametrize("where", ["/dev/video99", "http://127.0.0.1:9/camera.mjpg", "97"])
def test_a_missing_camera_is_named_and_tried_again(where):
    run = watched(lambda device: device.failed >= 2, address=where, timeout=1.0)
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description == f"{where}: cannot be opened ({run.task.failed} failed)"
    assert run.log.count(f"{where}: cannot be opened") == 1


def test_it_is_not_opened_in_virtual_time_and_needs_an_address():
    assert Device.external
    with pytest.raises(ParameterError, match="is not set"):
        simulate(Device)
