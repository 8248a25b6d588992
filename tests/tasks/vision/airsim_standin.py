"""A stand-in for AirSim at the level of its protocol: colors tell the direction in the world in which a pixel looks."""

import math
import socket
import threading

import msgspec
import numpy as np

VIEWER = 89.90362548828125  # °, what AirSim answers for fov, whatever the pictures have
FORWARD = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
PITCH, YAW = "Pitch", "Yaw"
SETTINGS = {
    "fisheye_down": {PITCH: -90.0},
    "fisheye_front": {},
    "fisheye_right": {YAW: 90.0},
    "fisheye_back": {YAW: 180.0},
    "fisheye_left": {YAW: -90.0},
    "fisheye_up": {PITCH: 90.0},
    "front_center": {},
}


def about(axis, angle):
    """The quaternion w, x, y, z of a turn."""
    found = np.zeros(4)
    found[0], found[1 + axis] = math.cos(angle / 2), math.sin(angle / 2)
    return found


def times(a, b):
    (w, *u), (s, *v) = a, b
    u, v = np.array(u), np.array(v)
    return np.concatenate(([w * s - u @ v], w * v + s * u + np.cross(u, v)))


def turned(q, v):
    return times(times(q, [0.0, *v]), q * [1, -1, -1, -1])[1:]


def named(q):
    return dict(zip(("w_val", "x_val", "y_val", "z_val"), map(float, q), strict=True))


def vector(v):
    return dict(zip(("x_val", "y_val", "z_val"), map(float, v), strict=True))


def colors(directions):
    """RGB of directions (..., 3) in the world: 127.5 + 127.5 times their north, east and down."""
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.rint(127.5 + 127.5 * unit).astype(np.uint8)


