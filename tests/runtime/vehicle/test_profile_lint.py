"""The check of profiles: every mistake has a file, a line and a fix; and the output of explain."""

from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pytest

from runtime import Task, param
from runtime.profile import Profile, load_profile
from runtime.task import shared_options
from runtime.vehicle import check_profile, explain_section
from support.diagnostics import Problem, ProfileError

TREE = Path(__file__).parents[2] / "data/profiles"


class Swimmer(Task):
    """Swims."""

    rate: float = param(50.0, "Hz", "Rate of the steps.", minimum=1, maximum=1000, aliases=("Execution Frequency",))
    seed: int = param(-1, "1", "Seed of the noise.")
    initial_heading: float = param(0.0, "deg", "Heading at the beginning.", minimum=-180, maximum=180)
    initial_position: list[float] = param([0.0, 0.0], "deg", "Latitude and longitude.", size=2)
    drag: list[float] = param([], "kg/s", "Linear drag.")
    model: str = param("simple", "", "Equations of motion.", choices=("simple", "full"))
    enable_roll: bool = param(True, "", "Whether the vehicle rolls.")
    start_depth: float = param(0.0, "m", "Depth at the beginning.")


class Speaker(Task):
    """Speaks."""

    transports: list[str] = param([], "", "Messages that are sent.")
    filtered_entities: list[str] = param([], "", "Entities that are heard.")
    local_port: int = param(6001, "", "Port.", minimum=1, maximum=65535)


class Depth(NamedTuple):
    """An option of a section of none of the tasks."""

    unit: str = "m"
    meaning: str = "How deep the water is."
    default: str = "5"
    section_prefix: str = ""


class Diver(Task):
    """Dives in a pool."""

    reads = MappingProxyType(
        {"Pool": {"Depth": Depth(), "Lanes": Depth(section_prefix="Pool/")}, "Pool/": {"Width": Depth()}}
    )


TASKS: dict[str, type[Task]] = {"Simulators.Swimmer": Swimmer, "Transports.Speaker": Speaker, "Simulators.GPS": Swimmer}

GOOD = """[General]
Vehicle = auv
[IMC Addresses]
auv = 0x0010
[Profiles]
Tank = In the tank.
[Simulators.Swimmer]
Enabled = Simulation
Entity Label = Swimmer
"""


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(text: str) -> Profile:
    Path("auv.ini").write_text(text)
    return load_profile("auv.ini", strict=False)


def found(text: str, selected: list[str] | None = None) -> list[str]:
    return [str(problem) for problem in check_profile(written(text), TASKS, selected)]


def test_a_good_profile_has_no_problems() -> None:
    assert found(GOOD) == []


