"""Pictures of the cameras of vehicles, which are asked for while somebody looks at them."""

import asyncio
import time
from collections.abc import Iterator, Mapping
from itertools import count
from typing import Any

import imc
from imc import console_acl
from imc.reserved_ids import UNKNOWN_ENTITY
from shoal.console.cameras.camera_picture import CameraPicture, parse_picture
from shoal.console.cameras.detection_marks import Mark, RecentDetections
from shoal.network import MessageListener, MessageUse, Network, NetworkSystem
from support.number_parsing import natural_number
from support.terminal_text import printable

KINDS = (imc.CompressedImage, imc.CameraFrame, imc.EstimatedState, imc.EstimatedMugState)
FOLLOWED = (imc.EstimatedState, imc.EstimatedMugState, imc.LogBookEntry)
UNSEEN = 10.0  # s after the last question, when nobody looks any more
REQUEST_PERIOD = 1.0  # s between two requests for pictures
RATE, LIVE_RATE = 1, 5  # Hz
MOST_CAMERAS = 32

CameraView = dict[str, Any]


class PictureSubscription:
    """Asks a vehicle for pictures of its cameras, once a second at most for each."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._asked: dict[tuple[str, int], float] = {}

    def renew(self, system: NetworkSystem, entity: int = UNKNOWN_ENTITY, rate: int = RATE) -> None:
        """Ask for so many pictures a second of a camera, by default of all, for the next seconds."""
        now, place = time.monotonic(), (system.name, entity)
        if system.id is None or now - self._asked.get(place, 0.0) < REQUEST_PERIOD:
            return
        self._asked[place] = now
        self._network.send(system, imc.ImageTxSettings(fps=rate, dst_ent=entity))


class _Camera:
    """The newest picture of a camera, and the trouble with those that cannot be shown."""

    def __init__(self) -> None:
        self.message: imc.CompressedImage | None = None
        self.picture: CameraPicture | None = None
        self.number: int = 0
        self.damaged: int = 0
        self.trouble: str = ""

    def take(self, message: imc.CompressedImage, numbers: Iterator[int]) -> None:
        """Take a message; a picture gets the next number, which no other one of this program has."""
        if message is self.message:
            return
        self.message = message
        try:
            self.picture, self.trouble = parse_picture(message), ""
            self.number = next(numbers)
        except ValueError as error:
            self.damaged += 1
            self.trouble = f"damaged: {error} ({self.damaged})"


class _Vehicle:
    """The cameras and detections of a vehicle that somebody looks at."""

    def __init__(self, listener: MessageListener, use: MessageUse) -> None:
        self.listener, self.use = listener, use
        self.cameras: dict[int, _Camera] = {}
        self.detections: RecentDetections = RecentDetections()
        self.refusal: str = ""
        self.ending: asyncio.TimerHandle | None = None


class LivePictures:
    """The newest picture of each camera of each vehicle. Calls are made in the event loop of the network."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._requests = PictureSubscription(network)
        self._vehicles: dict[str, _Vehicle] = {}
        self._numbers = count(1)

    async def describe(self, system: NetworkSystem, live: str = "") -> dict[str, Any]:
        """The page's data of the cameras of a vehicle; the camera `live` is asked for more pictures than the others.

        Times are in s; `age` is that of the picture by the clock of the vehicle. `marks` are detections, see
        `picture_marks`.
        """
        vehicle = self._follow(system)
        self._requests.renew(system)
        entity = natural_number(live)
        if entity is not None and entity in vehicle.cameras:
            self._requests.renew(system, entity, LIVE_RATE)
        self._take(system, vehicle)
        views = [self._view(system, vehicle, number) for number in sorted(vehicle.cameras)]
        return {"note": vehicle.refusal or ("" if views else self.no_camera_text(system)), "cameras": views}

    def no_camera_text(self, system: NetworkSystem) -> str:
        name = printable(system.name)
        return f"no camera of {name} has sent a picture; a simulated one does with `-p Simulation,Camera`"

    async def picture(self, system: NetworkSystem, camera: str, number: int) -> tuple[str, bytes] | None:
        """Format and data of a picture; None if it is not the newest one any more."""
        vehicle, entity = self._vehicles.get(system.name), natural_number(camera)
        found = None if vehicle is None or entity is None else vehicle.cameras.get(entity)
        if found is None or found.picture is None or found.number != number:
            return None
        return found.picture.header.format, found.picture.data

    def marks(self, system: NetworkSystem, vehicle: RecentDetections, picture: CameraPicture) -> list[Mark]:
        return vehicle.marks(picture, system.label)

    def age(self, system: NetworkSystem, picture: CameraPicture) -> float:
        """s since the exposure, by the newest time stamp of the vehicle, and for how long that has been silent."""
        newest = [system.latest_message(kind) for kind in (imc.EstimatedState, imc.Heartbeat)]
        stamps = [message.timestamp for message in newest if message is not None]
        return max(stamps, default=picture.time) - picture.time + system.age

    def _follow(self, system: NetworkSystem) -> _Vehicle:
        vehicle = self._vehicles.get(system.name)
        if vehicle is None:
            listener, use = self._network.listen(system, FOLLOWED), self._network.subscribe(system, KINDS)
            vehicle = self._vehicles[system.name] = _Vehicle(listener, use)
        if vehicle.ending is not None:
            vehicle.ending.cancel()
        vehicle.ending = asyncio.get_running_loop().call_later(UNSEEN, self._forget, system.name)
        return vehicle

    def forget_pictures(self) -> None:
        """Forget what was received up to now."""
        for vehicle in self._vehicles.values():
            vehicle.cameras.clear()

    def _forget(self, name: str) -> None:
        vehicle = self._vehicles.pop(name)
        self._network.close_listener(vehicle.listener)
        vehicle.use.close()

    def _take(self, system: NetworkSystem, vehicle: _Vehicle) -> None:
        for _, message in vehicle.listener.take_all():
            if isinstance(message, imc.LogBookEntry):
                if message.dst == self._network.console.id and message.context == console_acl.CONTEXT:
                    vehicle.refusal = printable(message.text)
            elif message.src in system.ids:
                vehicle.detections.add(message)
        for message in (*system.latest_entity_messages(imc.CameraFrame), *_pictures_of(system)):
            if message.src in system.ids and (
                message.src_ent in vehicle.cameras or len(vehicle.cameras) < MOST_CAMERAS
            ):
                camera = vehicle.cameras.setdefault(message.src_ent, _Camera())
                if isinstance(message, imc.CompressedImage):
                    camera.take(message, self._numbers)

    def _view(self, system: NetworkSystem, vehicle: _Vehicle, entity: int) -> CameraView:
        camera = vehicle.cameras[entity]
        picture, label = camera.picture, system.label(entity)
        if picture is not None and picture.label:
            is_same = system.matches_label(entity, picture.label)  # keys of zenoh have _ for blanks
            label = picture.label if is_same or entity not in system.labels else label
        view: CameraView = {"camera": str(entity), "label": printable(label), "trouble": camera.trouble}
        if picture is None:
            return {**view, "number": None, "age": None, "marks": []}
        marks = self.marks(system, vehicle.detections, picture)
        return {**view, "number": camera.number, **picture_view(picture, self.age(system, picture), marks)}


def picture_view(picture: CameraPicture, age: float, marks: list[Mark]) -> Mapping[str, Any]:
    """The page's data of a picture."""
    form, width, height, _ = picture.header
    words = {"width": width, "height": height, "format": "jpg" if form == "jpeg" else form}
    return {**words, "time": round(picture.time, 3), "age": round(age, 2), "marks": marks}


def _pictures_of(system: NetworkSystem) -> list[imc.CompressedImage]:
    return list(system.latest_entity_messages(imc.CompressedImage))
