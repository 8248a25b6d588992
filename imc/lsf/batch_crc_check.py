"""Checks the CRCs of many overlapping parts of a buffer, in time proportional to the buffer, not to the parts."""

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

GENERATOR = 0xA001  # x¹⁶ + x¹⁵ + x² + 1, reflected
PERIOD = 32767  # of the powers of x modulo the generator, which is (x + 1) (x¹⁵ + x + 1)


def valid_crcs(
    data: bytes, starts: "NDArray[np.int64]", ends: "NDArray[np.int64]", big: "NDArray[np.bool_]"
) -> "NDArray[np.bool_]":
    """Mask of the parts of `data` that are packets and end with their CRC; `big`: it is stored big endian.

    A right CRC makes the remainder of the whole part zero. CRC-16/ARC is a remainder of polynomials over GF(2), so the
    remainder of a part follows from those of two prefixes of the buffer: up to its start, and up to its end. Each is
    divided by x to the power of its length (x and the generator have no common factor). Then the remainder of the part
    is zero exactly if the two are equal.
    """
    import numpy as np

    # sums[n]: the divided remainder of the first n bytes. Dividing makes the weight of a byte depend only on its place
    # in the buffer, so one running XOR gives all prefixes.
    octets = np.frombuffer(data, np.uint8)
    sums = np.zeros(octets.size + 1, np.uint16)
    for begin in range(0, octets.size, PERIOD):
        part = octets[begin : begin + PERIOD]
        sums[begin + 1 : begin + 1 + part.size] = _weighed(part, slice(part.size))
    np.bitwise_xor.accumulate(sums, out=sums)
    found = sums[ends] == sums[starts]
    if big.any():
        # A big-endian CRC has its two bytes swapped: end the sum before them, and add them in the other order.
        starts, behind = starts[big], ends[big] - 2
        swapped = _weighed(octets[behind + 1], behind % PERIOD) ^ _weighed(octets[behind], (behind + 1) % PERIOD)
        found[big] = sums[behind] ^ swapped == sums[starts]
    return found


def _weighed(octets: "NDArray[np.uint8]", places: Any) -> "NDArray[np.uint16]":
    """Contribution of bytes to the divided remainder at these places in a period; shape (n,)."""
    import numpy as np

    total = np.zeros(octets.size, np.uint16)
    for bit, weights in enumerate(_weights()):
        total ^= weights[places] * (octets >> np.uint8(bit) & np.uint8(1))
    return total


@cache
def _weights() -> "NDArray[np.uint16]":
    """1 / x to the power of a bit's number, modulo the generator; shape (8, PERIOD): bit in a byte, byte."""
    import numpy as np

    powers, value = [0] * PERIOD, 1
    for number in range(PERIOD):
        powers[number] = value
        value = ((value ^ GENERATOR) << 1 | 1) if value & 0x8000 else value << 1
    return np.array(powers, np.uint16)[(8 * np.arange(PERIOD) + np.arange(8)[:, None]) % PERIOD]
