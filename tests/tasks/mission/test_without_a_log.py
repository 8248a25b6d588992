"""A run without a log encodes nothing, and is the same run."""

from pathlib import Path

import pytest

import imc
from imc.codec import Codec
from imc.codec_compiler import Passage
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build

KINDS = (imc.SimulatedState, imc.EstimatedState, imc.ServoPosition, imc.SetThrusterActuation, imc.EulerAngles)


def flown(profile: str, root: Path, *overrides: str) -> list[imc.Message]:
    """What the vehicle was and believed in 40 s of its first plan."""
    loaded = load_profile(profile, overrides=overrides)
    vehicle = build(
        loaded,
        loaded.parse_modes(["Simulation"]),
        clock=VirtualClock(loaded.start_time_ns),
        seed=3,
        log_root=root / "log",
        state_folder=root / "db",
    ).vehicle
    states: list[imc.Message] = []
    for kind in KINDS:
        vehicle.observe(kind, states.append)
    vehicle.start()
    vehicle.run(40.0)
    vehicle.close()
    return states


@pytest.mark.heavy
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "hexa-00"])
def test_a_run_without_a_log_is_the_same_and_encodes_nothing(
    profile: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logged = flown(profile, tmp_path)
    asked: set[tuple[type[imc.Message], bool]] = set()
    passage = Codec.round_trip_function

    def noted(codec: Codec, kind: type[imc.Message], encodes: bool) -> Passage:
        asked.add((kind, encodes))
        return passage(codec, kind, encodes)

    monkeypatch.setattr(Codec, "round_trip_function", noted)
    alone = flown(profile, tmp_path / "alone", "Transports.Logging:Enabled=Never")
    assert len(logged) > 5000
    assert {type(message) for message in logged} >= {imc.SimulatedState, imc.EstimatedState}
    assert alone == logged
    assert (imc.SimulatedState, False) in asked
    assert (imc.SimulatedState, True) not in asked
    assert not (tmp_path / "alone" / "log").exists()
