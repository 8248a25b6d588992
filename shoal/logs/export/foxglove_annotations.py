"""Foxglove's types for what is drawn on pictures and in the scene, in CDR (foxglove.dev/docs, names foxglove_msgs)."""

import struct
from collections.abc import Iterable, Sequence

from shoal.logs.export.cdr import SIZES, cdr_string
from shoal.logs.export.ros_standard_conversion import geometry_definitions
from shoal.logs.export.ros_types import STANDARD, RosType

Color = tuple[float, float, float, float]
YELLOW: Color = (1.0, 0.9, 0.0, 1.0)
NONE: Color = (0.0, 0.0, 0.0, 0.0)
SHADE: Color = (0.0, 0.0, 0.0, 0.5)
STEADY = (0.0, 0.0, 0.0, 1.0)  # quaternion x, y, z, w
BILLION = 1_000_000_000

_COMMON = {
    "foxglove_msgs/Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "foxglove_msgs/KeyValuePair": "string key\nstring value\n",
    "builtin_interfaces/Time": STANDARD["builtin_interfaces/Time"],
}
_STAMP = "builtin_interfaces/Time timestamp\n"
_PAIRS = "foxglove_msgs/KeyValuePair[] metadata\n"
_POSE = "geometry_msgs/Pose pose\n"
_SIZED = f"{_POSE}geometry_msgs/Vector3 size\n"
_COLOR = "foxglove_msgs/Color color\n"
_COLORS = f"{_COLOR}foxglove_msgs/Color[] colors\nuint32[] indices\n"

ANNOTATIONS = RosType(
    "foxglove_msgs/ImageAnnotations",
    f"{_STAMP}foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n"
    f"foxglove_msgs/TextAnnotation[] texts\n{_PAIRS}",
    dependencies={
        **_COMMON,
        "foxglove_msgs/Point2": "float64 x\nfloat64 y\n",
        "foxglove_msgs/CircleAnnotation": f"{_STAMP}foxglove_msgs/Point2 position\nfloat64 diameter\n"
        f"float64 thickness\nfoxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n{_PAIRS}",
        "foxglove_msgs/PointsAnnotation": f"{_STAMP}uint8 UNKNOWN=0\nuint8 POINTS=1\nuint8 LINE_LOOP=2\n"
        "uint8 LINE_STRIP=3\nuint8 LINE_LIST=4\nuint8 type\nfoxglove_msgs/Point2[] points\n"
        "foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\nfoxglove_msgs/Color fill_color\n"
        f"float64 thickness\n{_PAIRS}",
        "foxglove_msgs/TextAnnotation": f"{_STAMP}foxglove_msgs/Point2 position\nstring text\nfloat64 font_size\n"
        f"foxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color\n{_PAIRS}",
    },
)
SCENE = RosType(
    "foxglove_msgs/SceneUpdate",
    "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n",
    dependencies={
        **_COMMON,
        **geometry_definitions("Pose", "Point", "Quaternion", "Vector3"),
        "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec\n",
        "foxglove_msgs/SceneEntityDeletion": f"{_STAMP}uint8 MATCHING_ID=0\nuint8 ALL=1\nuint8 type\nstring id\n",
        "foxglove_msgs/SceneEntity": f"{_STAMP}string frame_id\nstring id\nbuiltin_interfaces/Duration lifetime\n"
        f"bool frame_locked\n{_PAIRS}foxglove_msgs/ArrowPrimitive[] arrows\nfoxglove_msgs/CubePrimitive[] cubes\n"
        "foxglove_msgs/SpherePrimitive[] spheres\nfoxglove_msgs/CylinderPrimitive[] cylinders\n"
        "foxglove_msgs/LinePrimitive[] lines\nfoxglove_msgs/TriangleListPrimitive[] triangles\n"
        "foxglove_msgs/TextPrimitive[] texts\nfoxglove_msgs/ModelPrimitive[] models\n",
        "foxglove_msgs/ArrowPrimitive": f"{_POSE}float64 shaft_length\nfloat64 shaft_diameter\nfloat64 head_length\n"
        f"float64 head_diameter\n{_COLOR}",
        "foxglove_msgs/CubePrimitive": _SIZED + _COLOR,
        "foxglove_msgs/SpherePrimitive": _SIZED + _COLOR,
        "foxglove_msgs/CylinderPrimitive": f"{_SIZED}float64 bottom_scale\nfloat64 top_scale\n{_COLOR}",
        "foxglove_msgs/LinePrimitive": f"uint8 LINE_STRIP=0\nuint8 LINE_LOOP=1\nuint8 LINE_LIST=2\nuint8 type\n{_POSE}"
        f"float64 thickness\nbool scale_invariant\ngeometry_msgs/Point[] points\n{_COLORS}",
        "foxglove_msgs/TriangleListPrimitive": f"{_POSE}geometry_msgs/Point[] points\n{_COLORS}",
        "foxglove_msgs/TextPrimitive": f"{_POSE}bool billboard\nfloat64 font_size\nbool scale_invariant\n{_COLOR}"
        "string text\n",
        "foxglove_msgs/ModelPrimitive": f"{_POSE}geometry_msgs/Vector3 scale\n{_COLOR}bool override_color\nstring url\n"
        "string media_type\nuint8[] data\n",
    },
)


class CdrBody(bytearray):
    """A message in CDR, behind its encapsulation: values are aligned as they are appended."""

    def append_number(self, code: str, *values: float) -> "CdrBody":
        """Append values with the letter of `struct`."""
        self += bytes(-len(self) % SIZES[code]) + struct.pack(f"<{len(values)}{code}", *values)
        return self

    def append_time(self, nanoseconds: int) -> "CdrBody":
        return self.append_number("I", *divmod(nanoseconds, BILLION))

    def append_text(self, words: str) -> "CdrBody":
        self.append_number("I")
        self += cdr_string(words.encode("utf-8", "replace"))
        return self


def image_annotations(time: int, marks: Sequence[tuple[float, float, float, str]]) -> CdrBody:
    """An ANNOTATIONS at a time (ns): circles at column and row, with a diameter (px), and a text beside each."""
    body = CdrBody().append_time(time).append_number("I", len(marks))
    for u, v, diameter, _ in marks:
        body.append_time(time).append_number("d", u, v, diameter, 2.0, *NONE, *YELLOW).append_number("I", 0)
    body.append_number("I", 0, len(marks))
    for u, v, diameter, words in marks:
        body.append_time(time).append_number("d", u + diameter / 2.0, v - diameter / 2.0).append_text(words)
        body.append_number("d", 14.0, *YELLOW, *SHADE).append_number("I", 0)
    return body.append_number("I", 0)


def scene_update(
    time: int, frame: str, lifetime: int, things: Iterable[tuple[str, tuple[float, float, float], float, str]]
) -> CdrBody:
    """A SCENE at a time, for so long (ns): balls by their ids, each at a place, with a diameter (m) and a text."""
    given = list(things)
    body = CdrBody().append_number("I", 0, len(given))
    for name, place, diameter, words in given:
        body.append_time(time).append_text(frame).append_text(name).append_time(lifetime).append_number("B", 0)
        body.append_number("I", 0, 0, 0, 1).append_number("d", *place, *STEADY, diameter, diameter, diameter, *YELLOW)
        body.append_number("I", 0, 0, 0, 1).append_number("d", *place[:2], place[2] + diameter, *STEADY).append_number(
            "B", 1
        )
        body.append_number("d", 14.0).append_number("B", 1).append_number("d", *YELLOW).append_text(
            words
        ).append_number("I", 0)
    return body
