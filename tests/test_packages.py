"""What is installed: the versions that the tests need."""

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


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
