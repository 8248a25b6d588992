"""Parameter requests from careless or hostile systems, and tasks that fail on them."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import ParameterError, State, Task, param, periodic
from runtime.kernel import VirtualClock
from runtime.testing import NoProfile, simulate
from runtime.vehicle import Vehicle

CONSOLE = 0x4001
Phase = imc.EntityActivationState.State


class Valve(Task):
    """Has a parameter of each type, and fails to apply some."""

    activation = "plan"
    active: bool = param(False, "", "Whether it is open.", scope="plan")
    flow: float = param(1.0, "l/s", "Flow.", minimum=0.0)
    rate: float = param(10.0, "Hz", "Ticks per second.", minimum=0.0)
    turns: int = param(2, "1", "Turns.", scope="plan")
    levels: list[float] = param([1.0, 2.0], "m", "Levels.", size=(1, 4))
    mode: str = param("Slow", "", "Mode.", choices=("Slow", "Fast", "Broken"))

    def configure(self) -> None:
        if self.flow > 1e6:
            raise ParameterError("Flow", "more than there is")
        if self.mode == "Broken":
            raise KeyError("no table for this mode")

    def activate(self) -> None:
        self.opened = getattr(self, "opened", 0) + 1
        if self.turns == 13:
            raise OSError("the valve is stuck")

    def start(self) -> None:
        self.starts = getattr(self, "starts", 0) + 1
        self.set_entity_state(State.NORMAL, "active")

    @periodic("rate")
    def tick(self) -> None:
        self.ticks = getattr(self, "ticks", 0) + 1


def setting(at, **values):
    entries = tuple(imc.EntityParameter(name=name, value=value) for name, value in values.items())
    return imc.SetEntityParameters(name="Valve", params=entries, timestamp=at, src=CONSOLE, src_ent=7, dst=0x1A)


@pytest.mark.parametrize(("src", "turns"), [(0x1B, 2), (CONSOLE, 3), (0xFFFF, 3)])
def test_what_another_vehicle_sets_for_nobody_in_particular_is_its_own(src, turns):
    run = simulate(Valve, [setting(1.0, Turns="3").replace(src=src, dst=0xFFFF)], seconds=2)
    assert run.task.turns == turns


def test_a_console_that_sends_refused_values_without_end_does_not_fill_the_log_book():
    many = tuple(imc.EntityParameter(name="Turns", value="many") for _ in range(800))
    requests = [
        imc.SetEntityParameters(name="Valve", params=many, timestamp=1.0 + i / 45.0, src=CONSOLE, dst=0x1A)
        for i in range(45)
    ]
    run = simulate(Valve, requests, seconds=3)
    assert 60 <= len(run.log) < 70
    assert "more requests about parameters are rejected, which are not logged one by one" in run.log


def test_parameters_are_told_to_all_at_the_start_and_when_they_change():
    vehicle = Vehicle("v", 0x1A, clock=VirtualClock(), profile=NoProfile())
    vehicle.daemon.publishes_all = True
    vehicle.add(Valve, "Valve")
    told = []
    vehicle.observe(imc.EntityParameters, told.append)
    vehicle.start()
    vehicle.run(1.5)
    assert {message.name for message in told} == {"Daemon", "Valve"}
    change = setting(1.0, Turns="3", Flow="-1")
    vehicle.bus.deliver_and_send(change, imc.encode(change), None)
    vehicle.run(0.5)
    vehicle.close()
    for_all = [
        {p.name: p.value for p in message.params}
        for message in told
        if message.name == "Valve" and message.dst == 0xFFFF
    ]
    assert [values["Turns"] for values in for_all] == ["2", "3"]
    assert for_all[0].keys() == for_all[1].keys() == Valve.parameters().keys()


names = st.sampled_from([*Valve.parameters(), "", "No Such", "Entity Label"])
values = st.one_of(
    st.sampled_from(["true", "false", "1e999", "-inf", "nan", "9" * 5000, "-" + "9" * 400, "0x" + "f" * 40, "13", ""]),
    st.sampled_from(["Broken", "Fast", "1,2,3,4,5", ",", "1;2", "a\nb", "[x]", "\udcff", "1" + "0" * 400]),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=12),
    st.floats().map(repr),
    st.integers().map(str),
)
entries = st.lists(st.builds(imc.EntityParameter, name=names, value=values), max_size=5)


@pytest.mark.heavy
@settings(max_examples=60)
@given(st.lists(entries, min_size=1, max_size=4))
def test_whatever_is_set_the_values_keep_to_their_declarations_and_the_daemon_lives(lots):
    feed = [setting(1.0 + n).replace(params=tuple(lot)) for n, lot in enumerate(lots)]
    run = simulate(Valve, feed, seconds=len(lots) + 3.0, keep_going=True)
    for parameter in run.task.parameters().values():
        parameter.check(run.task.parameter_set.value(parameter))
    assert run.vehicle.daemon.entity.state is State.NORMAL


@pytest.mark.parametrize("values", [{"Mode": "Broken"}, {"Turns": "13", "Active": "true"}])
def test_an_error_of_a_task_under_new_values_is_its_own(values):
    with pytest.raises((KeyError, OSError)) as caught:
        simulate(Valve, [setting(1.0, **values)], seconds=2.0)
    assert len(caught.value.__notes__) == 1
    assert "Valve" in caught.value.__notes__[0]
    run = simulate(Valve, [setting(1.0, **values)], seconds=3.0, keep_going=True)
    assert (run.task.starts, run.task.mode) == (2, "Slow")
    assert run.vehicle.daemon.entity.state is State.NORMAL


@pytest.mark.parametrize(("rate", "words"), [("1e999", "inf is not a value"), ("1e9", "Hz (expects at most")])
def test_a_rate_that_no_clock_can_keep_is_refused(rate, words):
    run = simulate(Valve, [setting(1.0, Rate=rate)], seconds=3.0)
    assert (run.task.rate, run.task.ticks) == (10.0, 30)
    assert any(words in text for text in run.log)
    with pytest.raises(ParameterError, match="Rate"):
        simulate(Valve, rate=float(rate))


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("Flow", "12 cm", "'12 cm' is not a number because of 'cm'"),
        ("Flow", "2,5", "'2,5' is not a number because of ',5'"),
        ("Flow", "3abc", "'3abc' is not a number because of 'abc'"),
        ("Flow", "", "'' is not a number"),
        ("Turns", "3.5", "'3.5' is not an integer (expects integer"),
        ("Levels", "1, 2 m", "'1, 2 m' is not a number because of 'm'"),
    ],
)
def test_a_number_that_is_sent_stands_alone(name, text, reason):
    run = simulate(Valve, [setting(1.0, **{name: text})], seconds=2.0)
    assert (run.task.flow, run.task.turns, run.task.levels) == (1.0, 2, [1.0, 2.0])
    assert any(f"{name} = {text!r} from 0x4001: {reason}" in line for line in run.log), run.log


def test_a_whole_number_may_be_sent_with_decimals():
    assert simulate(Valve, [setting(1.0, Turns="3.0", Flow=" 2.5 ")], seconds=2.0).task.turns == 3


def test_popping_activates_and_deactivates():
    feed = [
        imc.PushEntityParameters(name="Valve", timestamp=1.0),
        setting(2.0, Active="true", Turns="3"),
        imc.PopEntityParameters(name="Valve", timestamp=3.0),
    ]
    run = simulate(Valve, feed, seconds=4.0)
    phases = [m.state for m in run.of(imc.EntityActivationState)]
    assert phases == [Phase.ACT_IP, Phase.ACT_DONE, Phase.ACTIVE, Phase.DEACT_IP, Phase.DEACT_DONE, Phase.INACTIVE]
    assert (run.task.turns, run.task.active) == (2, False)


def test_a_task_that_is_down_is_activated_by_its_next_start():
    class Door(Valve):
        """Opens."""

        activation = "global"

        def start(self):
            super().start()
            if self.starts == 1:
                raise OSError("no power")

    wish = setting(0.5, Active="true").replace(name="Door")
    run = simulate(Door, [wish], seconds=0.9, keep_going=True)
    assert not hasattr(run.task, "opened")
    assert run.task.active
    assert simulate(Door, [wish], seconds=3.0, keep_going=True).task.opened == 1


def test_new_values_say_the_activation_again():
    run = simulate(Valve, [setting(1.0, Turns="3")], seconds=2.0)
    assert [m.state for m in run.of(imc.EntityActivationState)] == [Phase.INACTIVE]


def test_an_empty_text_is_the_default_and_nobody_shares_it():
    run = simulate(Valve, [setting(1.0, Levels="5"), setting(2.0, Levels="")], seconds=3.0)
    run.task.levels.append(3.0)
    assert simulate(Valve).task.levels == [1.0, 2.0]


def test_a_peer_that_pushes_for_ever_costs_no_memory():
    feed = [imc.PushEntityParameters(name="Valve", timestamp=1.0) for _ in range(1000)]
    assert len(simulate(Valve, feed, seconds=2.0).task.parameter_set.pushed) < 100


def test_a_list_of_entities_with_numbers_that_are_none_is_met_with_calm():
    report = imc.EntityList(op=imc.EntityList.Op.REPORT, list=f"A=5;B={'9' * 5000};C=²;D=x;=4;E=300", src=CONSOLE)
    run = simulate(Valve, [report], seconds=1.0)
    assert run.vehicle.entities.label(CONSOLE, 5) == "A"


def test_a_value_that_is_set_back_is_reported_and_saved_as_it_is(tmp_path):
    class Notes(NoProfile):
        """Records the overrides."""

        def __init__(self):
            self.told = []

        def override(self, assignment):
            self.told.append(assignment.rpartition(":")[2])

    notes = Notes()
    vehicle = Vehicle("v", 0x1A, clock=VirtualClock(0), profile=notes, state_folder=tmp_path)
    task = vehicle.add(Valve, "Valve")
    for turns in (3, 3, 2):
        task.turns = turns
        vehicle.update_effective_config(task)
        path = vehicle.save_parameters(task)
    vehicle.close()
    assert notes.told == ["Turns=3", "Turns=2"]
    assert "Turns = 2" in path.read_text()
