"""Services of an Announce: built, read, and read from hostile text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from imc.discovery import (
    MOST_MESSAGES,
    MOST_SERVICES,
    PORTS,
    Endpoint,
    Service,
    Services,
    announce_targets,
    displayable_name,
    message_services,
)

DUNES = (  # what a real DUNE announces
    "dune://0.0.0.0/uid/1786412345;dune://0.0.0.0/version/2026.01.0;ftp://127.0.0.1:30021/;"
    "http://127.0.0.1:8080/dune;imc+info://0.0.0.0/version/5.4.31;imc+udp://127.0.0.1:6002/;"
    "imc+udp://127.0.0.1:6002/acoustic/operation/Acoustic%20Access%20Controller"
)


def test_dunes_own_services_are_read():
    services = Services.parse(DUNES)
    assert services.refused == 0
    assert (services.uid, services.version, services.imc_version) == ("1786412345", "2026.01.0", "5.4.31")
    assert services.endpoints("imc+udp") == (Endpoint("127.0.0.1", 6002),)
    assert services.endpoints("ftp") == (Endpoint("127.0.0.1", 30021),)
    assert services.endpoints("imc+tcp") == ()
    assert str(services) == DUNES


def test_services_are_built_with_their_slash_and_in_order():
    offered = [
        Service("imc+udp", "10.0.0.7", 6002),
        Service("ftp", "10.0.0.7", 30021),
        Service("imc+udp", "1.2.3.4", 1),
    ]
    services = Services.from_system_info(offered, uid=17, version="1.0", imc="5.4.31")
    assert str(services) == (
        "dune://0.0.0.0/uid/17;dune://0.0.0.0/version/1.0;ftp://10.0.0.7:30021/;"
        "imc+info://0.0.0.0/version/5.4.31;imc+udp://1.2.3.4:1/;imc+udp://10.0.0.7:6002/"
    )
    assert Services.parse(str(services)) == services
    assert Services.from_system_info().each == ()


def test_own_messages_are_announced_unless_they_are_many():
    assert Services.parse(DUNES).message_checksums is None
    for own in ({}, {30001: "58e17678"}, {number: "0a1b2c3d" for number in range(65535, 65535 - MOST_MESSAGES, -1)}):
        text = str(Services.from_system_info(message_services(own)))
        assert Services.parse(text).message_checksums == own
    assert message_services(dict.fromkeys(range(MOST_MESSAGES + 1), "0a1b2c3d")) == ()
    assert Services.parse("shoal+info://0.0.0.0/messages/x,-,7,+1-2,").message_checksums == {7: ""}


def test_the_address_that_sent_the_announce_comes_first():
    text = "imc+udp://10.0.0.7:6001/;imc+udp://192.168.1.7:6001/;imc+udp://127.0.0.1:6001/"
    assert Services.parse(text).endpoints("imc+udp", "192.168.1.7")[0] == Endpoint("192.168.1.7", 6001)
    assert [end.address for end in Services.parse(text).endpoints("imc+udp")] == [
        "10.0.0.7",
        "192.168.1.7",
        "127.0.0.1",
    ]


@pytest.mark.parametrize(
    "uri",
    [
        "imc+udp://0.0.0.0:6002/",
        "imc+udp://224.0.75.69:6002/",
        "imc+udp://255.255.255.255:6002/",
        "imc+udp://240.0.0.1:6002/",
        "imc+udp://10.0.0.7/",
        "imc+udp://vehicle.example:6002/",
        "imc+udp://010.0.0.7:6002/",
        "imc+udp://:6002/",
    ],
)
def test_what_reaches_no_single_computer_is_no_endpoint(uri):
    services = Services.parse(uri)
    assert (services.endpoints("imc+udp"), services.refused) == ((), 0)


@pytest.mark.parametrize(
    "uri",
    [
        "imc+udp://10.0.0.7:0/",
        "imc+udp://10.0.0.7:65536/",
        "imc+udp://10.0.0.7:999999/",
        "imc+udp://10.0.0.7:6002/\x1b[2J",
        "imc+udp:/10.0.0.7:6002/",
        "imc+udp://[::1]:6002/",
        "imc+udp://10.0.0.7:٣/",
        "\udcff://10.0.0.7:1/",
        "://10.0.0.7:1/",
        "imc+udp://10.0.0.7:6002/" + "x" * 1000,
    ],
)
def test_what_is_no_service_is_counted_and_loses_nothing_else(uri):
    services = Services.parse(f"imc+udp://10.0.0.8:6002/;{uri};ftp://10.0.0.8:21/")
    assert services.refused == 1
    assert [str(service) for service in services.each] == ["imc+udp://10.0.0.8:6002/", "ftp://10.0.0.8:21/"]
    with pytest.raises(ValueError, match=r"is not a (service|port)"):
        Service.parse(uri)


def test_a_service_without_its_slash_is_read():
    assert Services.parse("imc+udp://10.0.0.7:6002").endpoints("imc+udp") == (Endpoint("10.0.0.7", 6002),)


def test_services_are_bounded():
    services = Services.parse(";".join(f"imc+udp://10.0.0.7:{port}/" for port in range(1, 3000)))
    assert len(services.each) == MOST_SERVICES
    assert services.refused > 0


@pytest.mark.heavy
@given(st.text())
def test_no_text_breaks_the_services(text):
    services = Services.parse(text)
    services.endpoints("imc+udp", text)
    assert Services.parse(str(services)).each == services.each
    assert (services.uid + services.version + services.imc_version).isascii()


def test_names_are_readable():
    assert displayable_name(" lauv-\x1b[2Jnoptilus\udcff-1\n") == "lauv-[2Jnoptilus-1"
    assert len(displayable_name("x" * 100_000)) == 64
    assert displayable_name("x" * 64) == "x" * 64
    assert displayable_name("x" * 65) == "x" * 63 + "…"


def test_an_announce_goes_to_every_port():
    assert announce_targets(["127.0.0.1", "127.0.0.1"]) == tuple(Endpoint("127.0.0.1", port) for port in PORTS)
    assert announce_targets(["127.0.0.1"], [7]) == (Endpoint("127.0.0.1", 7),)
