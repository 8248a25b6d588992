"""A camera that shows where points are in its picture, without the picture."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from world.notebook.quadrotor import QuadrotorState, Rot_v_to_b, triple
from world.notebook.sensor import Pace, Sensor
from world.optics import CameraModel, PinholeModel

NEAR = 1e-6  # m, closer to the camera's plane nothing is seen
ROUNDING = 1e-6  # by which a rotation may miss being one

Points = NDArray[np.float64]
Tick = Callable[[bool, int, float], Any]


class Feature(Protocol):
    """Moves points, and returns them (3, N; m, north, east, down), or None for none."""

    def tick(self, capture: bool, n: int, Ts: float) -> Any: ...


class Camera(Sensor):
    """Measures the pixels of points that its features return.

    `fps` pictures a second of `size` (px) span `hfovd` degrees horizontally; `pxnoise` is the standard deviation of
    white noise (px); `tick(capture, n, Ts)` is a first feature. `K` is the matrix of the camera; pixel (i, j) covers
    [i, i+1) x [j, j+1). `optics` is another lens in its place.

    In physical fidelity, what is behind the camera, outside the picture or not finite is left out, and `visible` (N,)
    marks the points that are there; the translation counts, pictures come `fps` times a second, and `capture` returns
    features whether one is taken now. The original takes one in every round(1 / (fps Ts)) steps, ignores the
    translation, mirrors what is behind it, and has no borders. `fresh` is whether the last reading was new.
    Raises ValueError.
    """

    def __init__(
        self,
        fps: float = 30,
        size: Sequence[int] = (800, 600),
        hfovd: float = 33.99,
        pxnoise: float = 0,
        tick: Tick | None = None,
        *,
        name: str = "Camera",
        fidelity: str = "physical",
        optics: CameraModel | None = None,
        seed: int = 0,
    ):
        super().__init__(name, fidelity, seed)
        if not 0.0 < hfovd < 180.0:
            raise ValueError(f"a field of view of {hfovd:g}° is not between 0° and 180°")
        if len(size) != 2:
            raise ValueError(f"a size of {size} is not width and height")
        if not pxnoise >= 0.0:
            raise ValueError(f"a standard deviation of {pxnoise:g} px is negative")
        if optics is not None and fidelity == "original":
            raise ValueError("the original camera has no optics but its field of view")
        self.fns: list[Tick] = [tick] if tick else []
        self.fps: float = fps
        self.size: tuple[int, ...] = tuple(size)
        self.hfov: float = np.radians(hfovd)
        self.pxnoise_std: float = pxnoise
        width, height = self.size
        f = (width / 2) / np.tan(self.hfov / 2)
        self.f_px: float = f
        self.optics: CameraModel | PinholeModel = optics or PinholeModel(width, height, f, f, width / 2, height / 2)
        at = self.optics
        self.K = np.array([[at.fx, 0, at.cx], [0, at.fy, at.cy], [0, 0, 1]])
        self.meas: Points | None = None
        self.visible: NDArray[np.bool_] = np.zeros(0, np.bool_)
        self.fresh: bool = False
        self.ticks: int = 0
        self._pace = Pace(fps, "fps")
        self.set_transformation()

    def set_transformation(self, t: Any = None, R: Any = None) -> None:
        """Mount the camera at `t` (m, body), with `R` (3, 3) from the body to its frame: x right, y down, z ahead."""
        self.t: NDArray[np.float64] = np.zeros((3, 1)) if t is None else np.array([triple(t, "t")]).T
        self.R = np.eye(3) if R is None else np.asarray(R, np.float64)
        square = self.R.shape == (3, 3) and np.allclose(self.R @ self.R.T, np.eye(3), rtol=0.0, atol=ROUNDING)
        if not square or np.linalg.det(self.R) < 0.0:  # a mirror
            raise ValueError("R is not a rotation")

    def register_feature(self, feature: Feature) -> None:
        """Show the points of a feature."""
        self.fns += [feature.tick]

    def read(self, quad: QuadrotorState, n: int, Ts: float) -> Points | None:
        """The pixels (2, N) of the last picture; None if no feature returns points now."""
        original = self.fidelity == "original"
        due = original or self._pace.due(n, Ts)
        found = [np.asarray(points, np.float64) for fn in self.fns if (points := fn(due, n, Ts)) is not None]
        if wrong := next((points.shape for points in found if points.ndim != 2 or len(points) != 3), None):
            raise ValueError(f"a feature has points of shape {wrong} instead of (3, N)")
        self.fresh = False
        if not found:
            return None
        if original:
            due = self.ticks % max(1, round(1 / (self.fps * Ts))) == 0
        if due:
            self.meas, self.fresh = self._project(quad, np.hstack(found)), True
        self.ticks += 1
        return self.meas

    def _project(self, quad: QuadrotorState, inertial: Points) -> Points:
        original = self.fidelity == "original"
        body = Rot_v_to_b(*triple(quad.Phi, "Phi")) @ (inertial - np.array([triple(quad.r, "r")]).T)
        p = self.R @ (body if original else body - self.t)
        noise = self.pxnoise_std * self.random.standard_normal((2, p.shape[1]))
        if original:
            homogeneous = self.K @ p
            self.visible = np.ones(p.shape[1], np.bool_)
            with np.errstate(divide="ignore", invalid="ignore"):
                return homogeneous[:2] / homogeneous[2] + noise
        pixels, seen = self.optics.project(p.T)
        self.visible = seen & (np.linalg.norm(p, axis=0) > NEAR)
        return (pixels.T + noise)[:, self.visible]
