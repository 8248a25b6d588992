"""One run that is to be done, wherever."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from shoal.scenarios import ScenarioResult

SCENARIO_SUFFIX = ".scenario.yaml"


@dataclass(frozen=True)
class Job:
    """A run of the scenario in a file.

    `key` identifies it to the caller. `values` replace those of the file, by path ("world/current/north").
    `seed` replaces that of the file. A log is kept only with a `log_root`.
    """

    key: int | str
    path: Path
    values: Mapping[str, object] = field(default_factory=dict[str, object])
    seed: int | None = None
    log_root: Path | None = None

    @property
    def variant(self) -> str:
        """The variant that it chooses; empty if it chooses none."""
        return str(self.values.get("variant") or "")

    @property
    def name(self) -> str:
        """Name of a scenario whose file cannot be read: the file's name without ending, and the variant."""
        return self.path.name.removesuffix(SCENARIO_SUFFIX) + (f"-{self.variant}" if self.variant else "")

    @property
    def label(self) -> str:
        """The file and the variant, for people."""
        return f"{self.path} [{self.variant}]" if self.variant else str(self.path)

    def failed_result(self, error: str, kind: type[ScenarioResult] = ScenarioResult) -> ScenarioResult:
        """The result of a run that did not come to its end."""
        return kind(self.name, self.seed or 0, error=error)


class UnreadableResult(ScenarioResult):
    """The result of a job whose file, or a value for it, is wrong: there was no run."""


class UnfinishedResult(ScenarioResult):
    """The result of a job whose process has died or was ended, so that nothing is known of the run."""


RunJob = Callable[[Job], ScenarioResult]
"""Runs a job in the calling process. It may cache objects from one job to the next."""
