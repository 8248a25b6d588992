"""The grammar of expressions: what a text says, and where it is wrong."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.expressions import (
    MAX_CHARACTERS,
    All,
    Any,
    Call,
    CapturedName,
    Comparison,
    ExpressionError,
    Name,
    Negative,
    Not,
    Number,
    Product,
    Sum,
    Text,
    parse_tree,
)
from support.units import UNITS, symbols_of

A, B, C = (Comparison("<", Name(name), Number(1.0)) for name in "abc")
ONE_LESS = Sum(Number(1.0), (("-", Number(2.0)), ("-", Number(3.0))))


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("3 m", Number(3.0, "m")),
        ("3m", Number(3.0, "m")),
        (".5e1°/s", Number(5.0, "°/s")),
        ("'3 m'", Text("3 m")),
        ("$before", CapturedName("before")),
        ("GpsFix", Name("GpsFix")),
        ("Temperature[CTD 2].value@b-1.x", Name("Temperature", "value", "CTD 2", "b-1.x")),
        ("Depth.value@a-1->b-2", Name("Depth", "value", None, "a-1", "b-2")),
        ("PlanDB.arg.plan_id", Name("PlanDB", "arg.plan_id")),
        ("a < 1 or b < 1 and c < 1", Any((A, All((B, C))))),
        ("(a < 1 or b < 1), c < 1", All((Any((A, B)), C))),
        ("not a < 1 && b < 1", All((Not(A), B))),
        ("!(a < 1 || b < 1)", Not(Any((A, B)))),
        ("1 - 2 - 3 > -x", Comparison(">", ONE_LESS, Negative(Name("x")))),
        ("1 + 2 * 3", Sum(Number(1.0), (("+", Product(Number(2.0), (("*", Number(3.0)),))),))),
        ("(1 + 2) / 3", Product(Sum(Number(1.0), (("+", Number(2.0)),)), (("/", Number(3.0)),))),
        ("1/x.y", Product(Number(1.0), (("/", Name("x", "y")),))),
        ("f(a, 2 m)", Call("f", (Name("a"), Number(2.0, "m")))),
        ("held((a < 1, b < 1), 5 s)", Call("held", (All((A, B)), Number(5.0, "s")))),
        ("text ~ 'leak'", Comparison("~", Name("text"), Text("leak"))),
        ("f()", Call("f", ())),
    ],
)  # fmt: skip
def test_trees(text, tree):
    assert parse_tree(text) == tree


@pytest.mark.parametrize(
    ("text", "reason", "at"),
    [
        ("a < 3 kmh", "there is no unit 'kmh' (did you mean 'km/h'?)", 6),
        ("a < 3 knots", "there is no unit 'knots' (did you mean 'kn'?)", 6),
        ("a < 3kmh", "there is no unit 'kmh' (did you mean 'km/h'?)", 5),
        ("a < 1 and b = 2", "'=' is not understood; write ==", 12),
        ("a < 1 & b < 2", "'&' is not understood; write and", 6),
        ("a <", "a number or Message.field is missing", 3),
        ("a < 1 and", "a number or Message.field is missing", 9),
        ("a < b < c", "'<' is not expected: join two comparisons by and", 6),
        ("(a < 1", "a ) is missing", 6),
        ("f(a, 2", "a ) is missing", 6),
        ("a < 1)", "')' is not expected", 5),
        ("a < 1 b", "there is no unit 'b'", 6),
        ("a < b c", "'c' is not expected", 6),
        ("2 + (a < 1)", "a < 1 is true or false, not a number", 5),
        ("(a < 1) < 2", "a < 1 is true or false, not a number", 1),
        ("a < 1 and 2 + 3", "a comparison is missing", 15),
        ("not 3 m", "a comparison is missing", 7),
        ("$ < 3", "'$' is not understood", 0),
        ("a < 'open", '"\'open" is not understood', 4),
        ("(" * 60, "is nested more than 50 times", 51),
        ("not " * 60 + "a < 1", "is nested more than 50 times", 204),
        ("-" * 60 + "1", "is nested more than 50 times", 51),
    ],
)
def test_a_mistake_is_reported_with_its_place(text, reason, at):
    with pytest.raises(ExpressionError) as caught:
        parse_tree(text)
    assert caught.value.reason == reason
    assert caught.value.at == at
    assert str(caught.value) == f"{reason}, at character {at + 1}"


def test_a_text_that_is_too_long_is_refused():
    assert parse_tree("1" + "+1" * ((MAX_CHARACTERS - 1) // 2))
    with pytest.raises(ExpressionError, match="has more than 1000 characters"):
        parse_tree("1" * (MAX_CHARACTERS + 1))


NUMBERS = st.builds(Number, st.floats(0.0, 1e6), st.sampled_from(["", *UNITS]))
NAMES = st.builds(
    Name,
    st.sampled_from(["a", "EstimatedState", "_x1"]),
    st.sampled_from(["", "depth", "arg.plan_id"]),
    st.sampled_from([None, "CTD", "a b/c"]),
    st.sampled_from(["", "lauv-1", "b.c"]),
    st.sampled_from(["", "otter"]),
)
TEXTS = st.builds(Text, st.sampled_from(["", "leak", "a and (b"]))
SIMPLE = st.one_of(NUMBERS, NAMES, TEXTS, st.builds(CapturedName, st.just("x")))


def lists(inner, *signs):
    return st.lists(st.tuples(st.sampled_from(signs), inner), min_size=1, max_size=3).map(tuple)


SUMS = st.recursive(
    SIMPLE,
    lambda inner: st.one_of(
        st.builds(Sum, inner, lists(inner, "+", "-")),
        st.builds(Product, inner, lists(inner, "*", "/")),
        st.builds(Negative, inner),
        st.builds(Call, st.sampled_from(["f", "hypot"]), st.lists(inner, max_size=3).map(tuple)),
    ),
    max_leaves=6,
)
CONDITIONS = st.recursive(
    st.builds(Comparison, st.sampled_from(["<", "<=", ">", ">=", "==", "!=", "~"]), SUMS, SUMS),
    lambda inner: st.one_of(
        st.builds(Not, inner),
        st.builds(All, st.lists(inner, min_size=2, max_size=3).map(tuple)),
        st.builds(Any, st.lists(inner, min_size=2, max_size=3).map(tuple)),
        st.builds(Call, st.just("held"), st.tuples(inner, NUMBERS)),
    ),
    max_leaves=5,
)


def written(node):
    """A text with a bracket around each part."""
    match node:
        case Number():
            return f"{node.value!r} {node.symbol}"
        case Text():
            return f"'{node.value}'"
        case CapturedName():
            return f"${node.name}"
        case Name():
            return "".join([
                node.name,
                f"[{node.entity}]" if node.entity is not None else "",
                f".{node.path}" if node.path else "",
                f"@{node.vehicle}" if node.vehicle else "",
                f"->{node.receiver}" if node.receiver else "",
            ])  # fmt: skip
        case Call():
            return f"{node.function}({', '.join(map(written, node.arguments))})"
        case Negative():
            return f"(-({written(node.value)}))"
        case Sum() | Product():
            return f"({bracketed(node.first)}{''.join(f' {sign} {bracketed(part)}' for sign, part in node.rest)})"
        case Comparison():
            return f"{bracketed(node.left)} {node.sign} {bracketed(node.right)}"
        case Not():
            return f"not ({written(node.condition)})"
        case All():
            return " and ".join(f"({written(part)})" for part in node.conditions)
        case Any():
            return " or ".join(f"({written(part)})" for part in node.conditions)


def bracketed(node):
    return f"({written(node)})"


@given(st.one_of(SUMS, CONDITIONS))
def test_a_tree_that_is_written_is_read_again(tree):
    text = written(tree)
    if len(text) <= MAX_CHARACTERS:
        assert parse_tree(text) == tree


@given(st.text(alphabet="aN. <>=!~&|()[]@-+*/,'\"$0123456789emsknortdhl°%\t", max_size=80))
def test_any_text_is_a_tree_or_a_mistake_with_a_place(text):
    try:
        tree = parse_tree(text)
    except ExpressionError as error:
        place = error.at
    else:
        place = tree.at
        assert text[place:].startswith(tree.text)
    assert place in range(len(text) + 1)


def test_units_are_those_of_the_si_brochure():
    assert UNITS["kn"].to_si(3600.0) == pytest.approx(1852.0)
    assert UNITS["nmi"].to_si(1.0) == 1852.0
    assert UNITS["km/h"].to_si(36.0) == pytest.approx(10.0)
    assert UNITS["°"].to_si(180.0) == math.pi
    assert symbols_of("s") == ("s", "ms", "min", "h")
    assert [UNITS[unit].to_si(8.0) for unit in symbols_of("B/s")] == [8.0, 8000.0, 1.0, 1000.0]
