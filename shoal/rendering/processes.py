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
from shoal.rendering.crew import Crew, Work
from shoal.rendering.exposures import Eye, Shot, expose
from shoal.rendering.label_files import LABELS, describe_boxes, kinds, write_labels
from shoal.rerun import ResimulationError
from tasks.vision.cameras.camera_records import FILE
from tasks.vision.cameras.image_saver import FOLDER
from tasks.vision.cameras.image_writer import write_picture

MOST_NOTES = 20

Picture = tuple[dict[str, Any], list[dict[str, Any]]]
"""What is told of a picture in the file of all labels, and its annotations in that of COCO."""


@dataclass(frozen=True)
class Renderer:
    """Renders the pictures of a run: each `shots` with the next one of its camera; whether labels have flow."""

    eyes: Mapping[str, Sequence[Eye]]
    shots: Sequence[tuple[Shot, Shot | None]]
    folder: Path
    labels: bool
    flow: bool

    def render(self, number: int) -> Picture:
        """Render a picture, and tell what is in it. Raises OSError."""
        shot, after = self.shots[number]
        camera, shutter = self.eyes[shot.camera][shot.eye]
        error = write_picture(self.folder / FOLDER / shot.name, shutter.picture(*shot.given), shot.form)
        if error:
            raise OSError(error)
        optics = camera.optics
        annotations = list[dict[str, Any]]()
        about: dict[str, Any] = {"file": shot.name, "camera": shot.camera, "time": shot.time}
        about |= {"width": optics.width, "height": optics.height}
        if self.labels:
            following = (after.standpoint, after.gliders) if after is not None and self.flow else None
            try:
                found = camera.labels(shot.standpoint, shot.gliders, following, shot.boards)
            except ValueError as refused:
                about["error"] = str(refused)
            else:
                write_labels(self.folder / LABELS, Path(shot.name).stem, found)
                about["objects"] = describe_boxes(found.boxes)
                annotations = coco.annotate(found)
        return about, annotations


class Rendered(NamedTuple):
    """How many pictures there are of each camera, and what is to be noted of them."""

    pictures: dict[str, int]
    notes: list[str]


def render(
    log: imc.Log,
    folder: Path,
    *,
    cameras: Path | None = None,
    world: Path | None = None,
    labels: bool = True,
    flow: bool = False,
    processes: int | None = None,
    progress: Callable[[float], object] = lambda _: None,
) -> Rendered:
    """Write Photos/ as the run itself would have it, Labels/, labels.json and annotations.json (COCO) to a folder.

    `cameras` and `world` are ini files, see expose. `processes` is how many render, by default one on each processor.
    Raises what expose raises, ResimulationError if there is nothing to see, and OSError.
    """
    crew = Crew((processes or os.cpu_count() or 1) - 1)
    with closing(crew):
        seen = expose(log, cameras, world)
        if not seen.shots:
            raise ResimulationError(f"{log.path}: there is no picture in this log: {'; '.join(seen.notes)}")
        pairs = list(_pairs(seen.shots))
        (folder / FOLDER).mkdir(parents=True, exist_ok=True)
        (folder / FOLDER / FILE).write_bytes(seen.description)
        found: dict[str, Picture] = {}
        renderer = Renderer(seen.eyes, pairs, folder, labels, flow)
        for picture in crew.share(Work(renderer.render, len(pairs))):
            found[picture[0]["file"]] = picture
            progress(len(found) / len(pairs))
    told = [found[shot.name] for shot, _ in pairs]
    if labels:
        text = json.dumps({"classes": kinds(), "pictures": [about for about, _ in told]}, indent=1)
        (folder / f"{LABELS.lower()}.json").write_text(text + "\n")
        (folder / coco.FILE).write_text(coco.dataset(_annotated(told)))
    counts = {label: sum(shot.camera == label for shot in seen.shots) for label in sorted(seen.eyes)}
    refused = [f"{about['file']} has no labels: {about['error']}" for about, _ in told if "error" in about]
    return Rendered(counts, [*seen.notes, *refused[:MOST_NOTES]])


def _annotated(pictures: Iterable[Picture]) -> Iterator[coco.Annotated]:
    for about, annotations in pictures:
        file = f"{FOLDER}/{about['file']}"
        yield coco.Annotated(file, about["time"], about["camera"], about["width"], about["height"], annotations)


def _pairs(shots: Sequence[Shot]) -> Iterator[tuple[Shot, Shot | None]]:
    """Each with the next one of its camera, if that has not changed meanwhile."""
    after: dict[str, Shot] = {}
    pairs: list[tuple[Shot, Shot | None]] = []
    for shot in reversed(shots):
        following = after.get(shot.camera)
        pairs.append((shot, following if following is not None and following.eye == shot.eye else None))
        after[shot.camera] = shot
    yield from reversed(pairs)
