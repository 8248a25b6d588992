"""Finds packages of others with names of Shoal's: installed over Shoal's, or found before them."""

import importlib.util
import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
OWN = "shoal"


def describe_conflict() -> str:
    """Describe conflicts of the packages of the running Shoal, and the commands that repair it; "" if nothing.

    It costs a millisecond, so it looks at file names and at Shoal's own list of files. Only if these are suspicious, it
    searches all that is installed. A module of a user within one of Shoal's packages is no conflict.
    """
    names = _names()
    for name in names:
        place = _place(name)
        if place is None or (place != ROOT / name and place.resolve() != (ROOT / name).resolve()):
            return _found_elsewhere(name, place)
    about = _abouts(ROOT)
    if own := about.pop(OWN, None):
        suspicious = any(each in names for each in about) or _has_strange_files(names, own / "RECORD")
        for name, other in _owners(ROOT, names) if suspicious else ():
            return (
                f"{OWN} and {other} have both installed a package {name} in {ROOT}, and each has overwritten files of "
                f"the other; {_repair(other)}"
            )
    return ""


def _names() -> tuple[str, ...]:
    """Shoal's packages; not imported, since `support` may be somebody else's."""
    spec = importlib.util.spec_from_file_location("shoal_packages", ROOT / "support" / "top_level_packages.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.PACKAGES


def _place(name: str) -> Path | None:
    """The folder or module of a package that an import would find; None without an `__init__`."""
    try:
        spec = importlib.util.find_spec(name)
    except ValueError:  # something without a spec is in its place
        return None
    if spec is None or spec.origin is None:
        return None
    file = Path(spec.origin)
    return file.parent if file.name == "__init__.py" else file


def _found_elsewhere(name: str, place: Path | None) -> str:
    if place is None:
        return f"{ROOT / name} has no __init__.py; {_repair()}"
    found = f"Python finds the package {name} in {place}, before that of Shoal in {ROOT / name}"
    other = next((other for _, other in _owners(place.parent, (name,))), "")
    if other:
        return f"{found}: it belongs to {other}, and {OWN} needs its own; {_repair(other)}"
    return f"{found}; rename it, or take {place.parent} off PYTHONPATH"


def _abouts(folder: Path) -> dict[str, Path]:
    """Installed packages in a folder, by name: the folders of their metadata."""
    found = (re.fullmatch(r"([^-]+)(?:-.*)?\.(?:dist|egg)-info", entry) for entry in os.listdir(folder))
    return {each[1].lower(): folder / each[0] for each in found if each}


def _has_strange_files(names: tuple[str, ...], record: Path) -> bool:
    """Whether Shoal's packages have more, or other content, than Shoal has installed there."""
    try:
        text = record.read_text()
        for name in names:
            listed = dict(re.findall(rf"^{name}/([^/,\n]+)(?:/.*|,[^,\n]*,(\d*))$", text, re.MULTILINE))
            if any(entry not in listed and entry != "__pycache__" for entry in os.listdir(ROOT / name)):
                return True
            if (ROOT / name / "__init__.py").stat().st_size != int(listed["__init__.py"] or 0):
                return True
    except (OSError, KeyError, ValueError):
        return True
    return False


def _owners(folder: Path, names: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Packages of these that others than Shoal have installed in a folder, with the name and version of the other."""
    from importlib.metadata import distributions  # slow, and rarely needed

    for each in distributions(path=[str(folder)]):
        if each.name != OWN:
            own = {file.parts[0].removesuffix(".py") for file in each.files or ()}
            yield from ((name, f"{each.name} {each.version}") for name in names if name in own)


def _repair(other: str = "") -> str:
    """The commands after which Shoal has its packages again, from where it was installed."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution
    from urllib.parse import unquote

    source = OWN
    try:
        own = distribution(OWN)
        source = f"{OWN}=={own.version}"
        direct = json.loads(own.read_text("direct_url.json") or "{}")
        if place := unquote(direct.get("url", "")).removeprefix("file://"):
            source = "-e " * bool(direct.get("dir_info", {}).get("editable")) + shlex.quote(place)
    except (PackageNotFoundError, ValueError, AttributeError):
        pass
    commands = [f"pip uninstall {other.split()[0]}"] if other else []
    return f"to repair it: {' && '.join([*commands, f'pip install --force-reinstall --no-deps {source}'])}"