SWIMMER = {
    "misspelled parameter": (
        "Inital Heading = 1",
        "warning",
        "not a parameter of Simulators.Swimmer",
        "'Initial Heading'",
    ),
    "letter case of a parameter": ("Initial heading = 1", "warning", "the letter case differs", "'Initial Heading'"),
    "unlike any parameter": (
        "Zzzz = 1",
        "warning",
        "Swimmer, and is ignored",
        "shoal explain lists those",
    ),
    "blank before plus": ("Transports + = a", "warning", "with the blank", "write Transports+ ="),
    "no number": ("Start Depth = deep", "error", "'deep' is not a number (expects real, m)", "the default is 0.0"),
    "no integer": ("Seed = 0.5e", "warning", "'.5e' after the number is ignored", "write the number alone"),
    "not even an integer": ("Seed = x", "error", "'x' is not an integer", "the default is -1"),
    "below the minimum": (
        "Rate = 0",
        "error",
        "below the minimum (expects real, 1 to 1000, Hz)",
        "the default is 50.0",
    ),
    "above the maximum": ("Rate = 1e6", "error", "above the maximum (expects real, 1 to 1000, Hz)", "50.0"),
    "above the maximum by its other name": ("Execution Frequency = 1e6", "error", "1 to 1000, Hz", "50.0"),
    "not a number at all": ("Rate = nan", "error", "nan is not a value", "50.0"),
    "not among the choices": ("Model = ful", "error", "one of simple, full", "did you mean 'full'?"),
    "yes for true": ("Enable Roll = yes", "error", "'yes' is not true or false", "write true or false"),
    "capitals for true": ("Enable Roll = TRUE", "error", "is not true or false", "write true or false"),
    "too few items": ("Initial Position = 41.2", "error", "has 1 items (expects list:real, deg, 2 items)", "0.0, 0.0"),
    "bad item of a list": ("Drag = 1, two, 3", "error", "'two' is not a number", ""),
    "extra comma in a list of numbers": ("Drag = 1, 2,", "error", "'' is not a number", ""),
    "unit appended": (
        "Start Depth = 5 m",
        "warning",
        "'m' after the number is ignored",
        "the number alone; it is in m",
    ),
    "another unit appended": ("Initial Heading = 1.5 rad", "warning", "'rad' after the number", "it is in deg"),
    "suffix of C": ("Start Depth = 60.0f", "warning", "'f' after the number is ignored", ""),
    "decimal comma": ("Start Depth = 1,5", "warning", "',5' after the number is ignored", "decimal point as ."),
    "octal": ("Seed = 0100", "warning", "0100 begins with 0 and is read as octal: 64", "without the 0"),
    "value cut": ("Model = simple#full", "warning", "the value ends before '#': 'simple'", "blanks around"),
    "DUNE's own option": ("Active - Scope = maneuver", "note", "Active - Scope has no effect in Shoal", ""),
    "set twice": ("Entity Label = Fish", "note", "Entity Label is already set in line 9", "this line wins"),
    "empty label": ("Entity Label =", "warning", "Entity Label is empty, so it is 'Swimmer'", "DUNE rejects"),
    "Daemon's label": ("Entity Label = Daemon", "error", "'Daemon' is taken by the vehicle itself", "of its own"),
    "unknown mode": ("Enabled = Tanc", "warning", "unknown mode 'Tanc'", "'Tank'"),
    "letter case of a mode": ("Enabled = always", "warning", "unknown mode 'always'", "'Always'"),
    "no mode at all": ("Enabled =", "warning", "has no Enabled, so it never runs", "write Enabled = Always"),
    "bad attribute": ("Rate {scope: never} = 50", "warning", "scope cannot be 'never'", "global, idle, plan, maneuver"),
}

SECTIONS = {
    "misspelled task": ("[Simulators.Swimer]\nEnabled = Always", "error", "is not a task", "[Simulators.Swimmer]"),
    "misspelled group": ("[Simulator.Swimmer]\nEnabled = Always", "error", "is not a task", "[Simulators.Swimmer]"),
    "letter case of a task": ("[Simulators.swimmer/2]", "warning", "differs in letter case", "[Simulators.Swimmer/2]"),
    "task without its group": (
        "[Swimmer]\nEnabled = Always",
        "error",
        "is not a task",
        "did you mean [Simulators.Swimmer]",
    ),
    "module that is not there": ("[mine.Whistle]\nEnabled = Always", "error", "is not a task", "no module 'mine'"),
    "task of DUNE": ("[Supervisors.Vehicle]\nEnabled = Always", "note", "a task of DUNE that is not available", ""),
    "device of DUNE": ("[Sensors.Keller/2]\nEnabled = Hardware", "note", "a task of DUNE that is not available", ""),
    "neither of Shoal nor of DUNE": (
        "[Simulators.Flute]\nEnabled = Always",
        "error",
        "is not a task",
        "no module 'Simulators' and no tasks/simulators/flute.py where tasks are searched for; see --code",
    ),
    "misspelled task of DUNE": ("[Sensors.Kelller]\nEnabled = Always", "error", "not a task", "mean [Sensors.Keller]"),
    "task without a group": ("[Pip]\nEnabled = Always", "error", "not a task", "write [Mine.Pip] for the class Pip in"),
    "unknown task that never runs": ("[Sensors.Kelller]\nEnabled = Never", "warning", "not a task", "Sensors.Keller"),
    "device with a simulator's name": ("[Sensors.GPS]\nEnabled = Hardware", "note", "a task of DUNE", ""),
    "letter case of General": ("[general]", "warning", "[general] differs in letter case", "write [General]"),
    "misspelled data": ("[IMC Adresses]", "warning", "nothing reads [IMC Adresses]", "[IMC Addresses]"),
    "a task that never runs": ("[Simulators.GPS]", "warning", "has no Enabled", "write Enabled = Always"),
}

