"""Labels of pictures on disk: images of classes and instances, arrays of distances, and boxes."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from world.rendering import ImageLabels, ObjectBox, PixelClass

LABELS = "Labels"
COMPRESSION = 1  # of 9


def write_labels(folder: Path, stem: str, labels: ImageLabels) -> None:
    """Write <stem>.class.png (8 bits), <stem>.instance.png (16 bits) and <stem>.npz to a folder; none has a date.

    The npz has `distance` and `depth` (m, float32) and, if there is any, `flow` (px, float32), as in ImageLabels.
    Raises OSError.
    """
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for name, image in (("class", labels.kinds), ("instance", labels.instances)):
        Image.fromarray(image).save(folder / f"{stem}.{name}.png", compress_level=COMPRESSION)
    file = folder / f"{stem}.npz"
    if labels.flow is None:
        np.savez(file, distance=labels.distance, depth=labels.depth)
    else:
        np.savez(file, distance=labels.distance, depth=labels.depth, flow=labels.flow)


def class_numbers() -> dict[str, int]:
    """The numbers of the classes."""
    return {class_name(kind): int(kind) for kind in PixelClass}


def class_name(kind: PixelClass) -> str:
    return kind.name.lower()


def boxes_to_dicts(boxes: Iterable[ObjectBox]) -> list[dict[str, Any]]:
    """The record of the objects in a picture; boxes are left, top, right, bottom in px, and null without a pixel."""
    return [
        {
            "instance": box.instance,
            "class": class_name(box.kind),
            "box": list(box.box) if box.area else None,
            "area": box.area,
            "whole_box": list(box.whole_box),
            "whole_area": box.whole_area,
            "occluded": round(box.occluded_share, 6),
            "cut": round(box.cut_share, 6),
        }
        for box in boxes
    ]
