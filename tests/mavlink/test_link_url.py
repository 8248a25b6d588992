"""Links as written in a profile."""

import pytest

from mavlink import parse_link_url


@pytest.mark.parametrize(
    ("text", "scheme", "address", "flavor"),
    [
        (" udpin:localhost:14551:px4 ", "udpin", ("127.0.0.1", 14551), "px4"),
        ("udpout:192.168.0.7:14550:generic", "udpout", ("192.168.0.7", 14550), "generic"),
        ("udpin://", "udpin", ("127.0.0.1", 14550), "ardupilot"),
        ("udpin://0.0.0.0:14551?flavor=px4", "udpin", ("0.0.0.0", 14551), "px4"),
        ("udpin://[::1]:14551?flavor=px4", "udpin", ("::1", 14551), "px4"),
        ("udpout://station.local", "udpout", ("station.local", 14550), "ardupilot"),
        ("udpout://[fe80::2%eth0]:14555", "udpout", ("fe80::2%eth0", 14555), "ardupilot"),
        ("udpbcast://192.168.0.255", "udpbcast", ("192.168.0.255", 14550), "ardupilot"),
        ("tcpin://", "tcpin", ("127.0.0.1", 5760), "ardupilot"),
        ("tcpin://:5761", "tcpin", ("127.0.0.1", 5761), "ardupilot"),
        ("tcpout://router-1:5760?flavor=px4&rates=normal", "tcpout", ("router-1", 5760), "px4"),
        ("serial:///dev/ttyUSB0", "serial", ("/dev/ttyUSB0", 0), "ardupilot"),
        ("serial:///dev/serial/by-id/a:b?flavor=px4&baud=921600", "serial", ("/dev/serial/by-id/a:b", 0), "px4"),
    ],
)
def test_link(text, scheme, address, flavor):
    url = parse_link_url(text)
    assert (url.scheme, url.address, url.flavor.name) == (scheme, address, flavor)


def test_a_link_at_another_port():
    for text in ("udpin:127.0.0.1:14551:px4", "tcpin://[::1]:14551?flavor=px4"):
        moved = parse_link_url(text).at_port(9)
        assert parse_link_url(f"{moved.text}?flavor=px4") == moved


def test_options():
    url = parse_link_url("serial:///dev/ttyUSB0?rates=low&key=/etc/shoal/mavlink.key&unsigned=accept&baud=9600")
    assert (url.low, url.key, url.accepts_unsigned, url.requires_signing) == (
        True,
        "/etc/shoal/mavlink.key",
        True,
        False,
    )
    assert (url.text, url.bytes_per_second) == ("serial:///dev/ttyUSB0", 200.0)
    plain = parse_link_url("serial:///dev/ttyUSB0")
    assert (plain.low, plain.key, plain.accepts_unsigned, plain.requires_signing) == (False, "", False, False)
    assert (plain.baud, plain.bytes_per_second) == (57600, 5760.0)
    assert parse_link_url("udpin://?key=~/key").requires_signing


@pytest.mark.parametrize(
    ("text", "local"),
    [
        ("udpin://", True),
        ("tcpin://[::1]", True),
        ("udpout://127.0.0.3", True),
        ("udpin://0.0.0.0", False),
        ("udpout://station", False),
        ("serial:///dev/ttyUSB0", False),
    ],
)
def test_links_that_others_can_reach(text, local):
    assert parse_link_url(text).is_local is local


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("nonsense", "not SCHEME://ADDRESS[:PORT]?flavor=FLAVOR, such as udpin://127.0.0.1:14551"),
        ("", "not SCHEME:"),
        ("udpout:127.0.0.1:14550", "not SCHEME://"),
        ("serial://", "not SCHEME://ADDRESS[:PORT]?flavor=FLAVOR, such as serial:///dev/ttyUSB0"),
        ("http://127.0.0.1", "'http' is not a scheme (known: udpin, udpout, udpbcast, tcpin, tcpout, serial)"),
        ("tcp:127.0.0.1:14550:px4", "'tcp' is not a scheme (did you mean 'tcpin'?)"),
        ("udpinn:127.0.0.1:14550:px4", "'udpinn' is not a scheme (did you mean 'udpin'?)"),
        ("tcpin:127.0.0.1:5760:px4", "not SCHEME://"),
        ("udpin:nowhere:14550:px4", "'nowhere' is not an IPv4 address, or an IPv6 address in brackets"),
        ("udpin://nowhere", "'nowhere' is not an IPv4 address, or an IPv6 address in brackets"),
        ("udpin://::1:14550", "is not a port"),
        ("udpbcast://[ff02::1]", "IPv6 has no broadcast addresses"),
        ("udpbcast://", "'' is not an IPv4 address"),
        ("udpout://", "'' is not an address or the name of a computer"),
        ("udpout://192.168.0.256", "'192.168.0.256' is not an address or the name of a computer"),
        ("udpout://a b", "'a b' is not an address or the name of a computer"),
        ("udpin:127.0.0.1:0:px4", "'0' is not a port"),
        ("udpin://127.0.0.1:65536", "'65536' is not a port"),
        ("udpin:127.0.0.1:x:px4", "'x' is not a port"),
        ("udpin://127.0.0.1:?flavor=px4", "'' is not a port"),
        ("udpin:127.0.0.1:14550:dune", "'dune' is not a flavor (known: ardupilot, px4, generic)"),
        ("udpin:127.0.0.1:14550:ardupilt", "'ardupilt' is not a flavor (did you mean 'ardupilot'?)"),
        ("udpin://?flavor=px5", "'px5' is not a flavor (did you mean 'px4'?)"),
        ("udpin://?flavuor=px4", "'flavuor' is not an option of this link (did you mean 'flavor'?)"),
        ("udpin://?baud=9600", "'baud' is not an option of this link"),
        ("udpin://?rates=lo", "'lo' is not a choice of 'rates' (did you mean 'low'?)"),
        ("udpin://?rates=low&rates=low", "'rates' is given twice"),
        ("udpin://?flavor", "'flavor' has no value"),
        ("serial:///dev/ttyUSB0?baud=fast", "'fast' is not a baud rate"),
        ("serial:///dev/ttyUSB0?baud=0", "'0' is not a baud rate"),
        ("udpin://?key=mavlink.key", "'key' is not a whole path, such as /etc/shoal/mavlink.key"),
        ("udpin://?unsigned=accept", "'unsigned' has no meaning without 'key'"),
    ],
)
def test_bad_links_say_why(text, reason):
    with pytest.raises(ValueError) as caught:
        parse_link_url(text)
    assert repr(text) in str(caught.value).replace("key=...", "key=mavlink.key")
    assert reason in str(caught.value)


def test_a_key_in_place_of_its_file_is_not_repeated():
    key = "0123456789abcdef" * 4
    with pytest.raises(ValueError, match="is the path of a file that holds the key") as caught:
        parse_link_url(f"udpin://?flavor=px4&key={key}")
    assert "0123" not in str(caught.value)


def test_the_british_flavour_works_and_is_reported_as_deprecated():
    old, new = parse_link_url("udpin://?flavour=px4"), parse_link_url("udpin://?flavor=px4")
    assert (old.flavor, new.deprecation) == (new.flavor, "")
    assert old.deprecation == "flavour is deprecated: write flavor"
    with pytest.raises(ValueError, match="'flavor' is given twice"):
        parse_link_url("udpin://?flavor=px4&flavour=px4")
