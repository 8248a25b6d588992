"""Loads and calls a function that finds gliders in a picture, which may be the user's own."""

import importlib
import inspect
import math
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from runtime import ParameterError
from world.detection import ImageDetection

DetectionFunction = Callable[[NDArray[np.uint8]], Any]
MARKERS = 1 << 31


def load_detection_function(text: str) -> DetectionFunction:
    """The function that the text module:function names. Raises ParameterError."""
    module, _, name = text.partition(":")
    _refuse_library(text, module)
    try:
        found: Any = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
            if isinstance(found, ModuleType) or inspect.isroutine(found):
                _refuse_library(text, getattr(found, "__module__", None) or found.__name__)
    except ParameterError:
        raise
    except Exception as error:
        raise ParameterError("Function", f"{text!r} cannot be imported: {type(error).__name__}: {error}") from None
    if not callable(found):
        raise ParameterError("Function", f"{text!r} is no function")
    return found


def _refuse_library(text: str, module: str) -> None:
    """Reject Python's own modules, as sections do: a profile may be that of a stranger's log, and they do anything."""
    if module.partition(".")[0] in sys.stdlib_module_names:
        raise ParameterError("Function", f"{text!r} is of Python's own library, and finds no gliders")


def find_marks(find: DetectionFunction, image: NDArray[np.uint8]) -> tuple[list[ImageDetection], str]:
    """The marks in a picture, or what is wrong with the detector: it may be anybody's."""
    try:
        return [row if isinstance(row, ImageDetection) else _mark(*row) for row in find(image)], ""
    except Exception as error:
        return [], f"the detector failed: {type(error).__name__}: {error}"


def _mark(u: float, v: float, marker: int | None = None) -> ImageDetection:
    if not math.isfinite(float(u) + float(v)):
        raise ValueError(f"{u}, {v} is no pixel")
    if marker is not None and not 0 <= int(marker) < MARKERS:
        raise ValueError(f"{marker} is no number of a marker")
    return ImageDetection(float(u), float(v), marker=None if marker is None else int(marker))
