"""pytest collects `*.scenario.yaml` beside Python tests, and has fixtures that run scenarios and vehicles.

It is imported whenever pytest starts, so nothing of Shoal is, until there is a scenario or a test that asks for one.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from runtime.vehicle import Vehicle
    from shoal.campaigns import ScenarioOutcome
    from shoal.scenarios import ScenarioResult

SCENARIO_SUFFIX = ".scenario.yaml"  # these are those of shoal.campaigns, which is slow to import
RESULTS_FILES = ("runs.journal", "runs.parquet")


class ScenarioFailed(Exception):
    """A scenario has not passed; the text has a line for each reason."""


class ScenarioWarning(pytest.PytestWarning):
    """A scenario proves less than it seems to."""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("shoal", "scenarios of vehicles")
    group.addoption("--scenario-logs", default="log", metavar="DIR", help="Folder for logs of failed scenarios [log].")


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leave out data sets of campaigns, with what searches have found, unless pytest was called with their path."""
    return True if any((collection_path / name).is_file() for name in RESULTS_FILES) else None


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> "ScenarioFile | None":
    if not file_path.name.endswith(SCENARIO_SUFFIX):
        return None
    return ScenarioFile.from_parent(parent, path=file_path)  # pyright: ignore[reportUnknownMemberType]


class ScenarioFile(pytest.File):
    """A file with one scenario, or with several variants of it."""

    def collect(self) -> Iterable[pytest.Item]:
        from shoal.campaigns import variants_of

        whole = self.path.name.removesuffix(SCENARIO_SUFFIX)
        for values in variants_of(self.path, {}):
            name = f"{whole}[{values['variant']}]" if values else whole
            item = ScenarioItem.from_parent(self, name=name)  # pyright: ignore[reportUnknownMemberType]
            item.values = values
            yield item


class ScenarioItem(pytest.Item):
    """A scenario that is run in virtual time, once more with a log if it has failed; `values` choose the variant."""

    values: Mapping[str, object] = MappingProxyType({})

    def runtest(self) -> None:
        logs = Path(str(self.config.getoption("--scenario-logs")))
        outcome = _outcome(self.path, self.config, self.values, None, logs)
        _note(self, outcome)
        if not outcome.result.passed:
            raise ScenarioFailed(_explanation(outcome))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, ScenarioFailed):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, 0, self.name


class ScenarioFixture:
    """Runs scenarios for a test: see the fixture `scenario`."""

    def __init__(self, request: pytest.FixtureRequest, folder: Path):
        self._request, self._folder = request, folder

    def __call__(
        self,
        file: str | Path,
        values: Mapping[str, object] | None = None,
        *,
        seed: int | None = None,
        log: bool = False,
    ) -> "ScenarioResult":
        """Run the scenario in a file, which is looked for beside the test, and return its result.

        `values` replace those of the file, by place such as "world/current/north". With a `log`, or if the run has
        failed, `result.logs` has the folders of its logs, in the test's folder of temporary files. Raises
        ScenarioFailed if the file or a value is wrong.
        """
        __tracebackhide__ = True
        path = self._request.path.parent / file
        outcome = _outcome(path, self._request.config, values or {}, seed, self._folder, log=log)
        if outcome.is_unreadable:
            raise ScenarioFailed(outcome.result.error)
        _note(self._request.node, outcome)
        return outcome.result


@pytest.fixture
def scenario(request: pytest.FixtureRequest, tmp_path: Path) -> ScenarioFixture:
    """Runs the scenario in a file: `result = scenario("outage.scenario.yaml", {"world/current/north": 0.5})`."""
    return ScenarioFixture(request, tmp_path / "log")


@pytest.fixture
def vehicle(request: pytest.FixtureRequest, tmp_path: Path) -> "Iterator[Callable[..., Vehicle]]":
    """Builds the vehicle of a profile in virtual time, which the test starts and runs; it is closed after the test.

    `boat = vehicle("otter", overrides=["Simulators.GPS:HACC=3"], seed=2)`: modes, by default Simulation, may follow the
    profile, which is looked for beside the test first. Its log is in the test's folder of temporary files.
    """
    from shoal.missions import prepare

    _search(request.config)
    made: list[Vehicle] = []

    def build(
        profile: str, modes: Sequence[str] = (), *, overrides: Sequence[str] = (), seed: int | None = None
    ) -> "Vehicle":
        near = [request.path.parent]
        logs, states = tmp_path / "log", tmp_path / "db"
        built = prepare(
            profile, modes, config_dir=near, overrides=overrides, seed=seed, log_root=logs, state_folder=states
        )
        made.append(built.vehicle)
        return built.vehicle

    yield build
    for each in made:
        each.close()


def _search(config: pytest.Config) -> None:
    from runtime.vehicle import add_task_folder

    add_task_folder(config.rootpath)


def _outcome(
    path: Path, config: pytest.Config, values: Mapping[str, object], seed: int | None, logs: Path, *, log: bool = False
) -> "ScenarioOutcome":
    from shoal.campaigns import Job, ProcessPool, rerun_with_logs, run_jobs

    _search(config)
    here = Path.cwd()
    path = path.relative_to(here) if path.is_relative_to(here) else path
    job = Job(path.name, path, values, seed)
    job = replace(job, log_root=logs / job.name) if log else job
    with ProcessPool(0) as pool:
        [outcome] = run_jobs(pool, [job])
        if not outcome.result.passed and not log:
            return next(rerun_with_logs(pool, [outcome], logs), outcome)
        return outcome


def _note(node: pytest.Item, outcome: "ScenarioOutcome") -> None:
    """Add metrics and warnings to the reports of pytest."""
    from shoal.campaigns import warning_lines

    node.user_properties += list(outcome.result.metrics.items())
    for words in warning_lines(outcome):
        node.warn(ScenarioWarning(f"{outcome.result.scenario}: {words}"))


def _explanation(outcome: "ScenarioOutcome") -> str:
    from shoal.campaigns import failure_details

    result = outcome.result
    logs = [f"log of {name}: {folder}" for name, folder in result.logs.items()]
    return "\n".join([*failure_details(result), *logs])
