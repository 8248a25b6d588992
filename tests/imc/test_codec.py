"""Packets of every message: there and back, and the header around them."""

import pytest

import imc
from imc.messages import BY_ID


@pytest.mark.parametrize("cls", BY_ID.values(), ids=lambda cls: cls.__name__)
def test_default_message_returns(cls: type[imc.Message]) -> None:
    message = cls(timestamp=1.5, src=1, src_ent=2, dst=3, dst_ent=4)
    for order in ("little", "big"):
        assert imc.decode(imc.encode(message, order)) == message


def test_encode_as_writes_another_header() -> None:
    message = imc.EntityState(state=imc.EntityState.State.NORMAL, description="fine")
    packet = imc.encode_as(message, 2.5, 30, 7, 31, 8)
    assert imc.decode(packet) == message.replace(timestamp=2.5, src=30, src_ent=7, dst=31, dst_ent=8)
    assert imc.header(packet) == (1, len(packet) - 22, 2.5, 30, 7, 31, 8)
    assert imc.with_header(packet, timestamp=-1.0, src=0xFFFF, src_ent=0xFF, dst=0xFFFF, dst_ent=0xFF) == imc.encode(
        message
    )


def test_unknown_id_is_kept() -> None:
    packet = imc.encode(imc.Unknown(id=64000, payload=b"abc", src=30))
    message = imc.decode(packet)
    assert isinstance(message, imc.Unknown)
    assert (message.id, message.payload, message.src) == (64000, b"abc", 30)
    assert imc.encode(message) == packet


def test_changed_byte_is_refused() -> None:
    packet = bytearray(imc.encode(imc.Heartbeat()))
    packet[7] ^= 1
    with pytest.raises(imc.DecodeError, match="wrong CRC"):
        imc.decode(bytes(packet))
