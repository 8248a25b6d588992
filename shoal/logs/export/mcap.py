"""Logs as MCAP files that Foxglove, PlotJuggler and ROS 2 tools open (profile ros2, types as text, messages in CDR)."""

from functools import cache
from pathlib import Path

import numpy as np

import imc
from imc.lsf import ReportProgress, gzip_schema
from runtime.logs import Array
from shoal.logs.export import foxglove_annotations, ros_standard_conversion
from shoal.logs.export.camera_calibration import UNLIKE, load_camera_models, photos_of_other_lenses, read_photo_cameras
from shoal.logs.export.cdr import ENCAPSULATION, CdrError, CdrRecords, Item
from shoal.logs.export.logged_detections import MUG, DetectionCollector, DetectionPoint, SystemDetections
from shoal.logs.export.mcap_writer import MESSAGE, MESSAGE_LENGTH, McapChunk, McapWriter
from shoal.logs.export.message_batches import ExportBatch, LogSource, MessageBatch, nanoseconds
from shoal.logs.export.photo_files import find_photos, photo_export_bytes
from shoal.logs.export.ros_camera_info import (
    CAMERA_INFO,
    camera_info,
    encode_camera_transform,
    missing_info_reason,
    stereo_baseline,
)
from shoal.logs.export.ros_message_encoder import ADDRESSES, RosMessageEncoder
from shoal.logs.export.ros_standard_conversion import STAMP
from shoal.logs.export.ros_types import PACKAGE, RosType
from shoal.logs.export.topic_channels import TopicChannels, ros_name

LIBRARY = "shoal"
PACKETS = RosType(f"{PACKAGE}/Packets", "# IMC packets, one behind the other, as in an LSF log\nuint8[] data\n")
PACKETS_TOPIC = ("imc", "packets")
BESIDE = ("IMC.xml.gz", "IMC.xml", "Config.ini")
LARGEST_BESIDE = 1 << 24
BALL = 0.4  # m, of a detection in the scene
LIFETIME = 5_000_000_000  # ns, for which a detection is shown

_BILLION = 1_000_000_000


def export_mcap(
    source: LogSource, path: Path, raw: bool = True, images: bool = True, progress: ReportProgress = lambda _: None
) -> int:
    """Write the selected messages of a log to a new MCAP file; returns the number of messages in it.

    Each message is on the topic /<system>/<Message>/<entity>, with the time of its packet as log time, its number in
    the export as sequence. EstimatedState and SimulatedState are also .../pose, .../odometry, .../location and on /tf,
    GpsFix is also .../location, LogBookEntry is also on /rosout, pictures in the folder Photos are on
    /<system>/<camera>/image, and with its cameras.yaml also on .../camera_info, the places of the cameras on /tf, what
    was detected in them on .../annotations. EstimatedMugState is also .../scene.
    With `raw`, /imc/packets has the packets, from which `import_mcap` restores the same log.
    Messages that their ROS type cannot hold count as skipped. Raises OSError.
    """
    with path.open("wb") as opened:
        file = McapWriter(opened, "ros2", LIBRARY)
        _attach(file, source)
        export = _Export(file, source)
        for batch in source.batches(progress):
            export.write(batch)
            if raw:
                export.write_packets(batch)
        export.write_detections()
        if images:
            export.write_photos(source.log.path.parent / "Photos")
        export.close()
        file.finish()
        return file.message_count


def _attach(file: McapWriter, source: LogSource) -> None:
    schema = source.log.schema_source
    if schema is None:
        file.add_attachment("IMC.xml.gz", "application/gzip", 0, gzip_schema(source.schema))
    for name in BESIDE:
        path = source.log.path.parent / name
        if (path == schema or (name == "Config.ini" and path.is_file())) and path.stat().st_size <= LARGEST_BESIDE:
            media = {".gz": "application/gzip", ".xml": "application/xml"}.get(path.suffix, "text/plain")
            file.add_attachment(name, media, 0, path.read_bytes())


