"""The port of `shoal console` beside a vehicle whose own page has the usual one."""

import socket
import subprocess
import sys
from contextlib import suppress

from tests.shoal.console.operator_page import OperatorPage


def test_a_port_that_is_taken_is_passed_over():
    command = [sys.executable, "-m", "shoal.cli", "console"]
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with suppress(OSError):  # a vehicle on this computer has it
            taken.bind(("127.0.0.1", 8080))
            taken.listen()
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
            try:
                page = OperatorPage(process)
                assert page.port != 8080
                page.log_in()
                assert page.get("/api/me")["user"] == "local"
            finally:
                process.terminate()
