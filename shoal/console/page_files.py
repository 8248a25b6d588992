"""The files of the page, compressed for browsers that accept it."""

import gzip
from collections.abc import Mapping
from importlib.resources import files

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

MEDIA = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
INDEX = "index.html"


class PageFiles:
    """Answers requests for the page itself, and for its files and `libraries` by name."""

    def __init__(self, libraries: Mapping[str, bytes]) -> None:
        own = files("shoal.console").joinpath("page").iterdir()
        self._files = {**libraries, **{item.name: item.read_bytes() for item in own}}
        self._compressed: dict[str, bytes] = {}
        self.routes: list[Route] = [Route("/", self._page), Route("/files/{name}", self._file)]

    async def _page(self, request: Request) -> Response:
        return self._answer(request, INDEX)

    async def _file(self, request: Request) -> Response:
        return self._answer(request, request.path_params["name"])

    def _answer(self, request: Request, name: str) -> Response:
        if name not in self._files:
            return PlainTextResponse("no such file", 404)
        media, headers = MEDIA["." + name.rpartition(".")[2]], {"Vary": "Accept-Encoding"}
        encodings = request.headers.get("accept-encoding", "").split(",")
        if "gzip" not in (each.strip() for each in encodings):
            return Response(self._files[name], headers=headers, media_type=media)
        if name not in self._compressed:
            self._compressed[name] = gzip.compress(self._files[name], mtime=0)
        return Response(self._compressed[name], headers={**headers, "Content-Encoding": "gzip"}, media_type=media)
