"""Labels of a picture that is taken band by band, each from where the vehicle is then: those of a rolling shutter."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from world.rendering.labels import ImageLabels, ObjectBox, PixelClass
from world.rendering.objects.calibration_targets import Board
from world.rendering.objects.glider import Glider
from world.rendering.scene_camera import SceneCamera
from world.rendering.scenes import ScenePose

Corners = tuple[int, int, int, int]


def label_bands(
    camera: SceneCamera,
    bands: Sequence[SceneCamera],
    standpoints: Sequence[ScenePose],
    gliders: Sequence[Glider] | None = None,
    following: tuple[Sequence[ScenePose], Sequence[Glider]] | None = None,
    boards: Sequence[Board] = (),
) -> ImageLabels:
    """The labels of a camera whose `bands` of rows, from the top, are each seen from a standpoint of its own.

    Flow leads to the row of the following picture, with as many standpoints, in which the point is seen there. What is
    cut off of an object is the mean of all bands that show it, by the pixels in each. Raises ValueError like
    Labeler.labels.
    """
    parts = [
        band.labels(standpoint, gliders, None, boards) for band, standpoint in zip(bands, standpoints, strict=True)
    ]
    flow = None
    if following is not None:
        flow = np.concatenate(list(_flows(bands, parts, standpoints, gliders, following)))
    things = [*camera.numbered_gliders(gliders), *boards]
    boxes = [box for thing in things if (box := _joined_box(camera, thing, parts, standpoints)) is not None]
    return ImageLabels(
        np.concatenate([part.distance for part in parts]),
        np.concatenate([part.depth for part in parts]),
        np.concatenate([part.kinds for part in parts]),
        np.concatenate([part.instances for part in parts]),
        tuple(boxes),
        flow,
    )


def _flows(
    bands: Sequence[SceneCamera],
    parts: Sequence[ImageLabels],
    standpoints: Sequence[ScenePose],
    gliders: Sequence[Glider] | None,
    following: tuple[Sequence[ScenePose], Sequence[Glider]],
) -> Iterator[NDArray[np.float32]]:
    """The flow of each band: to that band of the next picture in whose rows it ends, or else the nearest one."""
    borders = np.cumsum([0, *(band.optics.height for band in bands)])
    for band, part, standpoint, top in zip(bands, parts, standpoints, borders, strict=False):
        rows = (top + np.arange(band.optics.height) + 0.5)[:, np.newaxis]
        best, least = np.full((*part.kinds.shape, 2), np.nan, np.float32), np.full(part.kinds.shape, np.inf)
        for after, first, last in zip(following[0], borders, borders[1:], strict=False):
            found = band.flow(part, standpoint, gliders, (after, following[1]))
            row = rows + found[..., 1]
            beyond = np.maximum(np.maximum(first - row, row - last), 0.0)
            closer = beyond < least
            best[closer], least[closer] = found[closer], beyond[closer]
        yield best


def _joined_box(
    camera: SceneCamera, thing: Glider | Board, parts: Sequence[ImageLabels], standpoints: Sequence[ScenePose]
) -> ObjectBox | None:
    kind = PixelClass.BOARD if isinstance(thing, Board) else PixelClass.GLIDER
    seen, whole, cuts, top = list[Corners](), list[Corners](), list[tuple[int, float]](), 0
    area = 0
    for part, standpoint in zip(parts, standpoints, strict=True):
        for box in part.boxes:
            if (box.instance, box.kind) == (thing.id, kind):
                if box.area:
                    seen.append(_lowered(box.box, top))
                whole.append(_lowered(box.whole_box, top))
                area += box.area
                cuts.append((box.whole_area, camera.cut_share(standpoint, thing)))
        top += part.kinds.shape[0]
    if not whole:
        return None
    whole_area = sum(pixels for pixels, _ in cuts)  # integers
    cut = math.fsum(pixels * share for pixels, share in cuts) / whole_area
    return ObjectBox(thing.id, kind, _around(seen), area, _around(whole), whole_area, cut)


def _lowered(box: Corners, rows: int) -> Corners:
    left, top, right, bottom = box
    return left, top + rows, right, bottom + rows


def _around(boxes: Sequence[Corners]) -> Corners:
    """The box that holds all of them; zeros around none."""
    if not boxes:
        return 0, 0, 0, 0
    left, top, right, bottom = zip(*boxes, strict=True)
    return min(left), min(top), max(right), max(bottom)
