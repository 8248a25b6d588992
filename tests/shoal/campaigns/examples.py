"""Scenarios of a shipped vehicle, and tasks of a user that break them."""

NAME = "lauv-noptilus-1"
SHALLOW = "always: EstimatedState.depth < 20 m"  # it holds
FLAT = "always: EstimatedState.depth < 1 m"  # the vehicle dives to 2.5 m in 20 s


def scenario(expectation: str = SHALLOW, *, profile: str = NAME, seed: int = 0, parameters: str = "{}") -> str:
    """A run of 20 s of the light vehicle."""
    return (
        f"seed: {seed}\n"
        f"vehicle: {{profile: {profile}, modes: [Kinematic], parameters: {parameters}}}\n"
        "limit: 20 s\n"
        "expect:\n"
        f"  - {{name: depth, {expectation}}}\n"
    )


TROUBLE = '''"""A task of a user that does what no task may."""

import os
import sys
import time

import imc
from runtime import Task, param, periodic


class Trouble(Task):
    """Makes trouble after five seconds."""

    how: str = param("", "", "How.")

    @periodic(5.0)
    def act(self) -> None:
        getattr(self, self.how)()

    def die(self) -> None:
        os.kill(os.getpid(), 9)

    def hang(self) -> None:
        while True:
            time.sleep(0.1)

    def fail(self) -> None:
        raise ZeroDivisionError("of a kind")

    def differ(self) -> None:
        noise = int.from_bytes(os.urandom(4)) / 2.0**32
        self.publish(imc.RelativeHumidity(value=noise))

    def exhaust(self) -> None:
        self.exhaust()
'''


def trouble(how: str, expectation: str = SHALLOW) -> str:
    """A scenario with the task in trouble.py."""
    return scenario(expectation, parameters=f"{{trouble.Trouble: {{Enabled: Always, How: {how}}}}}")
