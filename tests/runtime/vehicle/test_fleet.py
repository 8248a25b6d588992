"""Several vehicles on one kernel: each runs as it does alone, and failures name the vehicle."""

import itertools
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from runtime import Task
from runtime.kernel import SECOND, LivelockError, ScaledClock, VirtualClock, WallClock
from runtime.profile import load_profile
from runtime.snapshot import SnapshotError, take_snapshot
from runtime.testing import START, NoProfile
from runtime.vehicle import Fleet, FleetError, Vehicle, build
from tests.runtime.vehicle.members import Diver, Echo, Impatient, alone, recorded, run, together, vehicle

times = st.sampled_from([0.0, 0.5, 1.0, 1.7])


members = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 3),
        "rate": st.sampled_from([1.0, 3.0, 10.0]),
        "patience": st.sampled_from([0.0, 0.1, 0.35]),
        "leaves_after": times,
        "stumbles_after": times,
        "keep_going": st.just(True),
    }
)


@pytest.mark.heavy
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(members, min_size=2, max_size=3), st.randoms(use_true_random=False))
def test_each_is_as_it_is_alone_to_the_byte_in_any_order(hows, shuffler):
    fleet = [(f"v{number}", how) for number, how in enumerate(hows)]
    expected = {name: alone(2.5, name, **how) for name, how in fleet}
    shuffler.shuffle(fleet)
    assert together(2.5, fleet) == expected
    assert all(len(packets) > 3 for packets in expected.values())


@pytest.mark.heavy
def test_whole_vehicles_leave_the_same_logs_as_alone(tmp_path):
    def swimming(name, seed, root, fleet=None):
        profile = load_profile("lauv-noptilus-1", vehicle=name)
        clock = VirtualClock(profile.start_time_ns) if fleet is None else None
        return build(profile, {"Simulation"}, clock=clock, fleet=fleet, seed=seed, log_root=root / "log").vehicle

    for name, seed in (("one", 1), ("two", 2)):
        made = swimming(name, seed, tmp_path / "alone")
        made.start()
        made.run(15.0)
        made.close()
    for order in (("one", 1), ("two", 2)), (("two", 2), ("one", 1)):
        folder = tmp_path / order[0][0]
        with Fleet(VirtualClock(START * SECOND)) as fleet:
            for name, seed in order:
                swimming(name, seed, folder, fleet)
            fleet.start()
            fleet.run(15.0)
        for path in (tmp_path / "alone").rglob("*"):
            if path.is_file():
                assert (folder / path.relative_to(tmp_path / "alone")).read_bytes() == path.read_bytes(), path.name
    assert len(list(tmp_path.rglob("Data.lsf.gz"))) == 12  # two of each vehicle, since a plan starts a new log


