"""Cameras in the configurations of VINS-Fusion and ORB-SLAM3, in the terms of Kalibr."""

from collections.abc import Mapping
from typing import Any

from world.optics.camera_model import CalibrationError

Values = Mapping[str, Any]
PINHOLE, KANNALA_BRANDT, MEI = "pinhole", "kannala_brandt", "mei"


def kalibr_terms(values: Values, camera: str = "") -> dict[str, Any] | None:
    """A camera of camodocal (VINS-Fusion) or ORB-SLAM3 as in a camchain; None for another file.

    `camera` is Camera1 (default) or Camera2 of ORB-SLAM3. Raises CalibrationError with the field, or the model that is
    not supported.
    """
    if "model_type" in values:
        return _camodocal(values)
    return _orb_slam(values, camera) if "Camera.type" in values else None


def _camodocal(values: Values) -> dict[str, Any]:
    kind = str(values["model_type"]).lower()
    if kind not in (PINHOLE, KANNALA_BRANDT, MEI):
        known = "PINHOLE, KANNALA_BRANDT and MEI are"
        raise CalibrationError(f"model_type {values['model_type']} is not supported; {known}")
    plane: Any = values.get("projection_parameters")
    bent: Any = values.get("distortion_parameters")
    size = [_number(values, "image_width"), _number(values, "image_height")]
    if kind == KANNALA_BRANDT:
        coefficients = [_number(plane, name, "projection_parameters") for name in ("k2", "k3", "k4", "k5")]
        return _entry(plane, ("mu", "mv", "u0", "v0"), "projection_parameters.", "equidistant", coefficients, size)
    coefficients = [_number(bent, name, "distortion_parameters") for name in ("k1", "k2", "p1", "p2")]
    if kind == MEI:
        found = _entry(plane, ("gamma1", "gamma2", "u0", "v0"), "projection_parameters.", "radtan", coefficients, size)
        xi = _number(values.get("mirror_parameters"), "xi", "mirror_parameters")
        return {**found, "camera_model": "omni", "intrinsics": [xi, *found["intrinsics"]]}
    return _entry(plane, ("fx", "fy", "cx", "cy"), "projection_parameters.", "radtan", coefficients, size)


def _orb_slam(values: Values, camera: str) -> dict[str, Any]:
    if camera not in ("", "Camera1", "Camera2"):
        raise CalibrationError(f"no camera {camera}; ORB-SLAM3 has Camera1 and Camera2")
    kind = str(values["Camera.type"]).lower()
    prefix = f"{camera or 'Camera1'}."
    if f"{prefix}fx" not in values and not camera:
        prefix = "Camera."  # of versions before 1.0
    size = [_number(values, "Camera.width"), _number(values, "Camera.height")]
    if kind not in ("pinhole", "kannalabrandt8", "rectified"):
        raise CalibrationError(f"Camera.type {values['Camera.type']} is not supported; PinHole, KannalaBrandt8 are")
    names = ("k1", "k2", "k3", "k4") if kind == "kannalabrandt8" else ("k1", "k2", "p1", "p2", "k3")
    # ORB-SLAM3 itself takes what is not written as 0 in a lens of Brown and Conrady.
    coefficients = [_number(values, f"{prefix}{name}", default=0.0) for name in names]
    model = "equidistant" if kind == "kannalabrandt8" else "radtan"
    plane = [f"{prefix}{name}" for name in ("fx", "fy", "cx", "cy")]
    return _entry(values, plane, "", model, coefficients, size)


def _entry(
    values: Any, names: Any, where: str, model: str, coefficients: list[float], size: list[float]
) -> dict[str, Any]:
    return {
        "camera_model": "pinhole",
        "intrinsics": [_number(values, name, where.rstrip(".")) for name in names],
        "distortion_model": model,
        "distortion_coeffs": coefficients,
        "resolution": size,
    }


def _number(values: Any, name: str, where: str = "", default: float | None = None) -> float:
    named = f"{where}.{name}" if where else name
    found = values.get(name, default) if isinstance(values, dict) else None  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
    if found is None:
        raise CalibrationError(f"{named} is missing")
    try:
        if isinstance(found, int | float) and not isinstance(found, bool):
            return float(found)
    except OverflowError:
        found = "too large"
    raise CalibrationError(f"{named} is no number: {found!r}")
