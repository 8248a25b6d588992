"""Desks with vehicles that are not there."""

import math

import pytest

from tests.mavlink.vehicle.desk import Desk


@pytest.fixture(scope="session")
def open_desk():
    """Makes a desk with a flavor and a type of vehicle."""
    return Desk


@pytest.fixture
def desk():
    return Desk()


@pytest.fixture
def afloat(desk):
    desk.locate(lat=math.radians(40.1), lon=math.radians(-8.6))
    return desk
