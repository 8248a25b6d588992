"""A campaign of a shipped vehicle whose processes are killed again and again: each row is there, and none twice."""

import multiprocessing
import os
import random
import signal
import threading
from collections import Counter

import pytest

from shoal.campaigns import load_study, run_study
from shoal.campaigns.results.append_log import read_append_log

SCENARIO = """\
scenario: rest
vehicle: {profile: lauv-noptilus-1}
world: {current: {north: 0, east: 0}}
expect:
  - {name: stays_near, always: SimulatedState.x < 3 m}
limit: 30 s
"""
STUDY = """\
scenario: rest.scenario.yaml
vary:
  world/current/north: {uniform: [0 m/s, 0.3 m/s]}
runs: 30
"""
PERIOD = 1.0  # s


@pytest.mark.heavy
def test_a_campaign_whose_processes_are_killed_has_each_row_once(tmp_path):
    (tmp_path / "rest.scenario.yaml").write_text(SCENARIO)
    (tmp_path / "rest.study.yaml").write_text(STUDY)
    study = load_study(tmp_path / "rest.study.yaml")
    over, progress, killed, chance = threading.Event(), threading.Event(), [], random.Random(1)

    def kill():
        while not over.wait(chance.uniform(0.0, PERIOD)):
            if progress.is_set() and (running := multiprocessing.active_children()):
                progress.clear()
                os.kill(chance.choice(running).pid, signal.SIGKILL)
                killed.append(1)

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        run_study(study, tmp_path / "disturbed", workers=2, on_progress=lambda _: progress.set())
    finally:
        over.set()
        killer.join()
    disturbed = run_study(study, tmp_path / "disturbed", workers=2)  # a run that was hit twice is done now
    quiet = run_study(study, tmp_path / "quiet", workers=2)
    rows = [
        [{key: row[key] for key in row if key != "cpu"} for row in data.counted_rows] for data in (quiet, disturbed)
    ]
    assert repr(rows[0]) == repr(rows[1])
    records, damaged = read_append_log(tmp_path / "disturbed" / "runs.journal")
    done = Counter(record["run"] for record in records if record.get("finished"))
    assert done == Counter(range(30))
    assert not damaged
    assert len(killed) >= 3
