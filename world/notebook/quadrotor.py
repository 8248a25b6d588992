"""State of a quadrotor for quadsim's sensors: its state, and rotations from the world to its body."""

import math
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector, rotation

Column = NDArray[np.float64]
"""Three numbers, (3, 1)."""


class QuadrotorState(Protocol):
    """An object with a place `r` (m, north, east, down), velocity `v` (m/s, body) and angles `Phi` (rad), each (3, 1).

    Inertial sensors also need `omega`, the rates p, q, r (rad/s).
    """

    @property
    def r(self) -> Any: ...
    @property
    def v(self) -> Any: ...
    @property
    def Phi(self) -> Any: ...


def zeros() -> Column:
    return np.zeros((3, 1))


@dataclass
class Quadrotor:
    """A state to show to sensors, in the place of quadsim's model of a quadrotor; see QuadrotorState."""

    r: Column = field(default_factory=zeros)
    v: Column = field(default_factory=zeros)
    Phi: Column = field(default_factory=zeros)
    omega: Column = field(default_factory=zeros)

    @classmethod
    def of(cls, state: Any) -> "Quadrotor":
        """Quadrotor with the state of an EstimatedState or SimulatedState of IMC; `v` is (u, v, w) of that state."""
        numbers = (state.x, state.y, state.z), (state.u, state.v, state.w), (state.phi, state.theta, state.psi)
        return cls(*(np.array([row], np.float64).T for row in (*numbers, (state.p, state.q, state.r))))


def triple(value: Any, name: str) -> Vector:
    """Three numbers of any shape. Raises ValueError with the name of what has another number of them."""
    numbers = np.asarray(value, np.float64).ravel().tolist()
    if len(numbers) != 3:
        raise ValueError(f"{name} has {len(numbers)} numbers instead of three")
    return numbers[0], numbers[1], numbers[2]


def Rot_v_to_b(phi: float, theta: float, psi: float) -> NDArray[np.float64]:
    """(3, 3) from north, east, down to the body, for angles in rad: the transpose of Rz(psi) Ry(theta) Rx(phi)."""
    return np.array(rotation(phi, theta, psi)).T


def rot3d(phi: float, theta: float, psi: float) -> NDArray[np.float64]:
    """(3, 3) as Rot_v_to_b, for angles in degrees."""
    return Rot_v_to_b(*map(math.radians, (phi, theta, psi)))
