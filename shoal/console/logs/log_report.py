"""Draws a log as an HTML page, for the page of the console, within limits of memory and size."""

import resource
from contextlib import suppress
from pathlib import Path
from typing import Any

import imc
from shoal.console.page_job import MOST_ANSWER, answer_job
from shoal.logs.inspect import render_report
from support.file_errors import describe_os_error

MOST_MEMORY = 4 << 30  # bytes of addresses
MOST_PAGE = MOST_ANSWER // 2  # bytes: as JSON it is longer


def report_of(path: Path) -> dict[str, Any]:
    """The answer has `ok`, `text`, and the report as `page`. Raises ValueError, SchemaError, OSError."""
    page = render_report(imc.Log(path))
    if len(page.encode(errors="replace")) > MOST_PAGE:
        return {"ok": False, "text": "the report is too long for this page: `shoal log report` writes it into a file"}
    return {"ok": True, "text": "", "page": page}


def _work(job: dict[str, Any]) -> dict[str, Any]:
    limit = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = MOST_MEMORY if limit == resource.RLIM_INFINITY else min(limit, MOST_MEMORY)
    with suppress(ValueError):  # some systems have no such limit
        resource.setrlimit(resource.RLIMIT_AS, (most, limit))
    with suppress(OSError):  # where memory runs short, this process ends, and not that of the vehicle
        Path("/proc/self/oom_score_adj").write_text("1000")
    try:
        return report_of(Path(job["log"]))
    except OSError as error:
        return {"ok": False, "text": describe_os_error(error)}
    except MemoryError:
        return {"ok": False, "text": "the log is too large to be drawn here: `shoal log report` has no limit"}


if __name__ == "__main__":
    answer_job(_work, "the report", ValueError, imc.SchemaError)
