"""The one table of how packets are laid out, against packets as they are."""

import struct

import numpy as np

import imc
from imc import layout


def test_the_header_lies_where_the_table_says():
    message = imc.EntityState(timestamp=1.5, src=0x1A2B, src_ent=7, dst=0x3C4D, dst_ent=9, description="x")
    packet = imc.encode(message)
    row = np.frombuffer(packet, np.dtype(layout.numpy_columns(layout.HEADER_FIELDS)), 1)[0]
    assert (row["sync"], row["id"], row["size"]) == (
        layout.SYNC,
        imc.EntityState.ID,
        len(packet) - layout.SMALLEST_PACKET,
    )
    assert [row[name] for name in layout.ADDRESS_FIELDS] == [1.5, 0x1A2B, 7, 0x3C4D, 9]
    for name, offset in layout.OFFSETS.items():
        assert struct.unpack_from("<" + layout.HEADER_FIELDS[name], packet, offset)[0] == row[name]


def test_every_type_of_a_field_has_a_letter_and_every_number_a_numpy_type():
    used = {field.type for message in imc.builtin().messages for field in message.fields}
    assert used <= set(layout.WIRE_CODES)
    for kind in layout.NUMBERS:
        code = layout.WIRE_CODES[kind]
        assert np.dtype("<" + layout.NUMPY[code]).itemsize == struct.calcsize("<" + code)
    assert {layout.WIRE_CODES[kind] for kind in ("plaintext", "rawdata", "message", "message-list")} == layout.VARIABLE
