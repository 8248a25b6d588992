"""Requests of the page for logs: the list, a file of one, and its report."""

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import suppress
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from shoal.console.json_request import Answer, json_object, json_response, refusal_response
from shoal.console.logs.log_library import LogDownload, LogLibrary, LogLibraryError
from shoal.console.owned_job import OwnedJob
from shoal.console.page_job import PageJobError
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
)  # HTML forbids a document in a sandbox an opener policy; it has no opener


class _Download(StreamingResponse):
    """A file up to the size that it had: the vehicle may be writing it. `on_end` is called however it ends."""

    def __init__(self, found: LogDownload, on_end: Callable[[], object]) -> None:
        headers = {
            "Content-Length": str(found.size),
            "Content-Disposition": f"attachment; filename*=UTF-8''{quote(found.copy_name, errors='replace')}",
        }
        super().__init__(_blocks(found), media_type="application/octet-stream", headers=headers)
        self._found, self._on_end = found, on_end

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._on_end()
            self._found.file.close()


async def _blocks(found: LogDownload) -> AsyncGenerator[bytes]:
    left = found.size
    while left > 0 and (block := await asyncio.to_thread(found.file.read, min(BLOCK, left))):
        left -= len(block)
        yield block


class LogRoutes(PagePart):
    """Answers about the logs of a library."""

    def __init__(self, library: LogLibrary) -> None:
        self._library = library
        self._worker = OwnedJob(WORKER, "has a report made")
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
        self._worker.close()

    async def _list(self, _: Request) -> Response:
        async with self._reading:  # one at a time reads the disk
            try:
                logs = await asyncio.to_thread(self._library.rows)
            except LogLibraryError as error:
                return refusal_response(error)
        return json_response({"ok": True, "logs": logs})

    async def _file(self, request: Request) -> Response:
        key, name = request.query_params.get("log", ""), request.query_params.get("file", "")
        if self._downloads >= MOST_DOWNLOADS:
            return PlainTextResponse(f"{self._downloads} downloads are running: try again later", 503)
        self._downloads += 1  # before the first await: of many at once no more are begun
        try:
            found = await asyncio.to_thread(self._library.open, key, name)
        except LogLibraryError as error:
            self._end_download()
            return PlainTextResponse(printable(str(error)), 404)
        return _Download(found, self._end_download)

    def _end_download(self) -> None:
        self._downloads -= 1

    async def _make_report(self, request: Request) -> Response:
        key = (await json_object(request)).get("log")
        try:
            path, name = self._library.path(key := key if isinstance(key, str) else ""), self._library.name(key)
            async with asyncio.timeout(LONGEST):
                found = await self._worker.run(request.state.user, {"log": str(path)})
        except (LogLibraryError, PageJobError) as error:
            return refusal_response(error)
        except TimeoutError:
            return refusal_response(
                f"the report was not finished within {LONGEST:.0f} s: `shoal log report` has no limit"
            )
        if not found["ok"]:
            return refusal_response(str(found["text"]).replace(str(path), name))
        self._reports.pop(key, None)
        self._reports[key] = str(found["page"]).encode(errors="replace")
        while len(self._reports) > MOST_REPORTS:
            del self._reports[next(iter(self._reports))]
        return json_response({"ok": True, "text": "the report is made"})

    async def _cancel(self, request: Request) -> Response:
        refusal = self._worker.cancel(request.state.user)
        return refusal_response(refusal) if refusal else json_response({"ok": True, "text": "cancelled"})

    async def _report(self, request: Request) -> Response:
        page = self._reports.get(request.query_params.get("log", ""))
        if page is None:
            return PlainTextResponse("this report is not kept any more: make it again", 404)
        headers = {"Content-Security-Policy": REPORT_POLICY, "Cross-Origin-Opener-Policy": "unsafe-none"}
        with suppress(LogLibraryError):
            name = quote(f"{self._library.name(request.query_params['log']).replace('/', '_')}.html", errors="replace")
            headers["Content-Disposition"] = f"inline; filename*=UTF-8''{name}"
        return Response(page, media_type="text/html", headers=headers)
