"""Faults of the profile hexa-00 in the air that leave it without a barometer, or without power for a moment."""

import math
from dataclasses import replace
from functools import cache

import pytest
from flying import control, place, plan_of
from lean import UNLOGGED

import imc
from runtime.fault_injection import Crash, FaultInjector
from shoal.missions import prepare
from tests.repeats import all_but
from tests.tasks.mission.lies import AHRS, BAROMETER, GPS, HIGH, Flight, Mode, before, late, lies
from tests.tasks.mission.underway import say

pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def fly():
    """Flies hexa-00 on from FAULT, with the same flight before."""
    state = cache(before)
    return lambda folder, inject, profile, seconds: Flight(state(profile), folder, inject, seconds)


@pytest.mark.parametrize("factor", all_but([0.01, 0.75], [0.01, 0.0295, 0.75]))
def test_a_multirotor_whose_pressure_comes_in_another_unit_lands_softly(factor, fly, tmp_path):
    flight = fly(tmp_path, lies(BAROMETER, imc.Pressure, ("value", lambda p, t: factor * p)), "hexa-00", 90.0)
    assert flight.errors[0].startswith("Navigation: pressure has jumped by -")
    assert flight.wrong_depth < 2.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown < 1.5


def brown_outs(dip, *times, restarting=(GPS, AHRS, BAROMETER)):
    """The battery has no voltage for `dip` s at each of these times (s), and sensors restart."""

    def inject(vehicle):
        battery, injector, dips = vehicle.task("Simulators.Battery"), FaultInjector(vehicle), []
        honest = battery.publish

        def publish(message, **options):
            return honest(
                message.replace(value=0.0) if dips and isinstance(message, imc.Voltage) else message, **options
            )

        def begin():
            dips.append(True)
            battery.measure()
            for task in restarting:
                injector.begin(task, Crash())
            vehicle.kernel.after(dip, end)

        def end():
            dips.clear()
            battery.measure()

        battery.publish = publish
        for seconds in times:
            vehicle.kernel.after(seconds, begin)

    return inject


def test_a_multirotor_whose_power_fails_for_a_second_again_and_again_does_not_fly_away(fly, tmp_path):
    flight = fly(tmp_path, brown_outs(1.5, 5.0, 15.0), "hexa-00", 200.0)
    assert -min(flight.depths) < 40.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("begin", all_but([8.15], [5.0, 8.15]))
@pytest.mark.parametrize("interval", [2.0, 3.0])
def test_a_multirotor_whose_power_fails_for_a_moment_again_and_again_lands_softly(interval, begin, fly, tmp_path):
    times = [begin + interval * i for i in range(round(40.0 / interval))]
    flight = fly(tmp_path, brown_outs(0.3, *times), "hexa-00", 150.0)
    assert -min(flight.depths) < 12.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown < 2.0


@pytest.mark.parametrize("begin", [6.3, 7.0])
def test_a_multirotor_whose_state_ends_in_a_loss_of_power_lands_softly(begin, fly, tmp_path):
    """Without GPS and barometer navigation soon has no height; its last state came while rotors had little thrust."""
    times = [begin + 2.5 * i for i in range(16)]
    flight = fly(tmp_path, brown_outs(0.3, *times, restarting=(GPS, BAROMETER)), "hexa-00", 150.0)
    assert -min(flight.depths) < 12.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown < 2.5


@pytest.mark.parametrize("begin", all_but([5.0], [5.0, 7.5]))
@pytest.mark.parametrize(("interval", "restarting"), [(5.0, (GPS, AHRS, BAROMETER)), (5.0, ()), (2.0, ())])
def test_a_multirotor_whose_power_fails_for_a_moment_again_and_again_stays_down(
    interval, restarting, begin, fly, tmp_path
):
    times = [begin + interval * i for i in range(round(80.0 / interval))]
    flight = fly(tmp_path, brown_outs(0.3, *times, restarting=restarting), "hexa-00", 110.0)
    landed = next(i for i, depth in enumerate(flight.depths) if depth > -0.01)
    assert -min(flight.depths[landed:]) < 1.0, "a rise that has begun may lift it once more"
    assert not any(flight.depths[landed + 300 :])
    assert flight.touchdown < 2.5


def test_a_multirotor_whose_receiver_does_not_know_the_height_flies_its_plan_by_its_fixes(fly, tmp_path):
    flight = fly(tmp_path, lies(GPS, imc.GpsFix, ("height", math.nan)), "hexa-00", 60.0)
    assert set(flight.modes) == {Mode.MANEUVER}
    assert flight.astray < 2.0
    assert flight.wrong_depth < 1.0


@pytest.mark.parametrize(
    ("load", "after"), all_but([(-0.5, 11.0), (0.6, 8.0)], [(-0.3, 11.0), (-0.5, 11.0), (0.6, 8.0), (0.6, 15.0)])
)
def test_a_multirotor_with_late_pressures_and_another_load_lands_softly(load, after, fly, tmp_path):
    def inject(vehicle):
        late(BAROMETER, 1.5)(vehicle)
        craft = vehicle.task("Simulators.UAV").craft
        loaded = replace(craft.airframe, mass=craft.airframe.mass + load)
        vehicle.kernel.after(after, setattr, craft, "airframe", loaded)

    flight = fly(tmp_path, inject, "hexa-00", 150.0)
    assert -min(flight.depths) < 20.0
    assert flight.touchdown < 2.5
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("after", all_but([0.1, 1.5], [0.1, 0.3, 1.5]))
def test_a_multirotor_whose_takeoff_is_stopped_as_it_begins_lands(after, tmp_path):
    """It hovers if it has left the ground."""
    shares, texts, heights = [], [], []
    vehicle = prepare("hexa-00", overrides=(UNLOGGED,), log_root=tmp_path / "log", state_folder=tmp_path / "db").vehicle
    vehicle.observe(imc.SetThrusterActuation, lambda command: shares.append(command.value))
    vehicle.observe(imc.LogBookEntry, lambda entry: texts.append(entry.text))
    vehicle.observe(imc.SimulatedState, lambda truth: heights.append(-truth.z))
    vehicle.start()
    vehicle.run(10.0)
    plan = plan_of(imc.Takeoff(**place(0, 0), **HIGH, speed=2.0))
    say(vehicle, control(imc.PlanControl.Op.START, -1.0, plan.plan_id, 1, arg=plan, dst=vehicle.system))
    vehicle.run(after)
    request, stop = imc.VehicleCommand.Type.REQUEST, imc.VehicleCommand.Command.STOP_MANEUVER
    say(vehicle, imc.VehicleCommand(type=request, request_id=2, command=stop, dst=vehicle.system))
    vehicle.run(30.0)
    vehicle.close()
    assert any(shares)
    assert not any("descending level" in text for text in texts)
    if after < 1.0:
        assert shares[-1] == 0.0
        assert max(heights) < 1.0
        assert "landing: stopped at the beginning of a takeoff" in texts
    else:
        assert shares[-1] > 0.5
        assert heights[-1] > 1.5
