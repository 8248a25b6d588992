"""Requests of the page for logs: the list, a file of one, and its report."""

import asyncio
from collections.abc import AsyncGenerator, Mapping
from contextlib import suppress
from typing import BinaryIO
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse

from shoal.console.json_request import Answer, json_object, json_response
from shoal.console.logs.log_library import LogLibrary, LogLibraryError
from shoal.console.page_job import PageJob, PageJobError
from shoal.console.page_part import PagePart
from support.terminal_text import printable

WORKER = "shoal.console.logs.log_report"
BLOCK = 1 << 18  # bytes
LONGEST = 600.0  # s of a report
MOST_REPORTS = 2  # that are kept for those who have asked for them
MOST_DOWNLOADS = 16  # at once
REPORT_POLICY = (  # a document of its own: it runs its script, and reaches neither the page nor any address
    "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "img-src data: blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)


class LogRoutes(PagePart):
    """Answers about the logs of a library."""

    def __init__(self, library: LogLibrary) -> None:
        self._library = library
        self._worker = PageJob(WORKER)
        self._reading = asyncio.Lock()
        self._reports: dict[str, bytes] = {}
        self._downloads = 0
        self.questions: Mapping[str, Answer] = {
            "/api/logs": self._list,
            "/api/log-file": self._file,
            "/api/log-report": self._report,
        }
        self.orders: Mapping[str, Answer] = {
            "/api/log-report-make": self._make_report,
            "/api/log-report-cancel": self._cancel,
        }

    def close(self) -> None:
        """End the report that is being made."""
        self._worker.cancel()

    async def _list(self, _: Request) -> Response:
        async with self._reading:  # one at a time reads the disk
            try:
                logs = await asyncio.to_thread(self._library.rows)
            except LogLibraryError as error:
                return _refusal(error)
        return json_response({"ok": True, "logs": logs})

    async def _file(self, request: Request) -> Response:
        key, name = request.query_params.get("log", ""), request.query_params.get("file", "")
        if self._downloads >= MOST_DOWNLOADS:
            return PlainTextResponse(f"{self._downloads} downloads are running: try again later", 503)
        try:
            found = await asyncio.to_thread(self._library.open, key, name)
        except LogLibraryError as error:
            return PlainTextResponse(printable(str(error)), 404)
        headers = {
            "Content-Length": str(found.size),
            "Content-Disposition": f"attachment; filename*=UTF-8''{quote(found.copy_name, errors='replace')}",
        }
        blocks = self._blocks(found.file, found.size)
        return StreamingResponse(blocks, media_type="application/octet-stream", headers=headers)

    async def _blocks(self, file: BinaryIO, size: int) -> AsyncGenerator[bytes]:
        """A file up to the size that it had: the vehicle may be writing it."""
        self._downloads += 1
        try:
            while size > 0 and (block := await asyncio.to_thread(file.read, min(BLOCK, size))):
                size -= len(block)
                yield block
        finally:
            self._downloads -= 1
            file.close()

    async def _make_report(self, request: Request) -> Response:
        key = (await json_object(request)).get("log")
        try:
            path, name = self._library.path(key := key if isinstance(key, str) else ""), self._library.name(key)
            async with asyncio.timeout(LONGEST):
                found = await self._worker.run({"log": str(path)})
        except (LogLibraryError, PageJobError) as error:
            return _refusal(error)
        except TimeoutError:
            return _refusal(f"the report was not finished within {LONGEST:.0f} s: `shoal log report` has no limit")
        if not found["ok"]:
            return _refusal(str(found["text"]).replace(str(path), name))
        self._reports.pop(key, None)
        self._reports[key] = str(found["page"]).encode(errors="replace")
        while len(self._reports) > MOST_REPORTS:
            del self._reports[next(iter(self._reports))]
        return json_response({"ok": True, "text": "the report is made"})

    async def _cancel(self, _: Request) -> Response:
        self._worker.cancel()
        return json_response({"ok": True, "text": "cancelled"})

    async def _report(self, request: Request) -> Response:
        page = self._reports.get(request.query_params.get("log", ""))
        if page is None:
            return PlainTextResponse("this report is not kept any more: make it again", 404)
        headers = {"Content-Security-Policy": REPORT_POLICY}
        with suppress(LogLibraryError):
            name = quote(f"{self._library.name(request.query_params['log']).replace('/', '_')}.html", errors="replace")
            headers["Content-Disposition"] = f"inline; filename*=UTF-8''{name}"
        return Response(page, media_type="text/html", headers=headers)


def _refusal(reason: object) -> Response:
    return json_response({"ok": False, "text": printable(str(reason))})
