"""What is installed: our packages and nothing else, and the versions that the tests need."""

import re
import tarfile
import tomllib
import zipfile
from pathlib import Path

from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from support.top_level_packages import PACKAGES

ROOT = Path(__file__).parent.parent
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = SETTINGS["project"]


def test_our_packages_are_the_folders_of_python_in_the_repository():
    assert sorted(path.parent.name for path in ROOT.glob("*/__init__.py")) == sorted(PACKAGES)


def test_our_packages_are_those_of_each_tool():
    tools = SETTINGS["tool"]
    hatch, linter = tools["hatch"]["build"]["targets"], tools["importlinter"]
    layers = next(each["layers"] for each in linter["contracts"] if "shoal" in each.get("layers", ()))
    lists = {
        "wheel": hatch["wheel"]["packages"],
        "sdist": [name for name in hatch["sdist"]["include"] if (ROOT / name / "__init__.py").exists()],
        "pyright": tools["pyright"]["include"],
        "pyright, strict": tools["pyright"]["strict"],
        "import-linter": linter["root_packages"],
        "layers": [name for layer in layers for name in layer.split(" | ")],
    }
    assert {tool: sorted(names) for tool, names in lists.items()} == dict.fromkeys(lists, sorted(PACKAGES))


def test_the_world_may_not_import_what_is_above_support():
    contracts = SETTINGS["tool"]["importlinter"]["contracts"]
    (forbidden,) = (each["forbidden_modules"] for each in contracts if each.get("source_modules") == ["world"])
    assert sorted([*forbidden, "world", "support"]) == sorted(PACKAGES)


def test_a_container_gets_our_packages():
    copied = re.findall(r"^COPY (\w+) \1$", (ROOT / "etc" / "deploy" / "Containerfile").read_text(), re.MULTILINE)
    assert sorted(copied) == sorted(["etc", *PACKAGES])


def test_the_wheel_has_our_packages(tmp_path):
    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path))
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names} == {*PACKAGES, f"shoal-{PROJECT['version']}.dist-info"}
    sources = {str(path.relative_to(ROOT)) for package in PACKAGES for path in (ROOT / package).rglob("*.py")}
    assert {name for name in names if name.endswith(".py")} == sources
    assert {name for name in names if name.endswith("/py.typed")} == {f"{package}/py.typed" for package in PACKAGES}


def test_the_source_archive_has_all_that_its_tests_read(tmp_path):
    (archive,) = SdistBuilder(str(ROOT)).build(directory=str(tmp_path))
    with tarfile.open(archive) as opened:
        names = {name.partition("/")[2].partition("/")[0] for name in opened.getnames()}
    read = {".ci", ".github", ".pre-commit-config.yaml", "CITATION.cff", "CONTRIBUTING.md", "SECURITY.md"}
    assert {*PACKAGES, "bench", "docs", "etc", "tests", *read} <= names


def test_each_package_that_the_tests_need_has_one_version():
    lines = [line for line in (ROOT / "tests" / "constraints.txt").read_text().splitlines() if line[:1] != "#"]
    assert [line for line in lines if not re.fullmatch(r"[\w.-]+==[\w.!+]+( ?;.*)?", line)] == []
    versions = {canonicalize_name(line.split("==")[0]): line.split("==")[1].split(";")[0].strip() for line in lines}
    extras = PROJECT["optional-dependencies"]
    needed = [Requirement(text) for texts in (PROJECT["dependencies"], *extras.values()) for text in texts]
    missing = [
        str(one)
        for one in needed
        if one.name != PROJECT["name"] and not one.specifier.contains(versions.get(canonicalize_name(one.name), "0"))
    ]
    assert missing == []
    (line,) = (line for line in (ROOT / "README.md").read_text().splitlines() if "'.[dev]'" in line)
    assert "-c tests/constraints.txt" in line
