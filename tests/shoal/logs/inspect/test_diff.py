"""Comparison of two logs."""

import math

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from shoal.logs.inspect import compare_logs
from tests.log_messages import START, at


def differ(make_log, one, two):
    return compare_logs(imc.Log(make_log(one, "a")), imc.Log(make_log(two, "b")))


def test_equal_logs_in_other_packing(make_log):
    messages = [at(n) for n in range(100)]
    a, b = make_log(messages, "a", compression="none"), make_log(messages, "b", block=100)
    found = compare_logs(imc.Log(a), imc.Log(b))
    assert found.equal
    assert found.packets == (100, 100)


def test_a_changed_field(make_log):
    messages = [at(n, value=1.0) for n in range(100)]
    changed = [m.replace(value=1.0 + n) if n in (40, 43) else m for n, m in enumerate(messages)]
    found = differ(make_log, messages, changed)
    one, two = found.first
    assert (one.number, one.offset, one.message, two.message) == (41, 40 * 26, messages[40], changed[40])
    row = found.types["Voltage"]
    assert (row.same, row.changed, row.only_a, row.only_b) == (98, 2, 0, 0)
    (key, field) = next(iter(found.fields.items()))
    assert key == ("Voltage", "value")
    assert (field.count, field.mean, field.greatest, field.at) == (2, 41.5, 43.0, START + 43)


def test_messages_only_in_one(make_log):
    messages = [at(n, (imc.Voltage, imc.Current)[n % 2]) for n in range(100)]
    found = differ(make_log, messages, [*messages[:50], at(49.5, imc.Abort), *messages[50:98]])
    assert found.first[0].number == 51
    assert type(found.first[1].message) is imc.Abort
    rows = {name: (row.same, row.changed, row.only_a, row.only_b) for name, row in found.types.items()}
    assert rows == {"Voltage": (49, 0, 1, 0), "Current": (49, 0, 1, 0), "Abort": (0, 0, 0, 1)}
    assert found.fields == {}


def test_one_log_is_the_beginning_of_the_other(make_log):
    messages = [at(n) for n in range(10)]
    found = differ(make_log, messages, messages[:7])
    assert found.first[0].number == 8
    assert found.first[1].message is None
    assert found.types["Voltage"].only_a == 3


def test_an_empty_log(make_log):
    assert differ(make_log, [], [at(1)]).first[0].message is None


def test_another_order(make_log):
    messages = [at(n) for n in range(10)]
    found = differ(make_log, messages, [messages[1], messages[0], *messages[2:]])
    assert found.reordered
    assert found.first[0].number == 1


def test_runs_at_other_times_are_paired_by_order(make_log):
    found = differ(make_log, [at(n, value=n) for n in range(50)], [at(n + 500, value=n) for n in range(50)])
    assert not found.by_time
    assert {key[1]: field.greatest for key, field in found.fields.items()} == {"timestamp": 500.0}


def test_texts_nan_and_unknown_messages(make_log):
    one = [at(1, imc.EntityState, description="a"), at(2, value=math.nan), at(3, imc.Unknown, id=9999, payload=b"a")]
    two = [at(1, imc.EntityState, description="b"), at(2, value=math.nan), at(3, imc.Unknown, id=9999, payload=b"b")]
    found = differ(make_log, one, two)
    assert {key: field.numeric for key, field in found.fields.items()} == {
        ("EntityState", "description"): False,
        ("Unknown", "payload"): False,
    }
    assert found.types["Voltage"].same == 1


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, 1), st.integers(0, 2)), max_size=12),
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, 1), st.integers(0, 2)), max_size=12),
)
def test_counts_always_add_up(tmp_path_factory, one, two):
    logs = []
    for rows in (one, two):
        folder = tmp_path_factory.mktemp("log")
        packets = (imc.encode(at(n, (imc.Voltage, imc.Current)[kind], value=value)) for n, kind, value in rows)
        (folder / "Data.lsf").write_bytes(b"".join(packets))
        logs.append(imc.Log(folder))
    found = compare_logs(*logs)
    assert found.equal == (one == two)
    if not found.equal:
        assert sum(row.same + row.changed + row.only_a for row in found.types.values()) == len(one)
        assert sum(row.same + row.changed + row.only_b for row in found.types.values()) == len(two)
        assert found.reordered == (sorted(one) == sorted(two))
