"""Parameters that users of the page change, and undo: once, and only while the change stands."""

import asyncio
import json
import math

import pytest
from starlette.requests import Request

from shoal.console.parameters.parameter_changes import MOST_CHANGES, ParameterChanges
from shoal.console.parameters.parameter_routes import ParameterRoutes
from shoal.console.vehicle_orders import OrderError
from shoal.network import ParameterDescription, Refused, is_same_value


class Parameters:
    """The parameters of one entity, each answer of which takes a while."""

    def __init__(self, **values):
        self.values = values

    async def get(self, entity):
        await asyncio.sleep(0.0)
        return dict(self.values)

    async def set(self, entity, values):
        await asyncio.sleep(0.0)
        if "bad" in values.values():
            raise Refused("'bad' is not a number")
        self.values.update(values)
        return dict(values)


class Vehicle:
    def __init__(self, **values):
        self.param = Parameters(**values)
        self.system = self
        self.name = "lauv"


async def undone(changes, user, vehicle, number):
    try:
        return await changes.undo(user, vehicle, number)
    except OrderError as error:
        return f"error: {error}"


def test_of_two_users_who_undo_a_change_one_does():
    async def run():
        vehicle, changes = Vehicle(Rate="1"), ParameterChanges()
        await changes.set("anna", vehicle, "GPS", "Rate", "3")
        await changes.set("anna", vehicle, "GPS", "Rate", "5")
        texts = await asyncio.gather(*(undone(changes, user, vehicle, 2) for user in ("anna", "ben")))
        return vehicle.param.values, texts, changes.view("lauv")

    values, texts, shown = asyncio.run(run())
    assert values == {"Rate": "3"}
    assert texts == ["GPS: Rate = 3, as before", "error: anna has undone this change already"]
    assert [(each["number"], each["undone"]) for each in shown] == [(2, "anna"), (1, "")]
    assert shown[0]["text"] == "GPS: Rate 3 → 5"


def test_a_change_that_stands_no_more_is_not_undone():
    async def run():
        vehicle, changes = Vehicle(Rate="1"), ParameterChanges()
        await changes.set("anna", vehicle, "GPS", "Rate", "3")
        vehicle.param.values["Rate"] = "7"  # somebody else, or a restart
        return vehicle.param.values, [await undone(changes, "anna", vehicle, each) for each in (1, 2, "1", None, [])]

    values, (changed, *unknown) = asyncio.run(run())
    assert values == {"Rate": "7"}
    assert changed == "error: GPS: Rate is 7 now, not 3: set the value instead"
    assert set(unknown) == {"error: this change is not known: set the value instead"}


def test_what_is_rejected_or_the_same_is_no_change_and_the_oldest_is_forgotten():
    async def run():
        vehicle, changes = Vehicle(Rate="1"), ParameterChanges()
        with pytest.raises(Refused):
            await changes.set("anna", vehicle, "GPS", "Rate", "bad")
        assert await changes.set("anna", vehicle, "GPS", "Rate", "1.0") == "GPS: Rate = 1.0"
        assert changes.view("lauv") == []
        for number in range(MOST_CHANGES + 5):
            await changes.set("anna", vehicle, "GPS", "Rate", str(number + 2))
        return await undone(changes, "anna", vehicle, 5), await undone(changes, "anna", vehicle, MOST_CHANGES + 5)

    oldest, newest = asyncio.run(run())
    assert oldest == "error: this change is not known: set the value instead"
    assert newest == f"GPS: Rate = {MOST_CHANGES + 5}, as before"


def test_the_log_book_gets_what_is_undone_and_not_what_the_page_claims():
    async def run():
        vehicle = Vehicle(Rate="1")
        routes = ParameterRoutes(lambda _: vehicle)
        await routes.carry_out("anna", vehicle, "set", {"entity": "GPS", "parameter": "Rate", "value": "3"})
        return [routes.complete("lauv", {"order": "undo", "change": number, "entity": "x"}) for number in (1, 2)]

    known, unknown = asyncio.run(run())
    assert (known["entity"], known["parameter"], known["value"]) == ("GPS", "Rate", "1")
    assert unknown == {"order": "undo", "change": 2, "entity": "x"}


@pytest.mark.parametrize(
    ("source", "words"),
    [("", "this vehicle gives values only"), ("Shoal", "those of Shoal's task of this name"), ("vehicle", "")],
)
def test_the_page_says_where_descriptions_come_from(monkeypatch, source, words):
    async def describe(vehicle, entities):
        return {"GPS": {"Rate": ParameterDescription("GPS", "Rate", "1", maximum=math.inf, source=source)}}

    monkeypatch.setattr("shoal.console.parameters.parameter_routes.describe_parameters", describe)
    request = Request({"type": "http", "query_string": b"vehicle=lauv&entity=GPS"})
    answer = json.loads(asyncio.run(ParameterRoutes(lambda _: Vehicle()).details(request)).body)
    assert words in answer["note"]
    assert bool(words) == bool(answer["note"])
    found = answer["values"]["Rate"]
    assert (found["value"], found["notes"], found["file"], found["origin"]) == ("1", [], None, [])


@pytest.mark.parametrize(
    ("text", "other", "same"),
    [
        ("2, 3", "2.0,3.0", True),
        ("", "", True),
        ("2", "2, 3", False),
        ("", "0", False),
        ("Always", "always", True),
        ("a", "b", False),
    ],
)
def test_a_value_differs_from_the_file_by_what_it_is_and_not_by_its_digits(text, other, same):
    assert is_same_value(text, other) is same
