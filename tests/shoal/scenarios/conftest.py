"""Writes scenario files of shipped profiles, and runs them."""

import textwrap

import pytest

from shoal.scenarios import load_document, run

DIVE = """
vehicle:
  profile: lauv-noptilus-1
  plan:
    plan: dive
    origin: 41.185°, -8.7062°
    speed: 1.2 m/s
    depth: 3 m
    maneuvers:
      - goto: {north: 30, east: 10}
"""
SHORT = """
vehicle: {profile: otter}
limit: 3 s
"""


@pytest.fixture
def document(tmp_path):
    """Makes the document of a text; `begin` is put before it."""

    def make(text="", begin=SHORT, name="trial"):
        path = tmp_path / f"{name}.scenario.yaml"
        path.write_text(textwrap.dedent(begin) + textwrap.dedent(text))
        return load_document(path)

    return make


@pytest.fixture
def play(document):
    """Runs the scenario of a text."""

    def play(text="", begin=SHORT, values=None, **options):
        return run(document(text, begin).scenario(values), **options)

    return play
