"""The exit status says what happened: 1 is the answer no, 2 a mistake of the user, told in one line."""

import json
import os
from typing import Any

import pytest

from runtime import Script, Task
from runtime.testing import simulate
from tests import command
from tests.outside import NO_FILE, NO_FOLDER

RUN = "run lauv-noptilus-1 -p Kinematic --clock virtual --for 6s --snapshot-every 3s"
PLAN = "plan: p\norigin: 41.185°, -8.7062°\nmaneuvers:\n  - goto: {north: 5}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two logs of a run, and files that are none; the current one of all tests here."""
    place = tmp_path_factory.mktemp("wrong")
    before = os.getcwd()
    os.chdir(place)
    (place / "rubbish").write_bytes(bytes(range(256)) * 40)
    (place / "empty.ini").write_text("")
    os.mkfifo(place / "pipe")
    (place / "broken.ini").write_text(
        "[General]\nVehicle = broken\nnot an assignment = \n[Simulators.GPS\nx = $(A, b)\n"
    )
    (place / "plan.yaml").write_text(PLAN)
    done = shoal(f"{RUN} --log-dir log")
    assert done.exit_code == 0, done.output
    yield place
    os.chdir(before)


def shoal(words):
    return command.shoal(*words.split())


LOG = "log/lauv-noptilus-1/20260101/000000"
MISTAKES = [
    ("runn", "no such command: runn. Did you mean run?"),
    ("new drone", "no such command: drone. There are driver, scenario, task, vehicle."),
    ("new vehicel", "no such command: vehicel. Did you mean vehicle?"),
    ("log foo", "no such command: foo. There are cut, diff, "),
    (
        "mission otter plan.yaml --clock real",
        "shoal mission uses a virtual clock only, not 'real'; shoal run has others",
    ),
    ("mission otter nothere.yaml --clock virtual", f"nothere.yaml: {NO_FILE}"),
    ("test nothere --clock 10x", "uses a virtual clock only, not '10x'"),
    (f"resim {LOG} -t GPS --clock 10x", "uses a virtual clock only, not '10x'"),
    (f"rewind {LOG} --at 4 --clock 10x", "uses a virtual clock only, not '10x'"),
    ("run", "name a profile"),
    ("run nothere", "there is no profile 'nothere'"),
    ("run empty.ini", "the file has no section, so nothing runs"),
    ("run rubbish.ini", "rubbish"),
    ("run broken.ini", "broken.ini:5: error: invalid reference"),
    ("run hexa-00 -p Hardware --for 1s", "has nothing to run in mode Hardware besides Transports."),
    (
        "run otter -p Hardware --clock virtual --for 1s",
        "otter has nothing to run in mode Hardware besides Supervisors.Equipment, Transports.",
    ),
    ("run lauv-noptilus-1 -p Simlation", "unknown mode 'Simlation' (did you mean 'Simulation'?)"),
    ("run otter -d nodir", "'nodir'"),
    ("run otter --vehicle=", "it is empty"),
    ("run otter --for soon", "'soon' is not a duration"),
    ("run otter --clock slow", "slow"),
    ("run otter --bus tcp", "tcp"),
    ("run otter -p Simulation --bus zenoh --set Zenoh:Mode=peeer", "command line: error: [Zenoh] Mode"),
    (
        "run otter -p Simulation --bus zenoh --set Zenoh:Scouting=eth99",
        "Error: command line: error: [Zenoh] Scouting: this computer has no interface 'eth99', only ",
    ),
    (
        "run otter -p Simulation --bus zenoh --set Zenoh:Commanders=ground",
        "Error: command line: error: [Zenoh] Commanders, Listeners and Vehicles need Root Certificate or Users File",
    ),
    ("run otter --set GPS", "it must be Section:Option=value"),
    ("run otter --set Simulators.GSP:HACC=1", "there is no section [Simulators.GSP] (did you mean 'Simulators.GPS'?)"),
    ("run otter --set Generl:Seed=1", "there is no section [Generl] (did you mean 'General'?)"),
    ("run otter -p Simulation --set Simulators.GPS:HACC=high", "'high' is not a number"),
    ("run otter -p Simulation --log-dir rubbish", "no log can be written to rubbish/otter"),
    ("run --from-snapshot nothere", "'nothere'"),
    ("run --from-snapshot log", "'log'"),
    ("run --from-snapshot rubbish", "not a valid snapshot"),
    (f"run --from-snapshot {LOG}/State-3.msgpack --set Foo:Bar=1", "the vehicle has no task 'Foo'"),
    ("mission otter nothere.yaml", f"nothere.yaml: {NO_FILE}"),
    ("mission otter /dev/zero", "/dev/zero: larger than 4 MiB"),
    ("fleet /dev/zero", "/dev/zero: larger than 4 MiB"),
    ("run otter -p Simulation --clock 1e-9x", "no such clock: '1e-9x'"),
    ("mission otter rubbish", "rubbish: not UTF-8"),
    ("mission otter plan.yaml --set Foo:Bar=1", "there is no section [Foo]"),
    ("check nothere", "there is no profile 'nothere'"),
    ("check otter --set Foo:Bar=1", "there is no section [Foo]"),
    ("explain otter --set Foo:Bar=1", "there is no section [Foo]"),
    ("explain otter Simulators.GSP", "there is no section [Simulators.GSP]"),
    ("tasks Simulators.GSP", "there is no task 'Simulators.GSP'"),
    ("message EstimatedStat", "did you mean EstimatedState"),
    ("new task 3", "is not a class name"),
    ("new vehicle a/b", "is not a system name"),
    ("replay rubbish --clock virtual", "rubbish: there is no message in this log"),
    ("replay log", "log: no log in the folder"),
    (f"replay {LOG} --from never", "never"),
    (f"replay {LOG} --messages Nope --clock virtual", "there is no message 'Nope'"),
    (f"replay {LOG} --entities Nope --clock virtual", "there is no entity 'Nope'"),
    ("run otter -p Simulation --set Simulators.GPS:HACC=inf", "inf is not a value"),
    (f"rewind {LOG} --at 4h", "ends at 6 s of its run, before 4h"),
    (f"rewind {LOG} --at now", "'now' is not a duration"),
    (f"rewind {LOG} --at 4 --set Foo", "it must be Section:Option=value"),
    (f"rewind {LOG} --at 4 --set Foo:Bar=1", "the vehicle has no task 'Foo'"),
    ("rewind rubbish --at 4", "rubbish: there is no message in this log"),
    ("rewind log --at 4", "log: no log in the folder"),
    (f"resim {LOG} -t Foo", "there is no task 'Foo'"),
    (f"resim {LOG} -t GPS --set Foo:Bar=1", "Foo"),
    (f"resim {LOG} -t GPS -o rubbish/out", f"rubbish/out: {NO_FOLDER}"),
    ("resim rubbish -t GPS", "rubbish: the log has no messages"),
    ("log inf", "no such command: inf. Did you mean info?"),
    ("log info nothere", "nothere: no such log"),
    ("log info rubbish", "none of its 10240 bytes belongs to a message"),
    ("log ls nothere", "nothere: there is no such folder"),
    ("log diff rubbish rubbish", "rubbish: there is no message in this log"),
    (f"log diff {LOG} nothere", "nothere: no such log"),
    ("log doctor nothere", "nothere: no such log"),
    (f"log cut {LOG} rubbish/out", NO_FOLDER),
    (f"log cut {LOG} out -m Volt", "did you mean"),
    (f"log cut {LOG} out --from 9 --to 3", "--to must be after --from"),
    (f"log merge {LOG} nothere -o out", "nothere: no such log"),
    (f"log export {LOG} out.xyz", "unknown ending '.xyz'"),
    (f"log report {LOG} -o rubbish/page.html", NO_FOLDER),
    ("log import rubbish out", "rubbish: not an MCAP, .tlog, .BIN or .ulg file"),
    ("log import nothere out", f"nothere: {NO_FILE}"),
    ("log import /dev/zero out", "/dev/zero: not a regular file"),
    ("log import pipe out", "pipe: not a regular file"),
    ("log info /dev/zero", "/dev/zero: not a regular file"),
    ("log info pipe --run", "pipe: not a regular file"),
    ("message Abort --messages pipe", "pipe: not a regular file"),
]


