"""A vehicle whose camera sends what a test wants, over a network in this process."""

import asyncio
import json

import numpy as np

import imc
from runtime import Frame
from support.pose import DOWN
from tasks.vision.cameras.picture_transmission import encode_picture
from tests.shoal.console.foxglove.packet_radio import Radio
from world.optics import PinholeModel
from world.rendering import optical_to_body_transform

NAME, START, CAMERA, DETECTOR = "lauv-noptilus-1", 1.7e9, 7, 8
LABELS = "Front=7;Detector=8"
OPTICS = PinholeModel(64, 48, 40.0, 40.0, 32.0, 24.0)


class CameraRadio(Radio):
    """Brings messages from any thread, and keeps those that are sent to the vehicle."""

    fragment_size = 0  # B, of a link that splits packets

    def __init__(self):
        self.sent = []

    async def open(self, listener, console):
        await super().open(listener, console)
        self.loop = asyncio.get_running_loop()
        self.loop.call_soon(self.bring, *first_messages())

    def send(self, system, message, packet):
        self.sent.append(message)

    def bring_soon(self, *messages):
        self.loop.call_soon_threadsafe(lambda: self.bring(*messages))


def from_vehicle(kind, time, entity=CAMERA, **fields):
    return kind(timestamp=START + time, src=0x1A, src_ent=entity, **fields)


def first_messages():
    report = imc.EntityList.Op.REPORT
    yield from_vehicle(imc.Announce, 0.0, 0, sys_name=NAME, sys_type=imc.SystemType.UUV)
    yield from_vehicle(imc.EntityList, 0.0, 0, op=report, list=LABELS)
    yield state(0.0)


def state(time, **fields):
    """4 m above the bottom, heading north."""
    return from_vehicle(imc.EstimatedState, time, 1, **{"lat": 0.7, "lon": -0.1, "alt": 4.0, **fields})


def jpeg(time, color=(0, 90, 90), index=0, optics=OPTICS, label="Front"):
    image = np.full((48, 64, 4), (*color, 255), np.uint8)
    frame = Frame(START + time, label, index, image, {}, optics, optical_to_body_transform(DOWN))
    return encode_picture(frame, 75)[0]


def picture(time, data=None, entity=CAMERA, **options):
    return from_vehicle(imc.CompressedImage, time, entity, data=jpeg(time, **options) if data is None else data)


def cameras(page, live=""):
    status, content, _ = page.request("GET", f"/api/cameras?vehicle={NAME}&live={live}")
    assert status == 200, content
    return json.loads(content)


def only_camera(page):
    """The one camera; None while there is none."""
    found = cameras(page)["cameras"]
    assert len(found) <= 1
    return found[0] if found else None
