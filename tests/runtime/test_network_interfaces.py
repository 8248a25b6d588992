"""Names and addresses of this computer itself."""

import pytest

from imc.discovery import Endpoint
from runtime.network_interfaces import is_loopback_host
from shoal.network import UDPLink


@pytest.mark.parametrize(
    ("name", "loopback"),
    [("127.0.0.1", True), ("127.0.1.1", True), ("localhost", True), ("::1", True), ("10.0.0.7", False), ("", False)],
)
def test_a_host_is_this_computer_by_name_and_by_address(name, loopback):
    assert is_loopback_host(name) is loopback


@pytest.mark.parametrize(("name", "far"), [("localhost", False), ("127.0.0.1", False), ("10.0.0.7", True)])
def test_a_console_waits_longer_for_answers_of_other_computers_only(name, far):
    assert UDPLink([Endpoint(name, 6002)]).is_far is far
