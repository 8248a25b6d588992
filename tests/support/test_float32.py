"""The shortest number for 32 bits."""

import struct

import pytest

from support.float32 import shortest_float32


@pytest.mark.parametrize("value", [0.1, 1.2, 1e-7, 3.5e12, -0.3])
def test_a_number_of_32_bits_gives_the_one_that_was_written(value):
    sent = struct.unpack("<f", struct.pack("<f", value))[0]
    assert sent != value
    assert shortest_float32(sent) == value