ELSEWHERE = {
    "misspelled general option": ("[General]\nVehicel = x", "warning", "unknown option 'Vehicel'", "'Vehicle'"),
    "unknown general option": ("[General]\nZzzz = x", "note", "unknown option 'Zzzz'", ""),
    "bad start time": ("[General]\nStart Time = 12", "error", "'12' is not a date and time", "2026-01-01T00:00:00Z"),
    "bad bus": ("[General]\nBus = dds", "error", "unknown bus 'dds'", "known: inprocess, zenoh"),
    "bad vehicle": ("[General]\nVehicle = a/b", "error", "cannot be the name of a vehicle", "letters, digits"),
    "unknown vehicle": ("[General]\nVehicle = nemo", "note", "'nemo' is not in [IMC Addresses], so its id is 0xA", ""),
    "bad id": ("[IMC Addresses]\nx = 70000", "warning", "'x' has no id: 70000 is above the maximum", "0x001A"),
    "id of another": ("[IMC Addresses]\nx = 16", "note", "'x' and 'auv' (auv.ini:4) have the same id 16", ""),
}


@pytest.mark.parametrize("case", [*SWIMMER, *SECTIONS, *ELSEWHERE])
def test_each_mistake_is_named_with_file_line_and_fix(case: str) -> None:
    text, severity, what, fix = (SWIMMER | SECTIONS | ELSEWHERE)[case]
    line = len((GOOD + text).splitlines()) - (case in SECTIONS and "\n" in text)
    said = found(GOOD + text)
    matching = [s for s in said if s.startswith(f"auv.ini:{line}: {severity}: ") and what in s and fix in s]
    assert len(matching) == 1, said


def test_the_same_label_names_both_places() -> None:
    text = GOOD + "[Simulators.Swimmer/2]\nEnabled = Simulation\nEntity Label = Swimmer\n"
    taken = "is taken by [Simulators.Swimmer] (auv.ini:9)"
    assert found(text) == [
        f"auv.ini:12: error: [Simulators.Swimmer/2] Entity Label: 'Swimmer' {taken} (give each task a label of its own)"
    ]
    assert found(text, ["Simulation"]) == found(text)
    assert found(text, []) == []
    assert found(text.replace("Simulation\nEntity Label = Swimmer\n", "Hardware\nEntity Label = Swimmer\n", 1)) == []
    assert len(found(text.replace("Swimmer\n", "Swimmer/2\n").replace("Label = Swimmer/2", "Label ="))) == 2


def test_what_does_not_run_is_not_looked_into() -> None:
    text = GOOD + "[Simulators.GPS]\nEnabled = Hardware\nRate = fast"
    assert found(text, ["Simulation"]) == []
    assert len(found(text, ["Hardware"])) == len(found(text)) == 1
    assert found(text.replace("Hardware", "Never")) == []


def test_a_module_that_fails_to_import_is_an_error() -> None:
    def find_task(section: str) -> type[Task] | None:
        if section == "mine.Whistle":
            raise ImportError("mine.Whistle: module mine cannot be imported: no reed")
        return TASKS.get(section)

    profile = written(GOOD + "[mine.Whistle]\nEnabled = Always")
    assert [str(problem) for problem in check_profile(profile, TASKS, find_task=find_task)] == [
        "auv.ini:10: error: [mine.Whistle]: mine.Whistle: module mine cannot be imported: no reed"
    ]


def test_problems_follow_the_order_of_files_and_lines() -> None:
    Path("list.ini").write_text("[Simulators.Swimmer]\nEnabled = Simulation\nZ = 1\n")
    profile = written("[Require list.ini]\n[Simulators.Swimmer]\nRate = 0\n| x\n")
    places = [(problem.file, problem.line) for problem in check_profile(profile, TASKS)]
    assert places == [("auv.ini", 3), ("auv.ini", 4), ("list.ini", 3)]
    assert all(isinstance(problem, Problem) for problem in check_profile(profile, TASKS))


