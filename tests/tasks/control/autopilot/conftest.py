"""Vehicles for these tests, which are stopped at their end."""

import pytest

from tests.tasks.control.autopilot.bodies import Body


@pytest.fixture
def body(request, tmp_path):
    made = []

    def make(*arguments, **options):
        made.append(Body(*arguments[:1], tmp_path, *arguments[1:], **options))
        return made[-1]

    yield make
    for one in made:
        one.close()
