"""Which messages a transport sends, how often, of which entities."""

import pytest

import imc
from tasks.transports.imc_links.message_list import (
    MOST_SOURCES,
    MessageList,
    check_entity_filter,
    check_rate_limiter,
    parse_entities,
    parse_rate,
)

LABELS = {(26, 1): "Batteries", (26, 2): "GPS", (26, 3): "Echo Sounder"}


def listed(names="EstimatedState, Voltage", rates=(), entities=(), custom=()):
    return MessageList(
        names.split(","), rates, entities, custom, schema=imc.builtin(), label=lambda *place: LABELS.get(place, "")
    )


def sent(messages, message, hertz, seconds, start=1e9):
    """How many of the messages that come at a rate pass."""
    return sum(messages.passes(message, start + i / hertz) for i in range(round(hertz * seconds)))


def test_only_listed_messages_have_types_and_unknown_names_are_reported():
    messages = listed("EstimatedState, Voltage, UamRxRnge, EstimatedState,", ["Nothing:2"], ["Voltage:GPS"])
    assert messages.types == (imc.EstimatedState, imc.Voltage)
    assert messages.unknown == ["Nothing", "UamRxRnge"]


@pytest.mark.parametrize(("source", "limit"), [(20, 2), (100, 3), (20, 0.5), (1, 1), (0.9, 1), (2, 20), (57, 10)])
def test_a_rate_holds_on_average_and_a_source_at_the_rate_loses_nothing(source, limit):
    found = sent(listed(rates=[f"EstimatedState:{limit}"]), imc.EstimatedState(src=26, src_ent=5), source, 100)
    assert found == pytest.approx(100 * min(source, limit), rel=0.04, abs=1)


def test_a_source_that_jitters_around_the_rate_loses_little():
    messages = listed(rates=["EstimatedState:1"])
    state = imc.EstimatedState(src=26, src_ent=5)
    assert sum(messages.passes(state, 1e9 + i + (-0.03, 0.03)[i % 2]) for i in range(100)) == 100


def test_each_entity_and_system_has_a_rate_of_its_own():
    messages = listed(rates=["Voltage:1"])
    assert all(messages.passes(imc.Voltage(src=26, src_ent=entity), 1e9) for entity in (1, 2, 3))
    assert messages.passes(imc.Voltage(src=27, src_ent=1), 1e9)
    assert not messages.passes(imc.Voltage(src=26, src_ent=1), 1e9 + 0.5)


def test_a_rate_of_zero_sends_none_and_no_rate_sends_all():
    state = imc.EstimatedState(src=26, src_ent=5)
    assert sent(listed(rates=["EstimatedState:0"]), state, 10, 10) == 0
    assert sent(listed(), state, 10, 10) == 100


def test_an_answer_has_no_rate_and_takes_none_from_what_is_for_everybody():
    state, messages = imc.EstimatedState(src=26, src_ent=5), listed(rates=["EstimatedState:1"])
    assert sent(messages, state.replace(dst=0x4001), 100, 1) == 100
    assert sent(messages, state, 100, 2) == sent(listed(rates=["EstimatedState:1"]), state, 100, 2)
    assert sent(messages, state.replace(dst=26), 100, 0.5, 1e9 + 2.0) == 0, "for itself"
    assert sent(listed(rates=["EstimatedState:0"]), state.replace(dst=0x4001), 10, 1) == 0


def test_a_clock_that_is_set_back_stops_nothing():
    messages = listed(rates=["EstimatedState:2"])
    state = imc.EstimatedState(src=26, src_ent=5)
    assert sent(messages, state, 20, 10, start=2e9) == pytest.approx(20, abs=1)
    assert sent(messages, state, 20, 10, start=1e9) == pytest.approx(20, abs=1)


def test_many_sources_need_bounded_memory():
    messages = listed(rates=["EstimatedState:1"])
    for system in range(5 * MOST_SOURCES):
        assert messages.passes(imc.EstimatedState(src=system, src_ent=1), 1e9)
    found = messages._filters[imc.EstimatedState]
    assert len(found._due) <= MOST_SOURCES