@pytest.mark.parametrize(("words", "said"), MISTAKES, ids=[words for words, _ in MISTAKES])
def test_a_mistake_of_the_user_is_reported_with_status_2(folder, words, said):
    done = shoal(words)
    assert (done.exit_code, said in done.output) == (2, True), done.output
    assert "Traceback" not in done.output
    assert "Errno" not in done.output


def test_status_1_is_the_answer_no(folder):
    assert shoal(f"log diff {LOG} {LOG}").exit_code == 0
    assert shoal(f"log cut {LOG} part --from 1").exit_code == 0
    assert shoal(f"log diff {LOG} part").exit_code == 1
    assert shoal("log doctor rubbish").exit_code == 1
    assert shoal("mission otter plan.yaml --for 3s --log-dir other").exit_code == 1
    assert shoal("check empty.ini").exit_code == 1
    assert "the file has no section, so nothing runs" in shoal("check empty.ini").output


def test_a_mode_does_not_hide_the_errors_of_a_file(folder):
    done = shoal("check broken.ini -p Nothing")
    assert done.exit_code == 2
    assert "broken.ini:5: error: invalid reference" in done.output
    assert "unknown mode 'Nothing'" in done.output


def test_a_run_that_continues_says_where_its_log_is(folder):
    done = shoal(f"rewind {LOG} --at 4 --for 1s --log-dir new")
    assert (done.exit_code, "log in new/lauv-noptilus-1/20260101/000004" in done.output) == (0, True), done.output
    done = shoal(f"run --from-snapshot {LOG}/State-3.msgpack --for 1s --log-dir new")
    assert (done.exit_code, "log in new/lauv-noptilus-1/20260101/000003" in done.output) == (0, True), done.output


