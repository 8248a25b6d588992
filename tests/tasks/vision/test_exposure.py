"""The sensor of a simulated camera: noise, motion blur and the rolling shutter, from its parameters."""

import math

import numpy as np
import pytest

import imc
from runtime import ParameterError
from runtime.testing import simulate
from tasks.vision.camera import Camera
from tasks.vision.fisheye_camera import FisheyeCamera

SMALL = {"width": 160, "height": 120, "field_of_view": 60.0, "frame_rate": 5.0, "visibility": 100.0}


def states(**fields):
    fields = {"alt": 3.0, "depth": 2.0, "z": 2.0, **fields}
    return [imc.EstimatedState(timestamp=n / 20, **fields) for n in range(20)]


def truths(rate=0.0, speed=0.0):
    """A vehicle that turns on the spot, or goes to the north."""
    moving = [
        imc.SimulatedState(timestamp=t, lat=0.7, lon=-0.1, x=speed * t, u=speed, z=2.0, psi=rate * t, r=rate)
        for t in np.arange(20) / 20
    ]
    return sorted([*states(), *moving], key=lambda message: message.timestamp)


def frames(kind=Camera, feed=None, **parameters):
    return simulate(kind, feed=states() if feed is None else feed, **{**SMALL, **parameters}).frames


def test_noise_is_new_in_each_frame_and_the_same_in_each_run():
    first, again = (frames(full_well=2000.0, read_noise=10.0) for _ in range(2))
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.image, other.image)
    clean = frames()
    np.testing.assert_array_equal(clean[0].image, clean[1].image)  # the vehicle stands still
    assert (first[0].image != first[1].image).mean() > 0.5
    spread = (first[0].image.astype(float) - clean[0].image)[..., :3].std()
    assert 1.0 < spread < 12.0


def test_gain_costs_photons():
    clean = frames()[0].image.astype(float)
    dim, bright = (np.std(frames(full_well=8000.0, gain=gain)[0].image - clean) for gain in (1.0, 16.0))
    assert bright == pytest.approx(4.0 * dim, rel=0.15)


@pytest.mark.parametrize("kind", [Camera, FisheyeCamera])
def test_a_sensor_without_faults_changes_nothing(kind):
    size = SMALL if kind is Camera else {"size": 96, "face_size": 64, "frame_rate": 5.0}
    plain, told = (simulate(kind, feed=states(), **size, **more).frames for more in ({}, {"exposure_time": 0.1}))
    np.testing.assert_array_equal(plain[0].image, told[0].image)  # one sample of a motion is an instant


def test_a_rolling_shutter_bends_what_turns_past_it():
    """At 1 rad/s and 0.1 s of readout, the lowest rows look 0.1 rad further than the highest, the middle the same."""
    still, rolling = (
        frames(feed=truths(rate=1.0), readout_time=seconds)[2].image.astype(int) for seconds in (0.0, 0.1)
    )
    change = np.abs(still - rolling)[..., :3].mean(axis=(1, 2))
    assert change[58:62].mean() < 0.6 * min(change[:20].mean(), change[-20:].mean())
    assert change[:20].mean() > 2.0


def test_motion_blurs_what_passes_by():
    """The true pose at the exposure is that of the middle of it."""
    sharp, smeared = (
        frames(feed=truths(speed=1.0), exposure_time=seconds, motion_blur_samples=5)[2].image[..., 1].astype(float)
        for seconds in (0.0, 0.2)
    )
    along, across = (np.diff(smeared, axis=axis).std() / np.diff(sharp, axis=axis).std() for axis in (0, 1))
    assert along < min(0.5, 0.8 * across)
    assert math.isclose(sharp.mean(), smeared.mean(), rel_tol=0.02)


def test_read_noise_needs_a_full_well():
    with pytest.raises(ParameterError, match="Full Well"):
        frames(read_noise=5.0)


def test_a_port_that_does_not_hold_its_camera_is_refused():
    for wrong in ({"housing": "Dome", "dome_offset": 0.2}, {"housing": "Flat Port", "subject_distance": 0.02}):
        with pytest.raises(ParameterError, match="Housing"):
            frames(**wrong)


def test_lamps_of_the_vehicle_light_the_night():
    night = {"settings": {"World": {"Sun Elevation": "-30"}}}
    dark, lit = (frames(**night, **lamps)[0].image for lamps in ({}, {"lamps": ["-0.6 0 0 -90 0 3000 80"]}))
    assert dark[..., :3].max() < 12
    assert lit[60, 80, :3].mean() > 60


@pytest.mark.parametrize("lamp", ["1 2 3", "0 0 0 -90 0 -5 80", "0 0 0 -90 0 3000 0", "nan 0 0 0 0 1 80"])
def test_a_lamp_that_cannot_be_is_refused(lamp):
    with pytest.raises(ParameterError, match="Lamps"):
        frames(lamps=[lamp])
