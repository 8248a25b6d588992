"""A search over the parameters of several vehicles writes a file of options for each, which a profile takes."""

from runtime.profile import load_profile
from shoal.campaigns.search import write_tuned_options

SCENARIO = """\
vehicles:
  first: {profile: lauv-noptilus-1, parameters: {Control.AUV.Attitude: {Heading PID Gains: [1.5, 0, 0.15]}}}
  second: {profile: lauv-noptilus-1}
  third: {profile: lauv-noptilus-1, parameters: {Simulators.GPS: {HACC: 3}}}
limit: 3 s
"""
GAIN = "vehicles/first/parameters/Control.AUV.Attitude/Heading PID Gains/0"
WIDTH = "vehicles/second/parameters/Control.Path.VectorField/Corridor -- Width"


def test_each_vehicle_has_its_own_options(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fleet.scenario.yaml").write_text(SCENARIO)
    words = ["Found.", f"{GAIN} = 2.5", f"{WIDTH} = 4", "world/current/east = 1"]
    values = {GAIN: 2.5, WIDTH: 4, "world/current/east": 1}
    written = write_tuned_options(tmp_path / "fleet.scenario.yaml", values, tmp_path, words)
    assert [path.name for path in written] == ["tuned-first.ini", "tuned-second.ini"]
    for name, own, other in (("first", GAIN, WIDTH), ("second", WIDTH, GAIN)):
        text = (tmp_path / f"tuned-{name}.ini").read_text()
        assert f"# {own} = " in text
        assert other not in text
        assert "# world/current/east = 1\n" in text
        (tmp_path / f"{name}.ini").write_text(f"[Require lauv-noptilus-1.ini]\n[Require tuned-{name}.ini]\n")
    assert load_profile("first").value("Control.AUV.Attitude", "Heading PID Gains") == "2.5, 0, 0.15"
    assert load_profile("second").value("Control.Path.VectorField", "Corridor -- Width") == "4"