def test_a_vehicle_may_join_later():
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        first = recorded(vehicle("first", fleet=fleet))
        fleet.start()
        fleet.run(1.25)
        late = vehicle("late", fleet=fleet)
        second = recorded(late)
        late.start()
        fleet.run(1.25)
    assert first == alone(2.5, "first")
    assert second == alone(1.25, "late", clock=VirtualClock(START * SECOND + 5 * SECOND // 4))


def test_names_are_taken_until_their_vehicle_is_closed():
    with Fleet(VirtualClock(0)) as fleet:
        first = vehicle("twin", fleet=fleet)
        with pytest.raises(FleetError, match=r"fleet already has a vehicle 'twin': give each its own name"):
            vehicle("twin", fleet=fleet)
        assert fleet.vehicles == [first]
        first.close()
        first.close()
        vehicle("twin", fleet=fleet)


def test_a_vehicle_has_a_clock_or_a_fleet():
    for both in ({}, {"clock": VirtualClock(0), "fleet": Fleet(VirtualClock(0))}):
        with pytest.raises(TypeError, match="either a clock or a fleet"):
            Vehicle("v", 1, profile=NoProfile(), **both)


def test_a_fatal_error_ends_the_run_of_all_and_names_vehicle_and_task():
    fleet = Fleet(VirtualClock(0))
    one, two = vehicle("one", fleet=fleet), vehicle("two", fleet=fleet, stumbles_after=1.5)
    packets = recorded(one)
    with pytest.raises(ValueError, match="a stone") as caught:
        run(fleet, 10.0)
    assert caught.value.__notes__ == ["in two, Test.Diver at 1.500 s of the run"]
    assert (one.running, two.running, fleet.vehicles) == (set(), set(), [])
    assert imc.decode(packets[-2]).timestamp == 1.5


def test_a_task_that_is_restarted_is_no_business_of_the_others():
    hows = [("good", {}), ("bad", {"stumbles_after": 0.5, "keep_going": True})]
    packets = together(5.0, hows)
    assert packets["good"] == alone(5.0, "good")
    texts = [m.text for m in map(imc.decode, packets["bad"]) if isinstance(m, imc.LogBookEntry)]
    assert sum("a stone" in text for text in texts) > 1


def test_one_that_stops_is_closed_and_the_others_go_on_until_all_have():
    with Fleet(ScaledClock(20.0)) as fleet:
        made = [vehicle(f"v{n}", fleet=fleet, leaves_after=n) for n in (1.0, 2.0)]
        packets = [recorded(one) for one in made]
        fleet.start()
        fleet.run()
        assert fleet.vehicles == []
    last = [imc.decode(mine[-1]).timestamp - made[0].start_time for mine in packets]
    assert last[0] < last[1]
    assert not any(one.running for one in made)


def test_who_stops_a_vehicle_that_has_left_does_not_end_the_run_of_the_others():
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        gone = vehicle("gone", fleet=fleet, leaves_after=1.0)
        packets = recorded(vehicle("stays", fleet=fleet, tasks=(Diver,)))
        impatient = Impatient(gone)
        fleet.kernel.after(2.0, impatient.lose_patience)
        fleet.start()
        fleet.run(5.0)
    assert impatient.lost
    assert imc.decode(packets[-1]).timestamp == START + 5.0


def test_stop_of_the_fleet_ends_the_run_of_all():
    with Fleet(VirtualClock(0)) as fleet:
        for name in "ab":
            vehicle(name, fleet=fleet)
        fleet.start()
        fleet.kernel.at(SECOND, fleet.stop)
        fleet.run(10.0)
        assert (fleet.kernel.now_ns, len(fleet.vehicles)) == (SECOND, 2)
        fleet.vehicles[0].run(1.0)
        assert (fleet.kernel.now_ns, len(fleet.vehicles)) == (2 * SECOND, 2)


class Rude(Task):
    """Fails to stop."""

    def stop(self) -> None:
        raise OSError(f"{self.system_name} is still open")


class Clumsy(Task):
    """Fails at the moment when other vehicles stop."""

    def start(self) -> None:
        self.after(1.0, self.wait)

    def wait(self) -> None:
        self.vehicle.kernel.soon(self.fall)

    def fall(self) -> None:
        raise ValueError("fell")


def test_errors_at_the_end_keep_nobody_from_stopping():
    fleet = Fleet(VirtualClock(0))
    made = [vehicle(name, fleet=fleet, tasks=(Diver, Rude)) for name in "ab"]
    packets = [recorded(one) for one in made]
    fleet.start()
    fleet.run(1.0)
    with pytest.raises(OSError, match="a is still open"):
        fleet.close()
    assert [imc.decode(mine[-1]).value for mine in packets] == [-1.0, -1.0]
    assert fleet.vehicles == []


def test_who_fails_while_another_leaves_is_named_when_that_one_has_left():
    fleet = Fleet(VirtualClock(0))
    leaver = vehicle("leaver", fleet=fleet, leaves_after=1.0)
    clumsy = vehicle("clumsy", fleet=fleet, tasks=(Clumsy,))
    packets = recorded(leaver)
    fleet.start()
    with pytest.raises(ValueError, match="fell") as caught:
        fleet.run(2.0)
    assert caught.value.__notes__ == ["in clumsy, Test.Clumsy at 1.000 s of the run"]
    assert imc.decode(packets[-1]).value == -1.0
    assert fleet.vehicles == [clumsy]
    fleet.close()


def test_what_looks_on_is_its_vehicles_and_what_is_nobodys_ends_the_run():
    def look(_):
        raise KeyError("cannot see")

    fleet = Fleet(VirtualClock(0))
    vehicle("one", fleet=fleet)
    vehicle("two", fleet=fleet).observe(imc.Depth, look)
    with pytest.raises(KeyError) as caught:
        run(fleet, 1.0)
    assert "in two, test_what_looks_on_" in caught.value.__notes__[0]
    fleet = Fleet(VirtualClock(0))
    one = vehicle("one", fleet=fleet)
    fleet.kernel.soon(lambda: Clumsy.fall(one))
    with pytest.raises(ValueError, match="fell") as caught:
        run(fleet, 1.0)
    assert "does not belong to a vehicle" in caught.value.__notes__[0]


class Chatterbox(Task):
    """Never ends."""

    def start(self) -> None:
        self.after(0.5, self.talk)

    def talk(self) -> None:
        self.vehicle.kernel.soon(self.talk)


def test_a_livelock_names_vehicle_and_task():
    with Fleet(VirtualClock(0)) as fleet:
        vehicle("one", fleet=fleet)
        vehicle("two", fleet=fleet, tasks=(Chatterbox,))
        vehicle("three", fleet=fleet)
        fleet.kernel.livelock_events = 3000
        fleet.start()
        with pytest.raises(LivelockError, match=r"in Test\.Chatterbox") as caught:
            fleet.run(1.0)
    assert caught.value.__notes__ == ["in two: Test.Chatterbox"]


class Toiler(Task):
    """Computes for long in start() and in a handler, and ends the run."""

    def start(self) -> None:
        self.compute()
        self.after(0.01, self.compute_and_end)

    def compute_and_end(self) -> None:
        self.compute()
        self.vehicle.fleet.stop()

    def compute(self) -> None:
        begun = time.thread_time()
        while time.thread_time() < begun + 0.3:
            pass


def test_a_slow_handler_is_named_with_its_vehicle_and_not_in_a_log_book(caplog):
    with Fleet(WallClock()) as fleet:
        made = [vehicle("one", fleet=fleet, tasks=(Echo,)), vehicle("two", fleet=fleet, tasks=(Toiler,))]
        said = [[], []]
        for one, texts in zip(made, said, strict=True):
            one.observe(imc.LogBookEntry, lambda entry, texts=texts: texts.append(entry.text))
        fleet.start()
        fleet.run()
    assert not [text for text in (*said[0], *said[1]) if "handler" in text]
    texts = [record.getMessage() for record in caplog.records]
    assert [text.split(" computed")[0] for text in texts if " in one handler" in text] == ["two: Test.Toiler"]


def test_the_configuration_of_a_vehicle_has_the_time_at_which_it_began():
    profile = load_profile("lauv-noptilus-1", overrides=["General:Start Time=2027-01-01T00:00:00Z"])
    with Fleet(VirtualClock(START * SECOND + 1500 * SECOND // 1000)) as fleet:
        made = build(profile, {"Kinematic"}, fleet=fleet).vehicle
        assert profile.start_time_ns == fleet.kernel.now_ns
        assert made.start_time == START + 1.5


def test_more_vehicles_change_nothing_for_the_others():
    packets = [together(1.5, [(f"v{n}", {"seed": n}) for n in range(count)]) for count in (1, 2, 9)]
    for fewer, more in itertools.pairwise(packets):
        assert fewer == {name: more[name] for name in fewer}


def test_a_vehicle_of_a_fleet_cannot_be_saved():
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        for name in "ab":
            vehicle(name, fleet=fleet, tasks=(Echo,))
        fleet.start()
        fleet.run(1.0)
        with pytest.raises(SnapshotError, match="several vehicles on one kernel cannot be saved"):
            take_snapshot(fleet.vehicles[0])
