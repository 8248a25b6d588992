"""Numbers with units in the parameters of a scenario."""

import pytest

from shoal.scenarios import ScenarioFileError
from shoal.scenarios.value_reader import convert_to_unit_of
from tasks.simulators.vsim import VSIM

BEGIN = """
vehicle:
  profile: lauv-noptilus-1
  parameters: {{{parameters}}}
limit: 2 s
"""


@pytest.mark.parametrize(
    ("parameters", "value"),
    [
        ("Simulators.GPS: {HACC: 4 m}", "4.0"),
        ("Simulators.GPS: {Time Constant - Drift: 10 min}", "600.0"),
        ("Simulators.GPS: {Execution Frequency: 2 Hz}", "2.0"),
        ("Simulators.GPS: {Device Position: [0 m, 1, -0.5 m]}", "0.0, 1.0, -0.5"),
        ("Simulators.GPS: {Number of Satellites: 5.0}", "5"),
        ("Simulators.VSIM: {Initial Heading: 0.5 rad}", "28.64788975654116"),
        ("Simulators.VSIM: {Initial Heading: 90.1°}", "90.1"),
        ("Navigation.AUV.Navigation: {Depth Noise Covariance: 0.01 m²}", "0.01"),
        ("Navigation.AUV.Navigation: {DVL timeout: 1500 ms}", "1.5"),
        ("World: {Water Visibility: 8 m}", "8.0"),
        ("Simulators.GPS: {HACC: 4}", "4"),
    ],
)
def test_a_parameter_takes_its_unit_and_others_of_its_dimension(document, parameters, value):
    (spec,) = document(begin=BEGIN.format(parameters=parameters)).scenario().vehicles
    assert [setting.value for setting in spec.settings] == [value]


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ("Simulators.GPS: {HACC: 4 s}", r"\[Simulators.GPS\] HACC: '4 s' should be in m"),
        ("Simulators.GPS: {HACC: 4 kg}", r"\[Simulators.GPS\] HACC: '4 kg' should be in m"),
        ("Simulators.GPS: {Execution Frequency: 2 s}", "'2 s' should be in Hz"),
        ("Simulators.GPS: {Number of Satellites: 5 m}", "'5 m' should be a number without a unit"),
        ("Simulators.VSIM: {Initial Heading: 3 m}", "'3 m' should be in ° or deg or rad"),
        ("Navigation.AUV.Navigation: {Depth Noise Covariance: 0.1 m}", "'0.1 m' should be in m²"),
        ("World: {Water Visibility: 8 s}", "'8 s' should be in m"),
        ("World: {Caustics: 1 m}", "'1 m' should be a number without a unit"),
    ],
)
def test_another_dimension_is_refused_with_its_line(document, parameters, said):
    with pytest.raises(ScenarioFileError, match=rf"trial.scenario.yaml:4: .*{said}"):
        document(begin=BEGIN.format(parameters=parameters)).scenario()


def test_an_event_sets_a_parameter_with_a_unit(play):
    text = "events: [{at: 1 s, set: {GPS: {Activation Depth: 3 m}}}]\nmetrics: {valid: {last: GpsFix.validity}}"
    assert play(text).metrics["valid"] == 0x1FF


def test_an_event_with_another_dimension_is_refused_with_its_line(document):
    made = document("events:\n  - {at: 1 s, set: {GPS: {HACC: 9 s}}}")
    with pytest.raises(ScenarioFileError, match=r"trial.scenario.yaml:\d+: Simulators.GPS: HACC: '9 s' should be in m"):
        made.dry_run()


def test_texts_stay_as_they_are():
    assert convert_to_unit_of(VSIM.parameters()["Entity Label - Stream Velocity Source"], "5 m") == "5 m"
