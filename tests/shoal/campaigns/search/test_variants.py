"""A search over the variants of a scenario."""

import pytest

from shoal.campaigns import compute_findings
from shoal.scenarios import load_document
from tests.shoal.campaigns.search.slope import SCENARIO, STUDY, Slope, do, write

VARIANTS = "variants:\n  calm: {description: as it is}\n  rough: {description: with a strong current}\n"
VARY = "vary:\n  variant: {choice: [calm, rough]}\n"


class Rough(Slope):
    """Stands in for runs: the variant `rough` makes the current 0.3 m/s stronger."""

    def __call__(self, job):
        north = "world/current/north"
        if job.values.get("variant") == "rough":
            stronger = float(str(job.values.get(north, 0.1)).split()[0]) + 0.3
            job = type(job)(**{**vars(job), "values": {**job.values, north: stronger}})
        return super().__call__(job)


@pytest.mark.heavy
def test_a_search_finds_the_variant_that_breaks_most_and_writes_it(tmp_path):
    found = do(write(tmp_path, STUDY.replace("vary:\n", VARY), SCENARIO + VARIANTS), tmp_path / "runs", make=Rough)
    shown = compute_findings(found)
    rows = list(found.counted_rows)
    assert not [row["error"] for row in rows if row["error"]]
    (column,) = [name for name in shown.best if name.endswith("variant")]
    assert {row.get(column) for row in rows} >= {"calm", "rough"}
    assert shown.best[column] == "rough"
    assert shown.objective.value(shown.best) < -0.6, "below what the variant calm can have"
    assert load_document(tmp_path / "runs" / "dive.scenario.yaml").scenario().name.startswith("dive")
