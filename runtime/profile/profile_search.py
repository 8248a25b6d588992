"""Finds profiles by name in a list of folders."""

import os
from collections.abc import Iterable
from pathlib import Path, PurePath

from support.diagnostics import Problem, ProfileError
from support.terminal_text import quoted, suggestion
from support.user_folders import config_folder


def own_etc() -> Path:
    """Shoal's own profiles: inside the installed package, or next to it in a checkout."""
    package = Path(__file__).parents[1]
    installed = package / "etc"
    return installed if installed.is_dir() else package.parent / "etc"


def user_etc() -> Path:
    """The user's profiles: SHOAL_ETC, else shoal/etc in the XDG configuration folder."""
    if named := os.environ.get("SHOAL_ETC"):
        return Path(named)
    return config_folder() / "etc"


def resolve_root_copy(path: Path) -> Path:
    """The file to read for a path: its copy, if there is one, in the folder SHOAL_ROOT, which has the same paths.

    Whatever opens a file that a profile or a scenario names asks this: a campaign reads copies. A folder counts as
    copied only where there is no other, since it may have more files.
    """
    root = os.environ.get("SHOAL_ROOT")
    if not root or not path.is_absolute() or path.is_relative_to(root):
        return path
    copy = Path(root, *Path(os.path.abspath(path)).parts[1:])
    return copy if copy.is_file() or not path.exists() else path


def search_path(config_dirs: Iterable[str | Path] = ()) -> list[Path]:
    """The folders searched for a profile; the first match wins."""
    folders = [*map(Path, config_dirs), Path(), Path("etc"), user_etc(), own_etc()]
    return list(dict.fromkeys(folders))


def available_profiles(config_dirs: Iterable[str | Path] = ()) -> dict[str, Path]:
    """The files of all profiles by name."""
    found: dict[str, Path] = {}
    for folder in search_path(config_dirs):
        for path in sorted(folder.glob("*.ini")):
            if path.is_file() and not path.name.endswith("-saved.ini"):
                found.setdefault(path.stem, path)
    return found


def find_profile(name: str | Path, config_dirs: Iterable[str | Path] = ()) -> Path:
    """The file of a profile: a name is searched for in the folders, the path of an .ini file is used as is.

    Raises ProfileError if there is none, or if a name leads out of the folders.
    """
    text = os.fspath(name)
    if text.endswith(".ini"):
        if (path := resolve_root_copy(Path(text))).exists():
            return path
        if os.path.dirname(text):
            raise _refusal(text, "there is no such file")
        text = text.removesuffix(".ini")
    parts = PurePath(text).parts
    if not parts or not text.isprintable() or text.startswith(("/", "~")) or ".." in parts or "\\" in text:
        raise _refusal(text, "not a profile name", "give a name, or the path of an .ini file")
    config_dirs = list(config_dirs)
    for folder in search_path(config_dirs):
        path = folder / f"{text}.ini"
        if os.path.isfile(path):
            return path
    places = ", ".join(map(str, search_path(config_dirs)))
    raise _refusal(
        text, f"there is no profile {quoted(text)} in {places}", suggestion(text, available_profiles(config_dirs))
    )


def _refusal(name: str, text: str, hint: str = "") -> ProfileError:
    return ProfileError([Problem("error", name or "profile", 0, text, hint)])


def is_file(path: Path) -> bool:
    """Whether a file exists; False for a text that cannot be a path."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
