"""A process beside a worker of Dask that does the jobs of one study, one after another, in a process of its own.

Dask's workers may have no child of multiprocessing, and a run that hangs cannot be ended within one of them.
"""

import json
import os
import queue
import shutil
import sys
import threading
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from shoal.campaigns.cluster.protocol import JsonLine, encode_line, job_from_line, result_to_line
from shoal.campaigns.executor_factory import make_workspace_runner
from shoal.campaigns.jobs import ProcessPool, StudyRunner
from shoal.campaigns.studies import OriginalPathsExecutor, Workspace, load_study
from support.file_errors import describe_os_error

IDLE = 600.0  # s without a job, after which it ends


def main() -> None:
    """Read the order from standard input, answer whether the study is the one that was meant, and then do jobs."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # where a user's task may print
    order = json.loads(sys.stdin.buffer.readline())
    workspace = Workspace(
        Path(order["root"]), order["folder"], order["etc"], tuple(order["code"]), tuple(order["modules"])
    )
    lines = queue.SimpleQueue[bytes]()
    threading.Thread(target=_read_lines, args=(sys.stdin.buffer, lines, workspace.root), daemon=True).start()
    make = partial(make_workspace_runner, workspace, StudyRunner, bool(order["only_failed"]))
    with ProcessPool(1, make_runner=make, wall_limit=order["wall_limit"]) as pool:
        workspace.configure_process()
        why = _refusal(workspace, order)
        _write(out, {"refused": why} if why else {})
        if not why:
            _run_jobs(OriginalPathsExecutor(pool, workspace), lines, out)


def _read_lines(stdin: BinaryIO, lines: "queue.SimpleQueue[bytes]", root: Path) -> None:
    """Take lines; without the worker of Dask results are useless, and what was unpacked is left to this process."""
    for line in stdin:
        lines.put(line)
    shutil.rmtree(root, ignore_errors=True)
    os._exit(0)


def _run_jobs(pool: OriginalPathsExecutor, lines: "queue.SimpleQueue[bytes]", out: BinaryIO) -> None:
    while True:
        try:
            line = json.loads(lines.get(timeout=IDLE))
        except queue.Empty:
            return
        for _, result in pool.run([job_from_line(line)]):
            _write(out, result_to_line(result, Path(line["log_root"])))


def _refusal(workspace: Workspace, order: dict[str, Any]) -> str:
    """Reason why the study here is another one: a library may be missing, or a task that was not found."""
    try:
        study = load_study(
            workspace.local_path(Path(order["study"])), fixed=order["fixed"], runs=order["runs"], has_begun=True
        )
    except (ValueError, ImportError) as error:
        return str(error).replace(str(workspace.root), "")
    except OSError as error:
        return describe_os_error(error).replace(str(workspace.root), "")
    return "" if study.digest == order["digest"] else "its files make another study there"


def _write(out: BinaryIO, line: JsonLine) -> None:
    out.write(encode_line(line))
    out.flush()
