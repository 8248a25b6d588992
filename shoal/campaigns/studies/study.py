"""Study files: a scenario, what varies in it, and how often it is run."""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from runtime.profile import resolve_root_copy
from shoal.campaigns.pass_rate import StoppingRule, has_interval
from shoal.campaigns.sampling import (
    FIXED_SIZE_SAMPLINGS,
    SAMPLINGS,
    Distribution,
    DraftFactory,
    SamplingDesign,
    Scalar,
    StudyFileError,
    describe_value_error,
    load_template,
    parse_distribution,
)
from shoal.campaigns.search import SearchConfig, parse_search
from shoal.campaigns.studies.bundle import StudyBundle, make_bundle
from shoal.campaigns.studies.dry_run import DryRun
from shoal.scenarios import ScenarioDocument, ScenarioFileError
from support.located_yaml import Node, parse_yaml_tree, read_text
from support.terminal_text import quoted, with_suggestion

STUDY_SUFFIX = ".study.yaml"
LOGS = ("all", "failed", "none")
_KEYS = ("study", "description", "scenario", "vary", "runs", "until", "seed", "sampling", "logs", "files", "search")
_UNTIL = ("pass rate known to", "at most", "confidence")
_MOST = 10_000_000  # runs
_PERCENT = re.compile(r"(\d+\.?\d*|\.\d+)\s*%")
_RUNS, _UNTIL_MOST = 100, 10_000  # defaults
_SEED_PER_BLOCK = "one seed per block"  # no run of a data set from before is the same


@dataclass(frozen=True)
class Study:
    """Plan of a campaign: the scenario in `scenario_path` with the values of `design`, and with those in `fixed`.

    `digest` is the same for studies of which each run is the same: it covers the scenario with its files, what varies
    and how, the seed, and the user's tasks; not the number of runs where no run depends on it. `bundle` has the
    contents of all these files.
    """

    name: str
    file: Path
    scenario_path: Path
    design: SamplingDesign
    stopping_rule: StoppingRule
    logs: str
    fixed: Mapping[str, object]
    digest: str
    description: str = ""
    bundle: StudyBundle = field(default_factory=lambda: StudyBundle({}), repr=False)
    search: SearchConfig | None = None

    @property
    def seed(self) -> int:
        return self.design.seed

    def scenario_values(self, run: int) -> dict[str, object]:
        """Values that a run sets in the scenario, by path."""
        return self.with_units(self.design.raw_values(run))

    def with_units(self, numbers: Mapping[str, Scalar]) -> dict[str, object]:
        """Values that a run sets in the scenario, by path, from the varying ones without their units."""
        return {
            **self.fixed,
            **{name: self.design.distributions[name].append_unit(found) for name, found in numbers.items()},
        }

    def run_seed(self, run: int) -> int:
        """The seed of a run. In a search all have that of the scenario: what differs is due to the values alone."""
        return self.search.seed if self.search is not None else self.design.run_seed(run)


def load_study(
    path: Path,
    *,
    make_draft: DraftFactory = ScenarioDocument,
    fixed: Mapping[str, object] | None = None,
    runs: int | None = None,
    logs: str | None = None,
    has_begun: bool = False,
) -> Study:
    """The study in a file. `fixed` are values that replace those of the scenario in all runs, also varied ones.

    `runs` and `logs` replace those of the file. Unless it `has_begun`, values of later runs are tried, too. Raises
    StudyFileError or the error of the scenario, both with file and line, and OSError if a file cannot be read.
    """
    study = _Reader(path, make_draft, dict(fixed or {})).study(runs, has_begun=has_begun)
    return replace(study, logs=logs) if logs is not None else study


