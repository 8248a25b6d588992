"""Packages of others with names of Shoal's, really installed: the command names both, and what repairs it."""

import base64
import hashlib
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import click
import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[3]


def wheel(folder: Path, name: str, files: dict[str, str]) -> Path:
    """A small wheel of somebody else, version 1.0."""
    about = f"{name}-1.0.dist-info"
    files = {
        **files,
        f"{about}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n",
        f"{about}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    lines = []
    for path, text in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()
        lines.append(f"{path},sha256={digest},{len(text.encode())}\n")
    files[f"{about}/RECORD"] = "".join(lines) + f"{about}/RECORD,,\n"
    target = folder / f"{name}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(target, "w") as packed:
        for path, text in files.items():
            packed.writestr(path, text)
    return target


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel of Shoal, in `editable` one that finds this clone, and those of others."""
    folder = tmp_path_factory.mktemp("wheels")
    list(WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"]))
    (folder / "editable").mkdir()
    command = {"shoal-1.0.dist-info/entry_points.txt": "[console_scripts]\nshoal = shoal.cli:main\n"}
    wheel(folder / "editable", "shoal", {"_editable_impl_shoal.pth": f"{ROOT}\n", **command})
    wheel(folder, "world", {"world/__init__.py": "MUNDUS = 'another'\n"})
    wheel(folder, "globe", {"world/__init__.py": "\n", "world/continents.py": "\n"})
    wheel(folder, "harmless", {"harmless/world/__init__.py": "\n", "worlds.py": "\n"})
    return folder


class Environment:
    """A real environment, in which the libraries of this one are found, too."""

    def __init__(self, folder: Path) -> None:
        venv.create(folder, symlinks=True)
        self.folder = folder
        self.python = folder / "bin" / "python"
        (self.packages,) = folder.glob("lib/python*/site-packages")
        (self.packages / "others.pth").write_text(f"{Path(click.__file__).parents[1]}\n")

    def pip(self, *words: object) -> None:
        command = [sys.executable, "-m", "pip", "--python", self.python, "-q", *words]
        subprocess.run([*map(str, command)], check=True, env={**os.environ, "PIP_CONFIG_FILE": os.devnull})

    def install(self, *wheels: Path) -> None:
        for each in wheels:
            self.pip("install", "--no-deps", "--no-index", "--no-compile", "--force-reinstall", each)

    def shoal(self, *words: str, **environment: str) -> tuple[int, str]:
        whole = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        command = [self.folder / "bin" / "shoal", *(words or ["--help"])]
        done = subprocess.run(command, capture_output=True, text=True, env={**whole, **environment}, timeout=120)
        return done.returncode, done.stderr


def shoal_of(wheels: Path) -> Path:
    (found,) = wheels.glob("shoal-*.whl")
    return found


@pytest.mark.heavy
@pytest.mark.parametrize("other", ["world", "globe"])
def test_a_package_installed_over_ours_is_named_with_what_repairs_it(tmp_path: Path, wheels: Path, other: str) -> None:
    place = Environment(tmp_path / "venv")
    own, others = shoal_of(wheels), wheels / f"{other}-1.0-py3-none-any.whl"
    place.install(own, wheels / "harmless-1.0-py3-none-any.whl")
    assert place.shoal() == (0, "")
    place.install(others)
    status, told = place.shoal()
    assert status == 2
    assert f"Error: shoal and {other} 1.0 have both installed a package world in {place.packages}, and each" in told
    assert f"to repair it: pip uninstall {other} && pip install --force-reinstall --no-deps {own}\n" in told
    place.pip("uninstall", "-y", other)
    assert "no __init__.py; to repair it: pip install --force-reinstall --no-deps" in place.shoal()[1]
    place.install(own)
    assert place.shoal() == (0, "")


@pytest.mark.heavy
def test_a_package_that_ours_was_installed_over_is_named(tmp_path: Path, wheels: Path) -> None:
    place = Environment(tmp_path / "venv")
    place.install(wheels / "world-1.0-py3-none-any.whl", shoal_of(wheels))
    status, told = place.shoal("tasks")
    assert (status, "shoal and world 1.0 have both installed a package world" in told) == (2, True)


@pytest.mark.heavy
def test_a_package_found_before_that_of_a_clone_is_named(tmp_path: Path, wheels: Path) -> None:
    place = Environment(tmp_path / "venv")
    place.install(shoal_of(wheels / "editable"))
    assert place.shoal() == (0, "")
    place.install(wheels / "world-1.0-py3-none-any.whl")
    status, told = place.shoal()
    assert status == 2
    assert f"finds the package world in {place.packages / 'world'}, before that of Shoal in {ROOT / 'world'}" in told
    assert "it belongs to world 1.0" in told
    assert "to repair it: pip uninstall world && pip install " in told


@pytest.mark.heavy
def test_a_folder_of_a_user_that_hides_a_package_is_named_and_one_that_does_not_is_none(
    tmp_path: Path, wheels: Path
) -> None:
    place = Environment(tmp_path / "venv")
    place.install(shoal_of(wheels))
    (tmp_path / "mine" / "tasks").mkdir(parents=True)
    (tmp_path / "mine" / "tasks" / "whistle.py").write_text("")
    (place.packages / "tasks" / "bell.py").write_text("")
    assert place.shoal(PYTHONPATH=str(tmp_path / "mine")) == (0, "")
    (tmp_path / "mine" / "tasks" / "__init__.py").write_text("")
    status, told = place.shoal(PYTHONPATH=str(tmp_path / "mine"))
    assert (status, f"rename it, or take {tmp_path / 'mine'} off PYTHONPATH" in told) == (2, True)
