"""Every block of code in the README and the docs runs: python and sh, in order, in one temporary folder.

`file=NAME` writes the block to that file first. Blocks in other languages (bash, text) are not run.
"""

import os
import re
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import click
import pytest

from runtime import Task
from runtime.testing import simulate
from shoal.cli import main

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
# Flights of several seconds of computing each, or processes that start: heavy.
LONG = (
    "README",
    "aerial",
    "autopilot",
    "cameras",
    "charts",
    "detection",
    "driver",
    "dynamics",
    "export",
    "fleet",
    "frames",
    "from-dune",
    "hand",
    "logs",
    "mavlink",
    "mavlink-missions",
    "mission",
    "neptus",
    "plans",
    "scenarios",
    "surface",
    "time",
    "tutorial",
    "water",
    "zenoh",
)
REPEATS = ("campaigns",)  # whose flights are those of the tests of campaigns, many times
HANGS = 1800.0  # s, of a block that does not end; how long the others take is the computer's affair
MARKS = dict.fromkeys(LONG, pytest.mark.heavy) | dict.fromkeys(REPEATS, pytest.mark.campaign)
FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(document):
    return [(lang, re.search(r"file=(\S+)", info), code) for lang, info, code in FENCE.findall(document.read_text())]


@pytest.mark.timeout(0)
@pytest.mark.parametrize(
    "document",
    [pytest.param(p, marks=MARKS.get(p.stem, ())) for p in DOCUMENTS],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_blocks_run(document, tmp_path, apart):
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]),
        "COLUMNS": "120",
    }
    for language, file, code in blocks(document):
        if file is not None:
            (tmp_path / file.group(1)).write_text(code)
            if language == "python":
                compile(code, file.group(1), "exec")
            continue
        if language == "python":
            command = [sys.executable, "-c", code]
        elif language == "sh":
            command = ["bash", "-euo", "pipefail", "-c", code]
        else:
            continue
        words = [*apart, *command]
        done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=HANGS)
        assert done.returncode == 0, f"{code}\n{done.stdout}\n{done.stderr}"


OWN_TEST = """from imc import Depth, Temperature
from runtime import Task, consume
from runtime.testing import simulate


class Thermocline(Task):
    @consume
    def measure(self, depth: Depth) -> None:
        self.publish(Temperature(value=20.0 - depth.value))


def test_it_is_colder_below():
    run = simulate(Thermocline, feed=[Depth(value=2.0)])
    assert [message.value for message in run.of(Temperature)] == [18.0]
"""


def test_a_task_in_a_folder_of_the_clone_is_tested_with_pytest_alone(tmp_path):
    (tmp_path / "test_own.py").write_text(OWN_TEST)
    settings = ["-c", str(ROOT / "pyproject.toml"), "--rootdir", str(tmp_path), "-p", "no:timeout"]
    command = [sys.executable, "-m", "pytest", "-q", *settings, "test_own.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=HANGS)
    assert (done.returncode, done.stdout.splitlines()[-1].split(" in ")[0]) == (0, "1 passed"), done.stdout


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_and_pictures_exist(document):
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", document.read_text()):
        if not target.startswith(("http://", "https://")):
            assert (document.parent / target).exists(), target


def test_what_documents_say_of_shoal_is_found_by_import_shoal():
    """Also in a sentence, or a program that is not run."""
    told = {
        name for document in DOCUMENTS for name in re.findall(r"\bshoal(?:\.[A-Za-z_]+)+(?=\()", document.read_text())
    }
    assert "shoal.missions.load_plan" in told
    code = "\n".join(["import shoal", *sorted(told)])
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=HANGS)
    assert done.returncode == 0, done.stderr


def test_methods_of_a_task_that_documents_name_exist():
    text = "\n".join(document.read_text() for document in DOCUMENTS)
    named = {call for code in re.findall(r"`[^`\n]+`", text) for call in re.findall(r"\bself\.([a-z_.]+)\(", code)}
    assert {"log.info", "publish"} <= named
    simulated = simulate(Task).task
    assert not [name for name in sorted(named) if not callable(attrgetter(name)(simulated))]


def options_of(command):
    """Names of the options of a command, for a group also those of its commands: one of them is the default."""
    own = {name for param in command.params for name in (*param.opts, *param.secondary_opts)}
    if not isinstance(command, click.Group):
        return own
    context = click.Context(command)
    return own.union(*(options_of(command.get_command(context, name)) for name in command.list_commands(context)))


def test_options_that_documents_name_exist():
    context, wrong, found = click.Context(main), [], 0
    for document in DOCUMENTS:
        for line in re.findall(r"(?:^|`)shoal ([^`\n|&;]*)", document.read_text(), re.MULTILINE):
            command, *words = main, *line.split()
            while words and isinstance(command, click.Group) and (inner := command.get_command(context, words[0])):
                command = inner
                words.pop(0)
            named = {word.partition("=")[0] for word in words if re.match(r"--[a-z]", word)}
            wrong += [f"{document.name}: shoal {line}"] if named - options_of(command) - {"--help"} else []
            found += len(named)
    assert found > 100
    assert not wrong


def test_promises_name_tests_that_exist():
    rows = re.findall(r"^\| (?!promise|-)(.+?) \| (.+) \|$", (ROOT / "docs/promises.md").read_text(), re.MULTILINE)
    assert len(rows) > 90
    for promise, tests in rows:
        file = None
        for path, name in re.findall(r"`(?:([\w/]+\.py)(?:::)?)?(test_\w+)?`", tests):
            file = path or file
            text = next((p.read_text() for p in (ROOT / "tests" / file, ROOT / file) if p.is_file()), "")
            assert text, f"{promise}: no {file}"
            assert f"def {name}" in text, f"{promise}: {file} has no {name}"