class _Reader:
    def __init__(self, path: Path, make_draft: DraftFactory, fixed: dict[str, object]):
        self._path, self._make_draft, self._fixed = path, make_draft, fixed
        self._root = parse_yaml_tree(read_text(path, StudyFileError), str(path), StudyFileError)
        self._nodes = self._root.mapping()

    def study(self, runs: int | None, *, has_begun: bool) -> Study:
        for key, node in self._nodes.items():
            if key not in _KEYS:
                node.fail(with_suggestion(f"unknown key {key!r}", key, _KEYS))
        if "scenario" not in self._nodes:
            self._root.fail("'scenario' is missing: the path of a scenario's file, or the scenario itself")
        inline = isinstance(self._nodes["scenario"].content, dict)
        path = self._path if inline else self._scenario_file()
        template = load_template(path, self._make_draft)
        self._draft, self._inside = template.draft, template.distributions
        self._places = self._draft.scalars_by_path()
        try:
            return self._study(path, runs, has_begun=has_begun)
        except ScenarioFileError as error:
            raise ScenarioFileError(describe_value_error(self._draft, self._fixed, error)) from None

    def _study(self, path: Path, runs: int | None, *, has_begun: bool) -> Study:
        varied = self._varied()
        for name in self._fixed:
            self._check_place(name, None, {name: self._fixed[name]}, varied)
        sampling = self._word("sampling", SAMPLINGS, "random")
        seed = self._nodes["seed"].integer() if "seed" in self._nodes else 0
        design = SamplingDesign(varied, sampling, seed, 0)
        search = self._search(varied) if "search" in self._nodes else None
        ending = self._stopping_rule(design, runs)
        design.runs = ending.max_runs if sampling in FIXED_SIZE_SAMPLINGS or search is not None else 0
        logs = self._word("logs", LOGS, "none")
        name = self._name()
        rehearsal = DryRun(self._draft, design, self._lines(), self._fixed)
        first = rehearsal.first_valid_values(ending.max_runs)
        if not has_begun:
            rehearsal.check_extreme_values(first, ending.max_runs, search)
        bundle = self._bundle(design, path, first)
        digest = self._digest(design, bundle, search)
        about = self._text("description", "")
        return Study(name, self._path, path, design, ending, logs, self._fixed, digest, about, bundle, search)

    def _name(self) -> str:
        """The name, after which the folder of the data set is called."""
        name = self._text("study", self._path.name.removesuffix(STUDY_SUFFIX))
        if "study" in self._nodes and (not name.isprintable() or name in ("", ".", "..") or set(name) & set("/\\")):
            self._nodes["study"].fail(f"{quoted(name)} cannot be the name of a study: the folder of its runs has it")
        return name

    def _search(self, varied: Mapping[str, Distribution]) -> SearchConfig:
        for key in ("until", "sampling"):
            if key in self._nodes:
                self._nodes[key].fail(f"search and {key} exclude each other: a search chooses the values of its runs")
        return parse_search(self._nodes["search"], self._draft, varied, self._lines(), self._fixed)

    def _scenario_file(self) -> Path:
        node = self._nodes["scenario"]
        path = resolve_root_copy(self._path.parent / node.text())
        if not path.is_file():
            known = [found.name for found in path.parent.glob("*.scenario.yaml")]
            node.fail(with_suggestion(f"there is no file {node.text()!r}", node.text(), known))
        return path

    def _varied(self) -> dict[str, Distribution]:
        """Distributions in the scenario itself, then those under `vary`, which replace the former."""
        nodes = self._lines()
        varied = {place: parse_distribution(node) for place, node in nodes.items() if place not in self._fixed}
        for place, found in varied.items():
            first = {place: found.append_unit(found.quantiles([0.5])[0])}
            self._check_place(place, nodes[place], first, varied)
        return varied

    def _lines(self) -> dict[str, Node]:
        """Lines of the distributions, by the place of their value."""
        return self._inside | (self._nodes["vary"].mapping() if "vary" in self._nodes else {})

    def _check_place(
        self, place: str, node: Node | None, first: Mapping[str, object], varied: Mapping[str, Distribution]
    ) -> None:
        """Reject a path at which the scenario has no value and can have none."""
        if place in self._places:
            return
        others = {
            name: found.append_unit(found.quantiles([0.5])[0]) for name, found in varied.items() if name in self._places
        }
        try:
            self._draft.scenario({**others, **first})
        except (ValueError, LookupError) as error:
            self._draft.scenario(others)  # if it is wrong as it is, the place is not to blame
            known = with_suggestion(f"{place} is no value of the scenario", place, self._places)
            missing = self._missing_list(place)
            if node is None:
                raise StudyFileError(missing or describe_value_error(self._draft, first, error)) from None
            node.fail(missing or f"{known}: {error}")

    def _missing_list(self, place: str) -> str:
        """Advice if a place is an item of a list that only the profile has; empty if it is not."""
        whole, _, item = place.rpartition("/")
        is_there = any(known.startswith(f"{whole}/") for known in self._places)
        value = self._draft.current_value(whole) if item.isdecimal() and not is_there else None
        if value is None:
            return ""
        above, _, option = whole.rpartition("/")
        section = above.partition("/parameters/")[2]
        words = "one item can be set only in a list that stands in the scenario; that of the profile is"
        return f"{place}: {words} parameters: {{{section}: {{{option}: [{value}]}}}}"

    def _stopping_rule(self, design: SamplingDesign, runs: int | None) -> StoppingRule:
        nodes = self._nodes
        if "runs" in nodes and "until" in nodes:
            nodes["until"].fail("runs and until exclude each other")
        for name in design.grid_names:
            if not design.distributions[name].levels:
                reason = f"sampling: grid needs values to choose from, as in grid or choice; {name} has none"
                nodes["sampling"].fail(reason)
        if runs is not None:
            return self._checked(StoppingRule(runs), design, self._root)
        if "until" in nodes:
            return self._checked(self._until(nodes["until"]), design, nodes["until"])
        if "runs" in nodes:
            return self._checked(StoppingRule(nodes["runs"].integer()), design, nodes["runs"])
        usual = design.grid_size if design.grid_names else design.block_size * 64
        most = usual if design.grid_names or design.sampling == "saltelli" else _RUNS
        return self._checked(StoppingRule(most), design, self._root)

    def _until(self, node: Node) -> StoppingRule:
        nodes = node.mapping(*_UNTIL, required=_UNTIL[:1])
        within = self._percent(nodes[_UNTIL[0]], 0.5)
        confidence = self._percent(nodes["confidence"], 1.0) if "confidence" in nodes else 0.95
        most = nodes["at most"].integer() if "at most" in nodes else _UNTIL_MOST
        return StoppingRule(most, within, confidence)

    def _checked(self, ending: StoppingRule, design: SamplingDesign, node: Node) -> StoppingRule:
        if not 1 <= ending.max_runs <= _MOST:
            node.fail(f"expected 1 to {_MOST} runs, not {ending.max_runs}")
        if ending.target_width is not None and design.sampling in FIXED_SIZE_SAMPLINGS:
            node.fail(f"sampling: {design.sampling} needs a number of runs: it proves nothing before its last run")
        if ending.target_width is not None and not has_interval(design.sampling):
            node.fail(
                f"sampling: {design.sampling} needs a number of runs: how well its pass rate is known has no formula"
            )
        block = design.block_size
        if design.sampling == "saltelli" and (ending.max_runs % block or not design.sampled_names or design.grid_names):
            if not design.sampled_names or design.grid_names:
                node.fail("sampling: saltelli needs distributions, and none of them a grid")
            low = ending.max_runs // block * block
            node.fail(f"sampling: saltelli of {len(design.sampled_names)} values needs a multiple of {block} runs: "
                      f"{low or block} or {low + block}")  # fmt: skip
        return ending

    def _percent(self, node: Node, most: float) -> float:
        match = _PERCENT.fullmatch(node.text().strip())
        if match is None or not 0.0 < float(match.group(1)) / 100.0 < most:
            node.fail(f"expected a percentage above 0 % and below {most:.0%}, not {node.text()!r}")
        return float(match.group(1)) / 100.0

    def _word(self, key: str, known: tuple[str, ...], default: str) -> str:
        if key not in self._nodes:
            return default
        word = self._nodes[key].text()
        if word not in known:
            self._nodes[key].fail(with_suggestion(f"{key}: unknown {word!r}", word, known))
        return word

    def _text(self, key: str, default: str) -> str:
        return self._nodes[key].text().strip() if key in self._nodes else default

    def _bundle(self, design: SamplingDesign, path: Path, first: Mapping[str, object]) -> StudyBundle:
        """All files of all runs: a value that is a text may name a plan or a profile."""
        sources = self._draft.dependencies(first)
        with suppress(ValueError):
            sources |= self._draft.dependencies(self._fixed)  # what a search may go back to
        for place, varied in design.distributions.items():
            for cell in varied.levels:
                if isinstance(cell, str):
                    with suppress(ValueError):  # the run with this value reports it
                        sources |= self._draft.dependencies({**first, place: cell})
        return make_bundle((self._path, path), sources, dict(self._named_files()))

    def _named_files(self) -> Iterator[tuple[str, Path]]:
        for node in self._nodes["files"].items() if "files" in self._nodes else ():
            place = resolve_root_copy(self._path.parent / node.text())
            if not place.exists():
                node.fail(f"there is no file or folder {node.text()!r}")
            for file in sorted(place.rglob("*")) if place.is_dir() else [place]:
                below = file.relative_to(place).parts
                if file.is_file() and not any(part.startswith((".", "__pycache__")) for part in below):
                    yield Path(node.text(), *below).as_posix(), file

    def _digest(self, design: SamplingDesign, bundle: StudyBundle, search: SearchConfig | None) -> str:
        varied = {name: [found.text, found.unit] for name, found in design.distributions.items()}
        parts = [self._draft.digest, design.seed, design.sampling, design.runs, varied, dict(self._fixed)]
        parts += [_SEED_PER_BLOCK] if design.sampling == "saltelli" else []
        parts += [bundle.digest] if bundle.digest else []
        parts += search.digest_parts if search is not None else []
        return hashlib.sha256(json.dumps(parts, ensure_ascii=False).encode()).hexdigest()