def test_a_tree_in_the_manner_of_dune_has_warnings_and_notes_only() -> None:
    said = check_profile(load_profile("lauv-mantaray-7", [TREE]), TASKS)
    assert [(problem.severity, Path(problem.file).name, problem.line) for problem in said] == [
        ("warning", "lauv-mantaray-7.ini", 6),
        ("note", "simulator.ini", 7),
        ("note", "basic.ini", 1),
    ]


def test_explain_says_value_unit_meaning_and_origin() -> None:
    profile = load_profile("lauv-mantaray-7", [TREE], overrides=["Simulators.Swimmer:Model=full"])
    rows = {row.option: row for row in explain_section(profile, "Simulators.Swimmer", Swimmer)}
    assert next(iter(rows)) == "Enabled"
    position = rows["Initial Position"]
    assert (position.value, position.unit, position.meaning) == ("41.18, -8.70", "deg", "Latitude and longitude.")
    assert position.origin.endswith("lauv-mantaray-7.ini:16")
    assert (rows["Start Depth"].value, rows["Start Depth"].origin) == ("0.0", "default")
    assert rows["Model"].origin == "command line"
    assert rows["Execution Frequency"].parameter is Swimmer.parameters()["Rate"]
    assert "Rate" not in rows
    assert rows["Active"].meaning == "no effect in Shoal"


def test_explain_says_what_made_a_list_and_what_was_overwritten() -> None:
    row = next(
        r
        for r in explain_section(load_profile("lauv-mantaray-7", [TREE]), "Transports.Speaker")
        if r.option == "Transports"
    )
    assert [(Path(origin.file).name, origin.line) for origin in row.origins] == [
        ("lauv-mantaray-7.ini", 24),
        ("lauv-mantaray-7.ini", 22),
        ("transports.ini", 5),
        ("transports.ini", 4),
    ]
    depth = next(
        r for r in explain_section(load_profile("lauv-mantaray-7", [TREE]), "General") if r.option.endswith("Depth")
    )
    assert (depth.value, depth.unit) == ("40", "m")
    assert [(Path(origin.file).name, origin.line) for origin in depth.overwritten] == [("basic.ini", 9)]


def test_explain_of_an_unknown_section_names_the_nearest() -> None:
    with pytest.raises(ProfileError, match=r"no section \[Simulators.Swimer\] \(did you mean 'Simulators.Swimmer'\?\)"):
        explain_section(written(GOOD), "Simulators.Swimer")
    assert explain_section(written(GOOD), "Simulators.Swimmer/2", Swimmer)[0].value == "Never"


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("[Zenoh]\nLisen = tcp/0.0.0.0:7448\n", "auv.ini:11: error: [Zenoh] Lisen: unknown option"),
        ("[Zenoh]\nMode = peeer\n", "auv.ini:11: error: [Zenoh] Mode"),
        ("[General]\nSeed = many\n", "auv.ini:11: error: [General] Seed: 'many' is not a seed"),
    ],
)
def test_the_sections_of_the_runtime_are_checked_too(section: str, words: str) -> None:
    assert any(str(problem).startswith(words) for problem in check_profile(written(GOOD + section), TASKS))


def test_a_section_that_several_tasks_read() -> None:
    text = f"{GOOD}[Pool]\nDepht = 3\nColour = blue\nLanes = Left\n[Pool/Left]\nWidth = 3\nDepth = 2\n[Pool/Right]\n"
    told = [str(problem) for problem in check_profile(written(text), {**TASKS, "Divers.Diver": Diver})]
    assert told == [
        "auv.ini:11: warning: [Pool] nothing reads 'Depht' (did you mean 'Depth'?)",
        "auv.ini:12: warning: [Pool] nothing reads 'Colour' (shoal explain lists those of Pool)",
        "auv.ini:16: warning: [Pool/Left] nothing reads 'Depth' (shoal explain lists those of Pool/Left)",
        "auv.ini:17: warning: nothing reads [Pool/Right] (write 'Right' in Lanes of [Pool])",
    ]
    first, *_, second, _ = explain_section(written(text), "Pool", shared=shared_options([Diver], "Pool"))
    assert (first.option, first.value, first.unit, first.origin) == ("Depth", "5", "m", "default")
    assert second.meaning == "unknown; did you mean 'Depth'?"
    assert shared_options([Diver, Swimmer], "Pools") == {}