def test_json_has_stable_names(folder):
    summary = json.loads(shoal(f"log info {LOG} --json").output)
    assert summary["system"] == "lauv-noptilus-1"
    assert summary["types"]["EstimatedState"]["count"] == pytest.approx(120, abs=2)
    assert {"start", "end", "duration", "messages", "size", "schema", "entities", "clock_steps", "damage"} <= set(
        summary
    )
    (listed, *_) = json.loads(shoal("log ls log --json").output)
    assert (listed["path"], listed["problem"]) == (f"{LOG}/Data.lsf.gz", "")
    doctor = shoal("log doctor rubbish --json")
    assert (doctor.exit_code, json.loads(doctor.output)["healthy"]) == (1, False)
    equal = json.loads(shoal(f"log diff {LOG} {LOG} --json").output)
    assert (equal["equal"], equal["first"]) == (True, None)
    names = {task["task"] for task in json.loads(shoal("tasks --json").output)}
    assert {"Simulators.GPS", "Plan.Engine"} <= names
    gps = json.loads(shoal("tasks Simulators.GPS --json").output)
    assert next(p for p in gps["parameters"] if p["name"] == "HDOP")["minimum"] == 0
    checked = json.loads(shoal("check broken.ini otter --json").stdout)
    assert checked["profiles"]["otter"] == []
    assert checked["profiles"]["broken.ini"][-1]["line"] == 5
    assert checked["counts"]["error"] >= 1


class Careless(Task):
    """Publishes a number, and waits for texts."""

    number: Any = 5
    text: Any = "GpsFix"

    async def listen(self, script: Script) -> None:
        with pytest.raises(TypeError, match=r"expected the class of a message, such as imc.GpsFix, not 'GpsFix'"):
            script.listen(self.text)
        await script.receive(self.text)

    def start(self) -> None:
        with pytest.raises(TypeError, match=r"publish takes a message, such as imc.Depth\(value=1.0\), not 5"):
            self.publish(self.number)
        self.start_script(self.listen)


def test_a_task_that_confuses_values_and_messages_is_reported():
    with pytest.raises(TypeError, match=r"expected the class of a message, such as imc.GpsFix, not 'GpsFix'"):
        simulate(Careless, feed=[], seconds=2.0)


DECLARATIONS = [
    ("x = param(1.0, 'Hz', 'X.')", "Bad.x has no type: write x: float = param(...)"),
    ("x: float = param('a', 'Hz', 'X.')", "the default 'a' is not real"),
    ("x: float = param(1.0, 'Hz', 'X.', minimum='a')", "Bad.x: minimum, maximum or choices do not fit its type"),
    ("x: dict = param({}, '', 'X.')", "a parameter is a bool, int, float, str or a list of them"),
    ("x: float = param(1.0, '', 'X.', scope='all')", "'all' is not one of global, idle, plan, maneuver"),
    ("x: float = param(1.0, '', '', name='Y'); y: float = param(1.0, '', '')", "two parameters have the name 'Y'"),
    ("x: float = param(1.0)", "param() missing 2 required positional arguments"),
    ("f = consume(lambda self, m: None)", "annotate the argument with the message that it consumes"),
]


@pytest.mark.parametrize(("line", "said"), DECLARATIONS, ids=[said for _, said in DECLARATIONS])
def test_a_bad_declaration_is_reported_with_the_line_of_its_section(folder, tmp_path, line, said):
    head = "import imc\nfrom runtime import Task, consume, param\n\n\nclass Bad(Task):\n"
    name = f"bad_{DECLARATIONS.index((line, said))}"
    (tmp_path / f"{name}.py").write_text(f'{head}    """Bad."""\n\n    {line}\n')
    profile = tmp_path / "bad.ini"
    profile.write_text(f"[General]\nVehicle = bad\n\n[{name}.Bad]\nEnabled = Always\n")
    for verb, status in (("run", 2), ("check", 1)):
        more = " --clock virtual --for 1s" if verb == "run" else ""
        done = shoal(f"{verb} {profile} --code {tmp_path}{more}")
        assert (done.exit_code, f"{profile}:4: error" in done.output, said in done.output) == (status, True, True), (
            done.output
        )
        assert "Traceback" not in done.output