class _Export:
    def __init__(self, file: McapWriter, source: LogSource):
        self._file = file
        self._source = source
        self._topics = TopicChannels(file)
        self._encoder = RosMessageEncoder(source.schema)
        self._frames: dict[int, str] = {}
        self._known: dict[tuple[int, int, int, str], int] = {}
        self._origin: ros_standard_conversion.MapOrigin | None = None
        self._moving: dict[int, int] = {}
        self._records: dict[tuple[int, bytes], CdrRecords] = {}
        self._prefix = cache(_plain_record)
        self._pieces = DetectionCollector()
        self._detections: dict[int, SystemDetections] = {}

    def write(self, batch: ExportBatch) -> None:
        """Write all messages of a batch, in one chunk."""
        chunk = McapChunk()
        times = nanoseconds(batch.headers["timestamp"])
        for group in self._source.groups(batch):
            if group.array is None:
                self._write_each(chunk, batch, group, times)
                continue
            sources = group.array["src"]
            for src in np.unique(sources).tolist():
                own = sources == src
                rows = group.rows[own]
                self._write_array(chunk, group.message, group.array[own], src, times[rows], rows + batch.first)
        self._file.add_chunk(chunk)

    def write_packets(self, batch: ExportBatch) -> None:
        """Write the packets, in a chunk of their own that viewers can skip."""
        chunk = McapChunk()
        data = batch.packet_bytes()
        time = int(nanoseconds(batch.headers["timestamp"][:1])[0])
        body = ENCAPSULATION + len(data).to_bytes(4, "little") + data
        chunk.add(self._topics.channel(PACKETS_TOPIC, PACKETS), batch.first & 0xFFFFFFFF, time, body)
        self._file.add_chunk(chunk)

    def write_detections(self) -> None:
        """Write what was detected, at the positions that the vehicles estimate."""
        self._detections, names = self._pieces.by_system(self._origin), self._source.names
        for src, found in self._detections.items():
            chunk = McapChunk()
            times = nanoseconds(np.array([spot.time for spot in found.spots])).tolist()
            for number, (time, spot) in enumerate(zip(times, found.spots, strict=True)):
                north, east, down = spot.place
                thing = str(spot.id), (east, north, -down), BALL, self._called(src, spot)
                parts = names.system_name(src), MUG, names.entity_label(src, spot.entity), "scene"
                body = foxglove_annotations.scene_update(time, ros_standard_conversion.MAP.decode(), LIFETIME, [thing])
                chunk.add(self._topics.channel(parts, foxglove_annotations.SCENE), number, time, ENCAPSULATION + body)
            self._file.add_chunk(chunk)

    def _called(self, src: int, spot: DetectionPoint) -> str:
        return f"{self._source.names.entity_label(src, spot.entity)} {spot.id}"

    def write_photos(self, folder: Path) -> None:
        """Write the pictures in a folder that were taken in the selected time."""
        source = self._source
        system = source.names.system_name(source.summary.owner)
        cameras = read_photo_cameras(folder, source.notes.append)
        models, detections = load_camera_models(folder, cameras), self._detections.get(source.summary.owner)
        unlike = photos_of_other_lenses(source, models)
        for number, photo in enumerate(find_photos(folder, source.summary.start)):
            if not source.selection.start <= photo.time < source.selection.end or not 0.0 <= photo.time < 1 << 31:
                continue
            if (data := photo_export_bytes(source, photo.path)) is None:
                continue
            chunk = McapChunk()
            channel = self._topics.channel((system, photo.camera, "image"), ros_standard_conversion.IMAGE)
            time = round(photo.time * 1e6) * 1000
            frame = f"{ros_name(system)}/{ros_name(photo.camera)}"  # several vehicles have cameras of one name
            body = ros_standard_conversion.image_body(time, frame.encode(), photo.format, data)
            chunk.add(channel, number, time, ENCAPSULATION + body)
            if photo.path.name in unlike:
                if (note := f"no CameraInfo: {UNLIKE.format(photo.camera)}") not in source.notes:
                    source.notes.append(note)
            elif photo.camera in cameras:
                camera = cameras[photo.camera]
                if info := camera_info(time, frame, camera, stereo_baseline(camera, cameras.values())):
                    channel = self._topics.channel((system, photo.camera, "camera_info"), CAMERA_INFO)
                    chunk.add(channel, number, time, ENCAPSULATION + info)
                elif (note := f"no CameraInfo of {camera.label}: {missing_info_reason(camera)}") not in source.notes:
                    source.notes.append(note)
                place = encode_camera_transform(time, ros_name(system), frame, camera)
                chunk.add(
                    self._topics.channel(("tf",), ros_standard_conversion.TRANSFORM),
                    number,
                    time,
                    ENCAPSULATION + place,
                )
            if detections is not None and photo.camera in models and photo.path.name not in unlike:
                shown = detections.project_into_photo(photo.time, models[photo.camera], cameras[photo.camera])
                marks = [(*pixel, size, self._called(source.summary.owner, spot)) for spot, pixel, size in shown]
                body = foxglove_annotations.image_annotations(time, marks)
                channel = self._topics.channel((system, photo.camera, "annotations"), foxglove_annotations.ANNOTATIONS)
                chunk.add(channel, number, time, ENCAPSULATION + body)
            self._file.add_chunk(chunk)

    def close(self) -> None:
        """Write what is known only at the end."""
        if self._origin is not None:
            lat, lon, height = self._origin
            where = {"latitude_rad": repr(lat), "longitude_rad": repr(lon), "height_m": repr(height)}
            self._file.add_metadata("map", {"axes": "east, north, up", **where})

    def _channel(
        self, message: imc.MessageType, src: int, entity: int, suffix: str = "", other: RosType | None = None
    ) -> int:
        key = message.id, src, entity, suffix
        channel = self._known.get(key)
        if channel is not None:
            return channel
        names = self._source.names
        system, label = names.system_name(src), names.entity_label(src, entity)
        parts = (system, message.abbrev, label, *([suffix] if suffix else []))
        channel = self._known[key] = self._topics.channel(
            parts,
            other or self._encoder.type_of(message),
            system=system,
            entity=label,
            message=message.abbrev,
            imc_source=f"{src:#06x}",
            imc_source_entity=str(entity),
            imc_id=str(message.id),
        )
        return channel

    def _channels(
        self, message: imc.MessageType, src: int, entities: Array, suffix: str = "", other: RosType | None = None
    ) -> Array:
        table = np.zeros(256, np.int64)
        for entity in np.unique(entities).tolist():
            table[entity] = self._channel(message, src, entity, suffix, other)
        return table[entities]

    def _write_array(
        self, chunk: McapChunk, message: imc.MessageType, array: Array, src: int, times: Array, numbers: Array
    ) -> None:
        frame = ros_name(self._source.names.system_name(src)).encode()
        type_ = self._encoder.type_of(message)
        self._pieces.add_rows(message.abbrev, src, array)
        record = self._records.get((message.id, frame))
        if record is None:
            record = self._records[message.id, frame] = _record(type_, frame)
        records = record.zeros(len(array))
        for name in ADDRESSES:
            records["header " + name] = array[name]
        for member in type_.fields:
            records["." + member.name] = array[member.attribute]
        _emit(chunk, record, records, self._channels(message, src, array["src_ent"]), times, numbers)
        names = {member.attribute for member in type_.fields}
        if names >= ros_standard_conversion.STATE:
            self._write_pose(chunk, message, array, src, frame, times, numbers)
        elif message.abbrev == "GpsFix" and names >= ros_standard_conversion.FIX:
            record = self._prefix(ros_standard_conversion.location_layout(frame))
            records = record.zeros(len(array))
            ros_standard_conversion.fill_gps_location(records, array)
            channels = self._channels(message, src, array["src_ent"], "location", ros_standard_conversion.LOCATION)
            _emit(chunk, record, records, channels, times, numbers)

    def _write_pose(
        self,
        chunk: McapChunk,
        message: imc.MessageType,
        array: Array,
        src: int,
        frame: bytes,
        times: Array,
        numbers: Array,
    ) -> None:
        entities = array["src_ent"]
        record = self._prefix(ros_standard_conversion.location_layout(frame))
        records = record.zeros(len(array))
        ros_standard_conversion.fill_state_location(records, array)
        channels = self._channels(message, src, entities, "location", ros_standard_conversion.LOCATION)
        _emit(chunk, record, records, channels, times, numbers)
        self._origin = self._origin or ros_standard_conversion.first_origin(array)
        if self._origin is None:
            return
        record = self._prefix(ros_standard_conversion.pose_layout())
        records = record.zeros(len(array))
        ros_standard_conversion.fill_pose(records, array, self._origin)
        channels = self._channels(message, src, entities, "pose", ros_standard_conversion.POSE)
        _emit(chunk, record, records, channels, times, numbers)
        if set(array.dtype.names or ()) >= ros_standard_conversion.MOTION:
            record = self._prefix(ros_standard_conversion.odometry_layout(frame))
            motions = record.zeros(len(array))
            ros_standard_conversion.fill_odometry(motions, records, array)
            channels = self._channels(message, src, entities, "odometry", ros_standard_conversion.ODOMETRY)
            _emit(chunk, record, motions, channels, times, numbers)
        if message.abbrev != "EstimatedState":
            return
        # One transform per vehicle: two entities that estimate its state would make its frame jump between them.
        own = entities == self._moving.setdefault(src, int(entities[0]))
        record = self._prefix(ros_standard_conversion.transform_layout(frame))
        transforms = record.zeros(int(own.sum()))
        transforms["count"] = 1
        for name in ros_standard_conversion.PLACE:
            transforms[name] = records[name][own]
        channel = self._topics.channel(("tf",), ros_standard_conversion.TRANSFORM)
        _emit(chunk, record, transforms, np.full(len(transforms), channel), times[own], numbers[own])

    def _write_each(self, chunk: McapChunk, batch: ExportBatch, group: MessageBatch, times: Array) -> None:
        message, entries = group.message, group.message.abbrev == "LogBookEntry"
        seconds, rests = (part.tolist() for part in np.divmod(times[group.rows], _BILLION))
        numbers = (group.rows + batch.first & 0xFFFFFFFF).tolist()
        for place, said in self._source.decode(batch, group.rows):
            src = said.src
            frame = self._frames.get(src)
            if frame is None:
                frame = self._frames[src] = ros_name(self._source.names.system_name(src))
            try:
                data = self._encoder.encode(said, message, seconds[place], rests[place], frame)
            except CdrError as error:
                self._source.skipped[str(error)] += 1
                continue
            time, number = seconds[place] * _BILLION + rests[place], numbers[place]
            channel = self._known.get((message.id, src, said.src_ent, "")) or self._channel(message, src, said.src_ent)
            chunk.add(channel, number, time, data)
            if entries:
                self._write_entry(chunk, said, time, number)

    def _write_entry(self, chunk: McapChunk, entry: imc.Message, time: int, number: int) -> None:
        names = self._source.names
        name = f"{names.system_name(entry.src)}.{names.entity_label(entry.src, entry.src_ent)}"
        body = ros_standard_conversion.log_body(time, entry, name)
        chunk.add(self._topics.channel(("rosout",), ros_standard_conversion.LOG), number, time, ENCAPSULATION + body)


def _plain_record(items: tuple[Item, ...]) -> CdrRecords:
    return CdrRecords(MESSAGE, items)


def _record(type_: RosType, frame: bytes) -> CdrRecords:
    # No field of a message begins with a point, so the names cannot collide with those of the record.
    addresses = [("header " + name, code) for name, code in ADDRESSES.items()]
    return CdrRecords(
        MESSAGE, (*STAMP, frame, *addresses, *(("." + member.name, member.code) for member in type_.fields))
    )


def _emit(chunk: McapChunk, record: CdrRecords, records: Array, channels: Array, times: Array, numbers: Array) -> None:
    """Fill in all but the fields of the messages, and add the records to the chunk."""
    records["opcode"] = 5
    records["length"] = MESSAGE_LENGTH + record.data_size
    records["channel"] = channels
    records["sequence"] = numbers & 0xFFFFFFFF
    records["log_time"] = records["publish_time"] = times
    records["sec"], records["nanosec"] = np.divmod(times, _BILLION)
    chunk.add_block(records.tobytes(), record.size, channels, times)
