"""Where an autopilot is, as written in a profile."""

import pytest

from tasks.control.autopilot.autopilot_connection_url import parse_address


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("udpin://127.0.0.1:14560", ("udpin", "127.0.0.1", 14560, "", 57600)),
        ("udpout://[::1]:14550", ("udpout", "::1", 14550, "", 57600)),
        ("tcpout://sitl.local:5760", ("tcpout", "sitl.local", 5760, "", 57600)),
        ("serial:///dev/ttyAMA0?baud=921600", ("serial", "", 0, "/dev/ttyAMA0", 921600)),
    ],
)
def test_addresses(text, found):
    place = parse_address(text)
    assert (place.scheme, place.host, place.port, place.device, place.baud) == found


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("127.0.0.1:14560", "is not udpin://"),
        ("udpinn://127.0.0.1:1", "did you mean 'udpin'"),
        ("udpin://127.0.0.1", "a port from 1 to 65535"),
        ("udpin://127.0.0.1:99999", "a port from 1 to 65535"),
        ("serial://?baud=9600", "names no device"),
        ("serial:///dev/tty1?baud=fast", "'fast' is not a baud rate"),
        ("serial:///dev/tty1?speed=9600", "'speed' is not an option"),
    ],
)
def test_wrong_addresses_are_named(text, reason):
    with pytest.raises(ValueError, match="^.*" + reason.replace("?", "[?]")):
        parse_address(text)
