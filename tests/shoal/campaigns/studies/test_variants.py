"""Studies of scenarios with includes, variants, captures, histories and limits of metrics."""

import pytest

from shoal.campaigns.jobs import StudyRunner
from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study

BASE = """\
vehicle: {profile: otter}
limit: 14 s
captures: {before: {of: SimulatedState.x, event: outage}}
events: [{name: outage, at: 4 s, silent: Simulators.GPS, for: 2 s}]
expect:
  - {name: fresh, always: age(GpsFix) < 5 s}
  - {name: near, always: abs(SimulatedState.x - $before) < 50 m}
  - {name: enough, metric: fixes, at least: 10}
metrics: {fixes: {last: count(GpsFix)}, oldest: {max: age(GpsFix)}}
"""
OWN = """\
include: lib/base.yaml
variants:
  once: {description: as it is}
  often: {events: [{at: 8 s, every: 3 s, times: 2, silent: Simulators.GPS, for: 2 s}]}
"""
STUDY = """\
scenario: own.scenario.yaml
runs: 4
sampling: grid
vary:
  variant: {choice: [once, often]}
  events/0/for: {grid: [2 s, 5.5 s]}
"""


@pytest.mark.heavy
def test_a_study_varies_the_variant_and_values_of_what_is_included(tmp_path):
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "base.yaml").write_text(BASE)
    (tmp_path / "own.scenario.yaml").write_text(OWN)
    (tmp_path / "own.study.yaml").write_text(STUDY)
    study = load_study(tmp_path / "own.study.yaml")
    assert str(tmp_path / "lib" / "base.yaml") in study.bundle.files
    data = run_study(study, tmp_path / "runs", make_runner=StudyRunner, workers=0)
    rows = list(data.counted_rows)
    assert len(rows) == 4
    assert not [row["error"] for row in rows if row["error"]]
    frame = data.data_frame()
    by_variant = frame.groupby(frame.filter(like="variant").iloc[:, 0])["metrics.fixes"].max()
    assert by_variant["once"] == 12.0
    assert by_variant["often"] == 8.0
    assert frame["passed"].sum() == 1
