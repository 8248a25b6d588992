"""The stand-in is true to AirSim: its genuine clients from PyPI are served by it."""

import subprocess
import sys

import numpy as np
import pytest

from tests.tasks.vision.airsim_standin import SETTINGS, StandIn

# What pip needs is not told by the old package: its setup.py imports what it would install.
INSTALL = {
    "airsim": (["numpy<2", "setuptools<80", "wheel"], ["msgpack-rpc-python"], ["--no-deps", "airsim==1.8.1"]),
    "cosysairsim": (["setuptools<80", "wheel"], ["cosysairsim==3.5.0"]),
}
PROGRAM = """
import sys
import types
sys.modules.setdefault("cv2", types.ModuleType("cv2"))
import {package} as airsim
import numpy as np

client = airsim.VehicleClient(port={port}, timeout_value=10)
client.confirmConnection()
pose = airsim.Pose(airsim.Vector3r(1.0, 2.0, -3.0), airsim.Quaternionr(0.0, 0.0, 0.6, 0.8))
client.simSetVehiclePose(pose, True)
names = {names}
compressed = {compressed}
responses = client.simGetImages([airsim.ImageRequest(n, airsim.ImageType.Scene, False, compressed) for n in names])
for name, response in zip(names, responses):
    if compressed:
        assert response.image_data_uint8[:4] == b"\\x89PNG"
        continue
    pixels = np.frombuffer(response.image_data_uint8, dtype=np.uint8)
    assert pixels.size == response.width * response.height * 3
    np.save(name + ".npy", pixels.reshape(response.height, response.width, 3))
info = client.simGetCameraInfo("fisheye_down")
assert info.fov == 89.90362548828125 and abs(info.proj_mat.matrix[0][1] - 1.0) < 1e-6
state = client.simGetGroundTruthKinematics()
assert (state.position.x_val, state.orientation.w_val, state.linear_velocity.y_val) == (1.0, 0.8, 3.0)
try:
    client.simGetImages([airsim.ImageRequest("nothing", airsim.ImageType.Scene, False, False)])
except Exception as error:
    print("refused:", error)
"""


@pytest.mark.heavy
@pytest.mark.parametrize("package", INSTALL)
def test_genuine_clients_get_what_airsim_would_send(package, tmp_path):
    folder = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = folder / "bin" / "python"
    for words in INSTALL[package]:
        command = [python, "-m", "pip", "install", "-q", "--no-build-isolation", *words]
        subprocess.run(command, check=True, timeout=280)
    names = list(SETTINGS)[:5]
    with StandIn(48, 48, version=1 if package == "airsim" else 4) as server:
        for compressed in (False, True):
            program = PROGRAM.format(package=package, port=server.port, names=names, compressed=compressed)
            done = subprocess.run([python, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=60)
            assert done.returncode == 0, done.stdout + done.stderr
            assert "refused: rpclib: no camera 'nothing'" in done.stdout
        for name in names:
            np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy")[..., ::-1], server.pixels(name))
