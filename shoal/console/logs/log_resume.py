"""Resumes the virtual run of a log from a time of it, for the page, as `shoal rewind` does."""

import math
from pathlib import Path
from typing import Any

import imc
from runtime.profile import load_profile
from runtime.snapshot import SnapshotError
from shoal.console.logs.log_link import CONFIGURATION
from shoal.console.page_job import answer_job
from shoal.rerun import RewoundRun
from support.diagnostics import ProfileError
from tasks.transports.logging import Logging


def resume_log(path: Path, time: float, seconds: float, changes: list[str], log_root: Path) -> dict[str, Any]:
    """Run on from a time (s since 1970 UTC) of a virtual run for some seconds, with changed options.

    The answer has `ok`: whether all of it was logged, `text`, and `log`, the folder of the new log. Raises
    SnapshotError, ProfileError, OSError.
    """
    log = imc.Log(path)
    rewound = RewoundRun(log)
    at = max(0.0, time - load_profile(log.path.parent / CONFIGURATION).start_time)
    vehicle = rewound.vehicle(rewound.state_at(at), log_root, overrides=changes)
    try:
        vehicle.run(seconds)
        folder = vehicle.log_folder
    finally:
        vehicle.close()
    text = f"resumed at {at:.1f} s of the run for {seconds:g} s; show it: shoal console {folder}"
    lost = [task.lost for task in vehicle.tasks if isinstance(task, Logging) and task.lost]
    if lost:
        text = f"the new log is not complete: {', '.join(lost)}; {text}"
    return {"ok": not lost, "text": text, "log": str(folder)}


def _work(job: dict[str, Any]) -> dict[str, Any]:
    seconds = float(job["seconds"])
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise ValueError(f"{seconds:g} s is no time to run")
    return resume_log(Path(job["log"]), job["time"], seconds, job["changes"], Path(job["log_root"]))


if __name__ == "__main__":
    answer_job(_work, "the run", SnapshotError, ProfileError, ValueError)
