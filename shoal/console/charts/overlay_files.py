"""The overlays of a folder as files that are sent as they are; a process of its own has made them."""

import asyncio
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shoal.console.page_job import PageJob, PageJobError

WORKER = "shoal.console.charts.overlay_worker"


class OverlayFiles:
    """The overlays of a folder by their names; empty until `read`.

    sizes: bytes of each. troubles: a sentence for each file that cannot be read.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._worker = PageJob(WORKER)
        self._reading = asyncio.Lock()
        self._made: tempfile.TemporaryDirectory[str] | None = None
        self._files: dict[str, tuple[int, int]] = {}
        self.troubles: list[str] = []

    async def read(self) -> None:
        """Start reading the files, once: a vehicle must not wait for that as it starts."""
        async with self._reading:
            if self._made is not None or self._folder is None:
                return
            found: dict[str, Any] = {"ok": False}
            try:
                self._made = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
                found = await self._worker.run({"folder": str(self._folder), "into": self._made.name})
            except (OSError, PageJobError) as error:
                found["text"] = str(error)
            if found["ok"]:
                self._files = {name: (number, size) for name, (number, size) in found["files"].items()}
                self.troubles = found["troubles"]
            else:
                self.troubles = [f"{self._folder}: no overlays: {found['text']}"]

    @property
    def sizes(self) -> Mapping[str, int]:
        return {name: size for name, (_, size) in self._files.items()}

    def path(self, name: str) -> Path | None:
        """The file with an overlay as JSON; None if there is none of this name."""
        if self._made is None or name not in self._files:
            return None
        return Path(self._made.name, str(self._files[name][0]))

    def close(self) -> None:
        """Remove the files."""
        self._worker.cancel()
        self._files = {}
        if self._made is not None:
            self._made.cleanup()
