"""Reads overlays for the page, so that the process of a vehicle does not."""

from pathlib import Path
from typing import Any

from shoal.console.charts.chart_overlays import read_overlays
from shoal.console.page_job import answer_job


def write_overlays(folder: Path, into: Path) -> dict[str, Any]:
    """Write each overlay of a folder into a file that is named by its number. Raises OSError.

    The answer has `files`: number and bytes of each by its name, and `troubles`.
    """
    texts, troubles = read_overlays(folder)
    for number, text in enumerate(texts.values()):
        (into / str(number)).write_bytes(text)
    sizes = {name: [number, len(text)] for number, (name, text) in enumerate(texts.items())}
    return {"ok": True, "files": sizes, "troubles": troubles}


if __name__ == "__main__":
    answer_job(lambda job: write_overlays(Path(job["folder"]), Path(job["into"])), "the reader of overlays")
