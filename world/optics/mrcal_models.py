"""Camera models of mrcal (files .cameramodel), in the terms of OpenCV and Kalibr."""

import ast
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from world.optics.camera_model import CalibrationError

LARGEST_FILE = 1 << 26  # with the data that mrcal optimized, which are not read
LARGEST_MODEL = 1 << 20
HEAD = re.compile(r"(?:\s*#[^\n]*\n)*\s*\{")
OPTIMIZATION_INPUTS = re.compile(r"""\bb(?:'[^']*'|"[^"]*")""")  # base 85, which has neither quotes nor backslashes
PREFIX = "LENSMODEL_"
COEFFICIENTS: Mapping[str, int] = MappingProxyType(
    {"PINHOLE": 0, "OPENCV4": 4, "OPENCV5": 5, "OPENCV8": 8, "OPENCV12": 12, "STEREOGRAPHIC": 0}
)

Values = Mapping[str, Any]


def is_cameramodel(text: str) -> bool:
    return HEAD.match(text) is not None and "lensmodel" in text


def parse_cameramodel(text: str) -> dict[str, Any]:
    """Read a camera from a .cameramodel, in OpenCV's terms; a stereographic one as in a camchain of Kalibr.

    Its pixels count as OpenCV's. Raises CalibrationError, for a lens that has no counterpart with its name.
    """
    bare = OPTIMIZATION_INPUTS.sub("b''", text)
    if len(bare) > LARGEST_MODEL:
        raise CalibrationError("too large for a camera model of mrcal")
    try:
        values = ast.literal_eval(bare)
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
        raise CalibrationError(f"no camera model of mrcal: {' '.join(str(error).split())}") from None
    if not isinstance(values, dict):
        raise CalibrationError("no camera model of mrcal: no named values")
    lens, numbers, size = (_field(values, name) for name in ("lensmodel", "intrinsics", "imagersize"))  # pyright: ignore[reportUnknownArgumentType]
    kind = str(lens).removeprefix(PREFIX)
    if kind not in COEFFICIENTS:
        known = ", ".join(f"{PREFIX}{name}" for name in COEFFICIENTS)
        raise CalibrationError(f"lensmodel {lens} is not supported; {known} are")
    count = 4 + COEFFICIENTS[kind]
    if not isinstance(numbers, list | tuple) or len(numbers) != count:  # pyright: ignore[reportUnknownArgumentType]
        raise CalibrationError(f"intrinsics of {lens} are not {count} numbers")
    if not isinstance(size, list | tuple) or len(size) != 2:  # pyright: ignore[reportUnknownArgumentType]
        raise CalibrationError("imagersize is not two numbers of pixels")
    fx, fy, cx, cy, *rest = numbers  # pyright: ignore[reportUnknownVariableType]
    if kind == "STEREOGRAPHIC":
        return {"camera_model": "eucm", "intrinsics": [0.5, 1.0, fx, fy, cx, cy], "resolution": list(size)}  # pyright: ignore[reportUnknownArgumentType]
    return {
        "image_width": size[0],
        "image_height": size[1],
        "camera_matrix": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "distortion_model": "rational_polynomial",
        "distortion_coefficients": rest,
    }


def _field(values: Mapping[str, Any], name: str) -> Any:
    if name not in values:
        raise CalibrationError(f"{name} is missing")
    return values[name]
