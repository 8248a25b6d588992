"""Parameters: reading as in DUNE, limits, and the declaration as the only source."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from runtime.task import Parameter, param
from runtime.task.parameter_set import ParameterSet
from runtime.task.parameters import declared_parameters


class Pump:
    """All kinds of parameters."""

    flow: float = param(1.5, "l/s", "Flow.", minimum=0.0, maximum=10.0)
    count: int = param(3, "1", "Number of pumps.", minimum=1)
    name_plate: str = param("A", "", "Name.", choices=("A", "B"))
    enabled_now: bool = param(True, "", "On.", name="Pump - On", aliases=("On",))
    levels: list[float] = param([1.0], "m", "Levels.", size=(1, 3))


PARAMETERS = declared_parameters(Pump)


def test_names_types_and_units_come_from_the_declaration():
    assert [(p.name, p.xml_type_name, p.unit) for p in PARAMETERS.values()] == [
        ("Flow", "real", "l/s"),
        ("Count", "integer", "1"),
        ("Name Plate", "string", ""),
        ("Pump - On", "boolean", ""),
        ("Levels", "list:real", "m"),
    ]


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("Flow", "2", 2.0),
        ("Flow", "6.0f", 6.0),
        ("Flow", "1e-1", 0.1),
        ("Flow", "", 1.5),
        ("Count", "0x10", 16),
        ("Count", "010", 8),
        ("Count", "12 pumps", 12),
        ("Name Plate", "B", "B"),
        ("Name Plate", "b", "B"),
        ("Pump - On", "False", False),
        ("Pump - On", "1", True),
        ("Levels", "1, 2.5,3", [1.0, 2.5, 3.0]),
    ],
)
def test_texts_are_read_as_dune_reads_them(name, text, value):
    assert PARAMETERS[name].parse(text) == value


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("Flow", "11", r"11 is above the maximum \(expects real, 0 to 10, l/s\)"),
        ("Flow", "fast", "'fast' is not a number"),
        ("Flow", "nan", "nan is not a value"),
        ("Count", "0", "0 is below the minimum"),
        ("Count", "x", "is not an integer"),
        ("Name Plate", "C", "'C' is not one of A, B"),
        ("Pump - On", "yes", "is not true or false"),
        ("Levels", "1,2,3,4", "has 4 items"),
        ("Levels", "1,,2", "'' is not a number"),
    ],
)
def test_values_that_cannot_be_are_refused_with_the_reason(name, text, reason):
    with pytest.raises(ValueError, match=reason):
        PARAMETERS[name].parse(text)


def test_what_a_number_is_followed_by_is_known():
    assert PARAMETERS["Flow"].ignored_suffix("2.5 rad") == " rad"
    assert PARAMETERS["Flow"].ignored_suffix("2.5") == ""
    assert PARAMETERS["Name Plate"].ignored_suffix("2.5 rad") == ""


@given(st.floats(0.0, 10.0))
def test_a_formatted_number_reads_back_as_itself(value):
    assert PARAMETERS["Flow"].parse(PARAMETERS["Flow"].format(value)) == value


def test_push_and_pop_bring_back_what_is_not_global():
    class Owner:
        speed: float = param(1.0, "m/s", "Speed.", scope="plan")
        mass: float = param(2.0, "kg", "Mass.")

    owner = Owner()
    values = ParameterSet(owner, declared_parameters(Owner))
    values.restore({"Speed": 1.0, "Mass": 2.0})
    values.push()
    values.restore({"Speed": 5.0, "Mass": 6.0})
    assert values.pop()
    assert (owner.speed, owner.mass) == (1.0, 6.0)
    assert not values.pop()


def test_aliases_are_found():
    values = ParameterSet(Pump(), PARAMETERS)
    assert values.find("On") is PARAMETERS["Pump - On"]
    assert values.find("on") is None


def test_mistakes_of_the_author_are_named():
    class Wrong:
        speed: complex = param(1.0, "m/s", "Speed.")

    class Default:
        speed: float = param(-1.0, "m/s", "Speed.", minimum=0.0)

    with pytest.raises(TypeError, match=r"Wrong\.speed"):
        declared_parameters(Wrong)
    with pytest.raises(TypeError, match=r"Default\.speed: the default -1 is below"):
        declared_parameters(Default)


def test_a_class_shows_its_declaration():
    assert isinstance(Pump.flow, Parameter)


class Bilge(Pump):
    """Has another default."""

    flow: float = param(2.5, "l/s", "Flow of the bilge.", name="Bilge Flow")


def test_a_subclass_declares_a_parameter_anew_or_not_at_all():
    class Careless(Pump):
        count = 5

    assert [p.name for p in declared_parameters(Bilge).values()][:2] == ["Bilge Flow", "Count"]
    assert "Flow" not in declared_parameters(Bilge)
    with pytest.raises(TypeError, match=r"Careless\.count is a parameter"):
        declared_parameters(Careless)
