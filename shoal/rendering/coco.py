"""Pictures and their objects as a COCO data set: images, annotations with boxes and masks, categories."""

import json
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shoal.logs.export import LogSource, export_suffix, photo_export_bytes
from shoal.rendering.label_files import class_name
from shoal.rendering.logged_exposures import find_exposures
from tasks.vision.cameras.image_saver import PHOTOS_FOLDER
from world.rendering import ImageLabels, ObjectBox, PixelClass

ANNOTATIONS_FILE = "annotations.json"
IMAGES = "images"
THINGS = (PixelClass.GLIDER, PixelClass.BOARD)


class AnnotatedPicture(NamedTuple):
    """A picture of a data set: its file, when it was taken (s since 1970 UTC), its size (px), and its annotations."""

    file: str
    time: float
    camera: str
    width: int
    height: int
    annotations: list[dict[str, Any]]


def coco_annotations(labels: ImageLabels) -> list[dict[str, Any]]:
    """The annotations of the objects of which a pixel is visible, without ids.

    `bbox` is left, top, width, height (px); `segmentation` counts pixels in and out of the mask, column by column
    (COCO's uncompressed run lengths). `attributes` are not of COCO: the object's number, and the shares of it that
    others hide and that the border cuts off.
    """
    return [_annotation(labels, box) for box in labels.boxes if box.area]


def _annotation(labels: ImageLabels, box: ObjectBox) -> dict[str, Any]:
    left, top, right, bottom = box.box
    return {
        "category_id": int(box.kind),
        "bbox": [left, top, right - left, bottom - top],
        "area": box.area,
        "iscrowd": 0,
        "segmentation": {"size": list(labels.kinds.shape), "counts": run_lengths(labels.instances == box.instance)},
        "attributes": {
            "instance": box.instance,
            "occluded": round(box.occluded_share, 6),
            "cut": round(box.cut_share, 6),
        },
    }


def run_lengths(mask: NDArray[np.bool_]) -> list[int]:
    """The lengths of the runs of a mask (height, width), column by column, the first one of pixels outside of it."""
    flat = np.concatenate(([False], mask.ravel(order="F"), [not mask[-1, -1]]))
    ends = np.flatnonzero(flat[1:] != flat[:-1])
    return np.diff(ends, prepend=0).tolist()


def coco_json(pictures: Iterable[AnnotatedPicture]) -> str:
    """The text of a data set."""
    images, annotations, numbers = list[dict[str, Any]](), list[dict[str, Any]](), count(1)
    for number, picture in enumerate(pictures, start=1):
        taken = datetime.fromtimestamp(picture.time, UTC)
        images.append(
            {
                "id": number,
                "file_name": picture.file,
                "width": picture.width,
                "height": picture.height,
                "date_captured": taken.isoformat(sep=" ", timespec="microseconds").removesuffix("+00:00"),
                "camera": picture.camera,
            }
        )
        annotations += ({"id": next(numbers), "image_id": number, **found} for found in picture.annotations)
    categories = [{"id": int(kind), "name": class_name(kind), "supercategory": "object"} for kind in THINGS]
    return json.dumps({"images": images, "annotations": annotations, "categories": categories}) + "\n"


def export_coco(source: LogSource, folder: Path, progress: Callable[[float], object] = lambda _: None) -> int:
    """Write the pictures in Photos beside a log to images/, and annotations.json; returns how many there are.

    Their labels are those of the cameras of the run, from SimulatedState. A picture that none of them took, or with a
    lens that the log does not contain, counts as skipped in `source`. Raises ValueError without any picture, OSError,
    and what find_exposures raises.
    """
    files = sorted(path for path in (source.log.path.parent / PHOTOS_FOLDER).glob("*_*_*.*") if path.is_file())
    if not files:
        raise ValueError(
            f"{source.log.path}: no pictures beside it in {PHOTOS_FOLDER}; "
            f"shoal log render makes some, with {ANNOTATIONS_FILE}"
        )
    seen = find_exposures(source.log)
    shots = {_key(shot.name): shot for shot in seen.pictures}
    (folder / IMAGES).mkdir(parents=True)
    pictures = list[AnnotatedPicture]()
    source.packets = source.summary.packets
    for place, file in enumerate(files, start=1):
        shot = shots.get(_key(file.name))
        if shot is None:
            source.skipped[f"{PHOTOS_FOLDER}/{file.name} is of no camera of the run"] += 1
        elif shot.optics_changed:
            source.skipped[f"{PHOTOS_FOLDER}/{file.name} was taken with another lens, which changed unnoticed"] += 1
        elif source.selection.start <= shot.time < source.selection.end:
            if (data := photo_export_bytes(source, file)) is None:
                continue
            name = f"{IMAGES}/{file.stem}{export_suffix(file)}"
            (folder / name).write_bytes(data)
            camera, shutter = seen.camera_of(shot)
            found = coco_annotations(shutter.labels(shot.standpoints, shot.gliders, boards=shot.boards))
            size = camera.optics.width, camera.optics.height
            pictures.append(AnnotatedPicture(name, shot.time, shot.camera, *size, found))
        progress(place / len(files))
    (folder / ANNOTATIONS_FILE).write_text(coco_json(pictures))
    return len(pictures)


def _key(name: str) -> tuple[str, str]:
    """Camera and time in the name of a picture, whose number depends on how many were taken."""
    camera, _, time = name.rsplit(".", 1)[0].rsplit("_", 2)
    return camera, time