def test_only_listed_entities_pass_and_the_last_item_counts():
    messages = listed(entities=["Voltage:GPS", "Voltage: Batteries + Echo Sounder"])
    passed = [entity for entity in (1, 2, 3, 4) if messages.passes(imc.Voltage(src=26, src_ent=entity), 1e9)]
    assert passed == [1, 3]
    assert messages.passes(imc.EstimatedState(src=26, src_ent=2), 1e9)


@pytest.mark.parametrize(
    "item", ["EstimatedState", "EstimatedState:", ":2", "EstimatedState:-1", "A:nan", "A:inf", "A:x"]
)
def test_a_wrong_rate_is_an_error_that_shows_it(item):
    with pytest.raises(ValueError, match=f"^'{item}' is not a message and its rate"):
        parse_rate(item)


@pytest.mark.parametrize("item", ["Voltage", "Voltage:", ":GPS", "Voltage:+"])
def test_wrong_entities_are_an_error_that_shows_them(item):
    with pytest.raises(ValueError, match="is not a message and its entities"):
        parse_entities(item)


def test_only_changed_states_of_some_entities_pass():
    messages = listed("EntityState", custom=["EntityStateChangeFilter:GPS"])
    gps, batteries = ([imc.EntityState(src=26, src_ent=e, state=state) for state in (0, 1, 1, 1, 0)] for e in (2, 1))
    assert [messages.passes(state, i) for i, state in enumerate(gps)] == [True, True, False, False, True]
    assert all(messages.passes(state, i) for i, state in enumerate(batteries))
    messages = listed("EntityState", custom=["EntityStateChangeFilter"])
    assert sum(messages.passes(state, i) for i, state in enumerate([*gps, *batteries])) == 6


def test_only_entries_of_some_types_pass():
    messages = listed("LogBookEntry, Voltage", custom=["LogBookEntryFilter:ERROR+WARNING"])
    passed = [kind.name for kind in imc.LogBookEntry.Type if messages.passes(imc.LogBookEntry(type=kind), 0.0)]
    assert passed == ["WARNING", "ERROR"]
    assert messages.passes(imc.Voltage(), 0.0)
    assert messages.types == (imc.LogBookEntry, imc.Voltage)


def test_an_entry_of_another_type_does_not_use_up_the_rate():
    messages = listed("LogBookEntry", ["LogBookEntry:1"], custom=["LogBookEntryFilter:ERROR"])
    info, error = (imc.LogBookEntry(src=26, src_ent=5, type=imc.LogBookEntry.Type[kind]) for kind in ("INFO", "ERROR"))
    assert [messages.passes(m, 1e9 + 0.1 * i) for i, m in enumerate([info, error, error])] == [False, True, False]
    assert [messages.passes_ignoring_rate(m) for m in (info, error)] == [False, True]


def test_a_change_that_its_rate_holds_back_is_sent_later():
    messages = listed("EntityState", ["EntityState:1"], custom=["EntityStateChangeFilter"])
    good, bad = (imc.EntityState(src=26, src_ent=2, state=state) for state in (0, 1))
    passed = [messages.passes(m, 1e9 + t) for t, m in ((0.0, good), (0.5, bad), (1.1, bad), (2.2, bad), (3.3, good))]
    assert passed == [True, False, True, False, True]


@pytest.mark.parametrize(
    ("item", "reason"),
    [
        ("LogBookEntry:ERROR", "'LogBookEntry:ERROR' is not one of EntityStateChangeFilter, LogBookEntryFilter"),
        ("LogBookEntryFilter:ERROR+BAD", "'BAD' is none of INFO, WARNING, ERROR, CRITICAL, DEBUG"),
    ],
)
def test_a_wrong_custom_filter_is_an_error_that_shows_it(item, reason):
    with pytest.raises(ValueError, match=reason):
        listed("LogBookEntry", custom=[item])


def test_an_item_of_an_unknown_message_is_named_with_the_nearest():
    with pytest.raises(ValueError, match="did you mean EstimatedState"):
        check_rate_limiter("EstimatedStat:2")
    with pytest.raises(ValueError, match="did you mean Voltage"):
        check_entity_filter("Voltag:GPS")
    check_rate_limiter("EstimatedState:2")
    check_entity_filter("Voltage:GPS")
