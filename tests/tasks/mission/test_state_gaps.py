"""Gaps in the EstimatedState of the profile hexa-00 in the air: short ones cost no plan, none a hard touchdown."""

import pytest
from aloft import HEAD, Flight

import imc
from shoal.missions import parse_plan
from tests.repeats import all_but

pytestmark = pytest.mark.heavy


def plan(altitude):
    steps = f"  - takeoff: {{altitude: {altitude}}}\n  - goto: {{north: 30, altitude: {altitude}}}\n  - land: {{}}\n"
    return parse_plan(f"plan: low\n{HEAD}{steps}")


def gap(seconds):
    """Navigation publishes no EstimatedState for some seconds."""

    def inject(vehicle):
        navigation = vehicle.task("Navigation.UAV.Navigation")
        honest = navigation.publish

        def publish(message, **options):
            return message if isinstance(message, imc.EstimatedState) else honest(message, **options)

        navigation.publish = publish
        vehicle.kernel.after(seconds, setattr, navigation, "publish", honest)

    return inject


@pytest.mark.parametrize("seconds", all_but([0.5, 0.95], [0.5, 0.8, 0.95]))
@pytest.mark.parametrize(
    ("altitude", "at"),
    all_but([(2.0, 6.5), (4.0, 9.0)], [(2.0, 5.5), (2.0, 6.5), (4.0, 6.0), (4.0, 9.0), (15.0, 6.0), (15.0, 14.0)]),
)
def test_a_short_gap_costs_no_plan(altitude, at, seconds, tmp_path):
    flight = Flight(tmp_path, (at, gap(seconds)), plan=plan(altitude), seconds=70.0, until_down=True)
    assert flight.modes == ["GROUND", "GUIDED", "GROUND"]
    assert "ERROR" not in flight.op_modes
    assert flight.end.x == pytest.approx(30.0, abs=2.0)
    assert max(-truth.z for truth in flight.truths) < altitude + 3.0
    assert flight.touchdown < 1.0


@pytest.mark.parametrize("times", [(9.0, 11.0), (9.0, 14.0, 19.0, 24.0)])
@pytest.mark.parametrize("altitude", all_but([4.0], [2.0, 4.0, 15.0]))
def test_several_gaps_make_no_hard_touchdown(altitude, times, tmp_path):
    gaps = [(at, gap(0.9)) for at in times]
    flight = Flight(tmp_path, *gaps, plan=plan(altitude), seconds=90.0, until_down=True)
    assert flight.modes[-1] == "GROUND"
    assert flight.touchdown < 1.0
    assert (flight.modes == ["GROUND", "GUIDED", "GROUND"]) is (times[1] > 13.0), "the second one came too soon"


@pytest.mark.parametrize("at", all_but([18, 21], range(16, 25)))
def test_a_gap_at_a_landing_makes_no_hard_touchdown(at, tmp_path):
    flight = Flight(tmp_path, (at, gap(0.9)), plan=plan(4.0), seconds=70.0, until_down=True)
    assert flight.modes[-1] == "GROUND"
    assert flight.end.z == 0.0
    assert flight.touchdown < 1.0
