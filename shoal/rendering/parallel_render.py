"""Renders the pictures and labels of a logged run on several processors: the same bytes on any number of them."""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import imc
from shoal.rendering import coco
from shoal.rendering.label_files import LABELS, boxes_to_dicts, class_numbers, write_labels
from shoal.rendering.logged_exposures import CameraVersion, ExposedPicture, find_exposures
from shoal.rendering.process_pool import IndexedWork, RenderPool
from shoal.rerun import ResimulationError
from tasks.vision.cameras.camera_metadata import CAMERAS_FILE
from tasks.vision.cameras.image_saver import PHOTOS_FOLDER
from tasks.vision.cameras.picture_files import write_picture

MOST_NOTES = 20

PictureRecord = tuple[dict[str, Any], list[dict[str, Any]]]
"""The record of a picture in the file of all labels, and its annotations in that of COCO."""


@dataclass(frozen=True)
class LogRenderer:
    """Renders the pictures of a run: each of `pictures` with the next one of its camera; whether labels have flow."""

    cameras: Mapping[str, Sequence[CameraVersion]]
    pictures: Sequence[tuple[ExposedPicture, ExposedPicture | None]]
    folder: Path
    labels: bool
    flow: bool

    def render_picture(self, number: int) -> PictureRecord:
        """Render a picture, and describe its content. Raises OSError."""
        shot, after = self.pictures[number]
        camera, shutter = self.cameras[shot.camera][shot.camera_number]
        error = write_picture(
            self.folder / PHOTOS_FOLDER / shot.name, shutter.take_picture(*shot.shutter_arguments), shot.image_format
        )
        if error:
            raise OSError(error)
        optics = camera.optics
        annotations = list[dict[str, Any]]()
        about: dict[str, Any] = {"file": shot.name, "camera": shot.camera, "time": shot.time}
        about |= {"width": optics.width, "height": optics.height}
        if self.labels:
            following = (after.standpoints, after.gliders) if after is not None and self.flow else None
            try:
                found = shutter.labels(shot.standpoints, shot.gliders, following, shot.boards)
            except ValueError as refused:
                about["error"] = str(refused)
            else:
                write_labels(self.folder / LABELS, Path(shot.name).stem, found)
                about["objects"] = boxes_to_dicts(found.boxes)
                annotations = coco.coco_annotations(found)
        return about, annotations


class RenderSummary(NamedTuple):
    """Number of pictures of each camera, and notes on them."""

    pictures: dict[str, int]
    notes: list[str]


def render_log(
    log: imc.Log,
    folder: Path,
    *,
    cameras: Path | None = None,
    world: Path | None = None,
    labels: bool = True,
    flow: bool = False,
    processes: int | None = None,
    progress: Callable[[float], object] = lambda _: None,
) -> RenderSummary:
    """Write Photos/ as the run itself would have it, Labels/, labels.json and annotations.json (COCO) to a folder.

    `cameras` and `world` are ini files, see find_exposures. `processes` is how many render, by default one on each
    processor. Raises what find_exposures raises, ResimulationError if there is nothing to see, and OSError.
    """
    pool = RenderPool((processes or os.cpu_count() or 1) - 1)
    with closing(pool):
        seen = find_exposures(log, cameras, world)
        if not seen.pictures:
            raise ResimulationError(f"{log.path}: there is no picture in this log: {'; '.join(seen.notes)}")
        pairs = list(_pairs(seen.pictures))
        (folder / PHOTOS_FOLDER).mkdir(parents=True, exist_ok=True)
        (folder / PHOTOS_FOLDER / CAMERAS_FILE).write_bytes(seen.description)
        found: dict[str, PictureRecord] = {}
        renderer = LogRenderer(seen.cameras, pairs, folder, labels, flow)
        for picture in pool.run(IndexedWork(renderer.render_picture, len(pairs))):
            found[picture[0]["file"]] = picture
            progress(len(found) / len(pairs))
    rendered = [found[shot.name] for shot, _ in pairs]
    if labels:
        text = json.dumps({"classes": class_numbers(), "pictures": [about for about, _ in rendered]}, indent=1)
        (folder / f"{LABELS.lower()}.json").write_text(text + "\n")
        (folder / coco.ANNOTATIONS_FILE).write_text(coco.coco_json(_annotated(rendered)))
    counts = {label: sum(shot.camera == label for shot in seen.pictures) for label in sorted(seen.cameras)}
    refused = [f"{about['file']} has no labels: {about['error']}" for about, _ in rendered if "error" in about]
    return RenderSummary(counts, [*seen.notes, *refused[:MOST_NOTES]])


def _annotated(pictures: Iterable[PictureRecord]) -> Iterator[coco.AnnotatedPicture]:
    for about, annotations in pictures:
        file = f"{PHOTOS_FOLDER}/{about['file']}"
        yield coco.AnnotatedPicture(file, about["time"], about["camera"], about["width"], about["height"], annotations)


def _pairs(shots: Sequence[ExposedPicture]) -> Iterator[tuple[ExposedPicture, ExposedPicture | None]]:
    """Pairs of each picture and the next one of its camera, if that has not changed meanwhile."""
    after: dict[str, ExposedPicture] = {}
    pairs: list[tuple[ExposedPicture, ExposedPicture | None]] = []
    for shot in reversed(shots):
        following = after.get(shot.camera)
        pairs.append(
            (shot, following if following is not None and following.camera_number == shot.camera_number else None)
        )
        after[shot.camera] = shot
    yield from reversed(pairs)