class StandIn:
    """What each answer follows is in airsim_standin_sources.yaml.

    Listens at a port of its own until it is closed. `fault(method, answer)` may change the bytes of an answer, or
    return None to stay silent. `version` 4 is Cosys-AirSim. `fov` (°) is that of the longer side of the pictures.
    """

    def __init__(self, width=64, height=64, version=1, port=0, settings=SETTINGS, lever=(0.5, 0.0, 0.1), fov=90.0):
        self.width, self.height, self.version = width, height, version
        self.settings, self.lever, self.fov = settings, np.array(lever), fov
        self.place, self.turn = np.zeros(3), about(0, 0.0)
        self.stamp = 1_700_000_000_000_000_000
        self.calls, self.depth = [], 3
        self.told = None  # settings.json, if this server sends it
        self.paused, self.polls = False, 0
        self.fault = lambda method, answer: answer
        self._server = socket.create_server(("127.0.0.1", port))
        self.port = self._server.getsockname()[1]
        self._peers = set()
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for each in (self._server, *list(self._peers)):
            try:
                each.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            each.close()

    def _accept(self):
        while True:
            try:
                peer, _ = self._server.accept()
            except OSError:
                return
            self._peers.add(peer)
            threading.Thread(target=self._serve, args=(peer,), daemon=True).start()

    def _serve(self, peer):
        data = b""
        try:
            while more := peer.recv(1 << 16):
                data += more
                try:
                    _, number, method, given = msgspec.msgpack.decode(data)
                except msgspec.DecodeError:
                    continue
                data = b""
                answer = self.fault(method, self._answer(number, method, given))
                if answer is not None:
                    peer.sendall(answer)
        except OSError:
            pass

    def _answer(self, number, method, given):
        self.calls.append((method, given))
        try:
            result, error = getattr(self, f"do_{method}")(*given), None
        except (AttributeError, TypeError):
            words = f"rpclib: function '{method}' (called with {len(given)} arg(s)) threw an exception."
            result, error = None, words
        except KeyError as wrong:
            result, error = None, f"rpclib: no camera {wrong}"
        return msgspec.msgpack.encode([1, number, error, result])

    def do_ping(self):
        return True

    def do_getServerVersion(self):
        return self.version

    def do_getMinRequiredClientVersion(self):
        return self.version

    def do_getHomeGeoPoint(self, vehicle):
        return {"latitude": 41.185, "longitude": -8.706, "altitude": 50.0}

    def do_simSetVehiclePose(self, pose, ignore_collision, vehicle):
        self.place = np.array([pose["position"][k] for k in ("x_val", "y_val", "z_val")])
        self.turn = np.array([pose["orientation"][k] for k in ("w_val", "x_val", "y_val", "z_val")])

    def do_simGetGroundTruthKinematics(self, vehicle):
        return {
            "position": vector(self.place),
            "orientation": named(self.turn),
            "linear_velocity": vector((0.0, 3.0, 0.0)),
            "angular_velocity": vector((0.1, 0.2, 0.3)),
            "linear_acceleration": vector((0.0, 0.0, 0.0)),
            "angular_acceleration": vector((0.0, 0.0, 0.0)),
        }

    def do_simGetCameraInfo(self, camera, vehicle, *external):
        assert len(external) == (self.version < 4)
        place, turn = self.pose(camera)
        across, down = (2 * self.focal / side for side in (self.width, self.height))
        matrix = [[0.0, across, 0.0, 0.0], [0.0, 0.0, -down, 0.0], [0.0, 0.0, 0.0, 10.0], [-1.0, 0.0, 0.0, 0.0]]
        pose = {"position": vector(place), "orientation": named(turn)}
        return {"pose": pose, "fov": VIEWER, "proj_mat": {"matrix": matrix}}

    def do_getSettingsString(self):
        if self.told is None:
            raise AttributeError
        return self.told

    def do_simGetImages(self, requests, vehicle, *external):
        if len(external) != (self.version < 4):
            raise TypeError
        self.stamp += 1_000_000
        return [self.image(request) for request in requests]

    def do_simPause(self, paused):
        self.paused = paused

    def do_simContinueForTime(self, seconds):
        assert self.paused
        self.stamp += round(seconds * 1e9)
        self.place = self.place + np.array([0.0, 3.0, 0.0]) * seconds
        self.polls = 2

    def do_simIsPaused(self):
        self.polls -= 1
        return self.polls < 0

    def pose(self, camera):
        angles = self.settings[camera]
        turn = times(about(2, math.radians(angles.get(YAW, 0.0))), about(1, math.radians(angles.get(PITCH, 0.0))))
        return self.place + turned(self.turn, self.lever), times(self.turn, turn)

    @property
    def focal(self):
        return 0.5 * max(self.width, self.height) / math.tan(math.radians(self.fov) / 2)

    def pixels(self, camera):
        """RGB as the camera sees the world."""
        _, turn = self.pose(camera)
        f = self.focal
        u, v = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        rays = np.stack(((u - self.width / 2) / f, (v - self.height / 2) / f, np.ones_like(u)), axis=-1)
        matrix = np.stack([turned(turn, axis) for axis in np.eye(3)], axis=-1)
        return colors(rays @ (matrix @ FORWARD).T)

    def image(self, request):
        place, turn = self.pose(request["camera_name"])
        rgb = self.pixels(request["camera_name"])
        data = np.ascontiguousarray(rgb[..., ::-1]).tobytes()
        if self.depth == 4:
            data = np.concatenate((rgb, np.full((*rgb.shape[:2], 1), 255, np.uint8)), axis=-1).tobytes()
        if request["compress"]:
            import io

            from PIL import Image

            file = io.BytesIO()
            Image.fromarray(rgb).save(file, format="PNG")
            data = file.getvalue()
        return {
            "image_data_uint8": data,
            "image_data_float": [0.0],
            "camera_name": request["camera_name"],
            "camera_position": vector(place),
            "camera_orientation": named(turn),
            "time_stamp": self.stamp,
            "message": "",
            "pixels_as_float": False,
            "compress": request["compress"],
            "width": self.width,
            "height": self.height,
            "image_type": request["image_type"],
        }
