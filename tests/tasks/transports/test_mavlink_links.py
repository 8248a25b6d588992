"""Links as written in a profile."""

import pytest

from tasks.transports.mavlink_protocol.links import parse_route


def test_link():
    route = parse_route(" udpin:localhost:14551:px4 ")
    assert (route.listens, route.address, route.flavour.name) == (True, ("127.0.0.1", 14551), "px4")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("udpout:127.0.0.1:14550", "is not udpout:ADDRESS:PORT:FLAVOR"),
        ("tcp:127.0.0.1:14550:px4", "'tcp' is not a scheme; known: udpout, udpin"),
        ("udpinn:127.0.0.1:14550:px4", "'udpinn' is not a scheme; did you mean 'udpin'?"),
        ("udpin:nowhere:14550:px4", "'nowhere' is not an IPv4 address"),
        ("udpin:127.0.0.1:0:px4", "'0' is not a port"),
        ("udpin:127.0.0.1:65536:px4", "'65536' is not a port"),
        ("udpin:127.0.0.1:x:px4", "'x' is not a port"),
        ("udpin:127.0.0.1:14550:dune", "'dune' is not a flavor; known: ardupilot, px4, generic"),
        ("udpin:127.0.0.1:14550:ardupilt", "'ardupilt' is not a flavor; did you mean 'ardupilot'?"),
    ],
)
def test_bad_links_say_why(text, reason):
    with pytest.raises(ValueError) as caught:
        parse_route(text)
    assert text in str(caught.value)
    assert reason in str(caught.value)
