"""A digest of how a computer computes: other processors and libraries round otherwise in the last bit."""

import hashlib
import math
import platform
from typing import Any

import numpy as np

UNARY = ("sin", "cos", "tan", "arcsin", "arccos", "arctan", "exp", "log", "sqrt", "tanh")
SIZES = (3, 4, 6, 9, 15, 33)


def compute_float_fingerprint() -> str:
    """SHA-256 of functions, sums, products of matrices, solutions and random numbers, of NumPy and of the C library.

    It is the same on computers that compute alike, and almost surely another one where a run might go otherwise.
    """
    made = hashlib.sha256(platform.machine().encode())
    small = np.linspace(-1.0, 1.0, 4001)
    numbers = np.random.default_rng(7).normal(size=(4, 4001))
    for name in UNARY:
        arguments = np.abs(small) if name in ("log", "sqrt") else small
        with np.errstate(divide="ignore"):
            made.update(getattr(np, name)(arguments).tobytes())
        scalar = getattr(math, name.replace("arc", "a"))
        made.update(np.array([scalar(x) for x in arguments[np.nonzero(arguments)].tolist()[::7]]).tobytes())
    large = np.linspace(-1e3, 1e3, 4001)
    arrays: list[Any] = [
        np.sin(large),
        np.cos(large),
        np.arctan2(*numbers[:2]),
        np.hypot(*numbers[2:]),
        np.abs(small) ** 3.7,
    ]
    arrays += [np.array([numbers.sum(), numbers.mean(axis=1).sum(), np.linalg.norm(numbers)])]
    for size in SIZES:
        square = numbers.ravel()[: size * size].reshape(size, size)
        other = square @ square.T + np.eye(size)
        arrays += [square @ square, square @ square[0], other, np.linalg.inv(other), np.linalg.cholesky(other)]
        arrays.append(np.linalg.solve(other, square[0]))
    for array in arrays:
        made.update(array.tobytes())
    return made.hexdigest()
