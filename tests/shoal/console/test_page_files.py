"""The page and its files: compressed, small, and each that is named is there."""

import asyncio
import gzip
import re
from pathlib import Path

import pytest
from starlette.applications import Starlette

from shoal.console.browser_libraries import FILES, read_browser_files
from shoal.console.page_files import PageFiles

MOST_TRANSFERRED, MOST_OWN, MOST_LINES = 300_000, 80_000, 300
PAGE = Path(__file__).parents[3] / "shoal" / "console" / "page"


def get(path: str, accepted: str = "") -> tuple[int, dict[str, str], bytes]:
    """The status, headers and body of an answer."""
    application = Starlette(routes=PageFiles(read_browser_files()[0]).routes)
    words = [(b"accept-encoding", accepted.encode())] if accepted else []
    scope = {"type": "http", "method": "GET", "path": path, "raw_path": path.encode(), "headers": words}
    scope |= {"query_string": b"", "root_path": ""}
    sent: list[dict] = []

    async def receive() -> dict:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: dict) -> None:
        sent.append(message)

    asyncio.run(application(scope, receive, send))
    headers = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
    return sent[0]["status"], headers, b"".join(each.get("body", b"") for each in sent[1:])


def needed() -> dict[str, bytes]:
    """All files of the first load by name, as they are."""
    waiting, found = ["index.html"], dict[str, bytes]()
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        status, _, found[name] = get("/" if name == "index.html" else f"/files/{name}")
        assert status == 200, name
        text = found[name].decode()
        waiting += re.findall(r'(?:href|src)="/files/([^"]+)"', text) if name == "index.html" else []
        waiting += re.findall(r'from "\./([^"]+)"', text) if name not in FILES else []
    return found


@pytest.mark.parametrize("name", ["main.js", "style.css", *FILES])
def test_a_file_is_the_same_compressed(name):
    _, plain, data = get(f"/files/{name}")
    status, headers, compressed = get(f"/files/{name}", "br, gzip")
    assert (status, headers["content-encoding"], headers["vary"]) == (200, "gzip", "Accept-Encoding")
    assert "content-encoding" not in plain
    assert gzip.decompress(compressed) == data
    assert headers["content-type"] == plain["content-type"]


def test_the_first_load_is_small():
    files = needed()
    own = {name: data for name, data in files.items() if name.endswith(".js") and name not in FILES}
    assert {path.name for path in PAGE.glob("*.js")} == set(own)
    assert sum(map(len, own.values())) < MOST_OWN
    assert max(data.count(b"\n") for data in own.values()) <= MOST_LINES
    assert sum(len(gzip.compress(data)) for data in files.values()) < MOST_TRANSFERRED / 2


def test_an_unknown_file_is_not_found():
    assert get("/files/nope.js")[0] == 404
    assert get("/files/..%2Fserver.py")[0] == 404
