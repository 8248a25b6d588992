"""What an operator can do about an entity, by its own words."""

import pytest

import imc
from shoal.console.health.health_advice import GENERAL, STARTING, advice

State = imc.EntityState.State


@pytest.mark.parametrize(
    ("description", "words"),
    [
        ("no report for 5 s", "silent"),
        ("leak detected", "recover"),
        ("fuel is running low", "battery"),
        ("the disk of the logs is full: 3 MiB left", "Download old logs"),
        ("GPS fixes jump", "antenna"),
        ("violates maximum depth", "limit"),
        ("the servos are stuck", "weed"),
        ("EstimatedState is missing", "table of rates"),
        ("no DesiredControl for 2 s", "table of rates"),
        ("attitude drifts away from the turn rates", "calibrate"),
        ("ZeroDivisionError: float division by zero", "traceback"),
        ("tcp/10.0.0.1:4001: Connection refused", "cable"),
    ],
)
def test_usual_troubles_have_advice_of_their_own(description, words):
    assert words in advice(State.ERROR, description)


def test_every_entity_that_is_not_in_order_has_advice():
    assert advice(State.NORMAL, "leak detected") == ""
    assert advice(State.BOOT, "") == STARTING
    assert advice(State.FAULT, "\udcff<b>") == advice(99, "") == GENERAL
