"""Writes ini files and reads them: what they set, and what is wrong with them."""

import os
from pathlib import Path

from runtime.profile import Config, read_config


def read(folder: Path, text: str | bytes, **others: str) -> Config:
    """The configuration of main.ini, with other files next to it, given by their names without suffix."""
    for name, content in others.items():
        (folder / f"{name}.ini").write_text(content)
    main = folder / "main.ini"
    main.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_config(main)


def values(config: Config) -> dict[str, dict[str, str]]:
    return {name: {o.name: o.value for o in s.options.values()} for name, s in config.sections.items()}


def said(config: Config) -> list[str]:
    """The problems without their folder: "main.ini:3: warning: ..."."""
    folder = str(Path(config.files[0]).parent)
    return [str(p).replace(folder + os.sep, "").replace(folder, ".") for p in config.problems]
