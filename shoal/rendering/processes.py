"""Renders the pictures and labels of a logged run on several processors: the same bytes on any number of them."""

import json
import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

import imc
from shoal.rendering import coco
from shoal.rendering.exposures import Eye, Shot, expose
from shoal.rendering.label_files import LABELS, describe_boxes, kinds, write_labels
from shoal.rerun import ResimulationError
from tasks.vision.keeping import FOLDER
from tasks.vision.photos import write_picture
from tasks.vision.records import FILE

MOST_NOTES = 20

Picture = tuple[dict[str, Any], list[dict[str, Any]]]
"""What is told of a picture in the file of all labels, and its annotations in that of COCO."""


class Job(NamedTuple):
    """What one process renders of a run: each `shots` with the next one of its camera; whether labels have flow."""

    cameras: Mapping[str, Eye]
    shots: Sequence[tuple[Shot, Shot | None]]
    folder: Path
    labels: bool
    flow: bool


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
    seen = expose(log, cameras, world)
    if not seen.shots:
        raise ResimulationError(f"{log.path}: there is no picture in this log: {'; '.join(seen.troubles)}")
    pairs = list(_pairs(seen.shots))
    count = min(processes or os.cpu_count() or 1, len(pairs))
    jobs = [Job(seen.cameras, pairs[first::count], folder, labels, flow) for first in range(count)]
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    (folder / FOLDER / FILE).write_bytes(seen.description)
    found: dict[str, Picture] = {}
    for picture in _in_processes(jobs) if count > 1 else rendered(jobs[0]):
        found[picture[0]["file"]] = picture
        progress(len(found) / len(pairs))
    told = [found[shot.name] for shot, _ in pairs]
    if labels:
        text = json.dumps({"classes": kinds(), "pictures": [about for about, _ in told]}, indent=1)
        (folder / f"{LABELS.lower()}.json").write_text(text + "\n")
        (folder / coco.FILE).write_text(coco.dataset(_annotated(told)))
    counts = {label: sum(shot.camera == label for shot in seen.shots) for label in sorted(seen.cameras)}
    refused = [f"{about['file']} has no labels: {about['error']}" for about, _ in told if "error" in about]
    return Rendered(counts, [*seen.notes, *seen.troubles, *refused[:MOST_NOTES]])


def rendered(job: Job) -> Iterator[Picture]:
    """Render, and tell what is in each picture. Raises OSError."""
    for shot, after in job.shots:
        camera, shutter = job.cameras[shot.camera]
        error = write_picture(job.folder / FOLDER / shot.name, shutter.picture(*shot.given), shot.form)
        if error:
            raise OSError(error)
        optics = camera.optics
        annotations = list[dict[str, Any]]()
        about: dict[str, Any] = {"file": shot.name, "camera": shot.camera, "time": shot.time}
        about |= {"width": optics.width, "height": optics.height}
        if job.labels:
            following = (after.standpoint, after.gliders) if after is not None and job.flow else None
            try:
                found = camera.labels(shot.standpoint, shot.gliders, following, shot.boards)
            except ValueError as refused:
                about["error"] = str(refused)
            else:
                write_labels(job.folder / LABELS, Path(shot.name).stem, found)
                about["objects"] = describe_boxes(found.boxes)
                annotations = coco.annotate(found)
        yield about, annotations


def _annotated(pictures: Iterable[Picture]) -> Iterator[coco.Annotated]:
    for about, annotations in pictures:
        file = f"{FOLDER}/{about['file']}"
        yield coco.Annotated(file, about["time"], about["camera"], about["width"], about["height"], annotations)


def _pairs(shots: Sequence[Shot]) -> Iterator[tuple[Shot, Shot | None]]:
    """Each with the next one of its camera."""
    after: dict[str, Shot] = {}
    pairs: list[tuple[Shot, Shot | None]] = []
    for shot in reversed(shots):
        pairs.append((shot, after.get(shot.camera)))
        after[shot.camera] = shot
    yield from reversed(pairs)


def _in_processes(jobs: Sequence[Job]) -> Iterator[Picture]:
    """What `rendered` tells of all jobs, as it comes. Raises OSError, and what else a process raises."""
    fresh = multiprocessing.get_context("spawn")  # a copy of this one might lack its threads
    running: dict[Connection, Any] = {}
    for job in jobs:
        ours, theirs = fresh.Pipe(duplex=False)
        process = fresh.Process(target=_serve, args=(theirs, job), daemon=True)
        process.start()
        theirs.close()
        running[ours] = process
    try:
        while running:
            for pipe in wait(list(running)):
                assert isinstance(pipe, Connection)
                try:
                    said = pipe.recv()
                except EOFError:
                    said = OSError(f"process {running[pipe].pid}, which renders, was ended from outside")
                if said is None:
                    running.pop(pipe).join()
                elif isinstance(said, BaseException):
                    raise said
                else:
                    yield said
    finally:
        for process in running.values():
            process.terminate()
            process.join()


def _serve(pipe: Connection, job: Job) -> None:
    try:
        for picture in rendered(job):
            pipe.send(picture)
        pipe.send(None)
    except Exception as error:
        pipe.send(error)
