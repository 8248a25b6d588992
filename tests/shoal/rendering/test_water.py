"""What is in the water of a run is in the pictures that are rendered after it."""

import pytest

import imc
from shoal.rendering import render_log
from tests.shoal.cli.log.test_render import sailed, same

CAMERA = """
[Vision.Camera]
Enabled = Always
Frame Rate = 4
Width = 60
Height = 45
Save Images = true
"""
WATER = "[World]\nMarine Snow = 100\nCaustics = 1\n"


@pytest.mark.heavy
def test_pictures_rendered_afterwards_have_the_water_of_the_run(tmp_path):
    clear, snowy = tmp_path / "clear.ini", tmp_path / "snowy.ini"
    clear.write_text(CAMERA)
    snowy.write_text(CAMERA + WATER)
    log, *_ = sailed("lauv-noptilus-1", tmp_path / "run", snowy, seconds=2.0)
    render_log(imc.Log(log), tmp_path / "out", processes=1, labels=False)
    assert same(tmp_path / "out/Photos", log / "Photos")
    without, *_ = sailed("lauv-noptilus-1", tmp_path / "clear", clear, seconds=2.0)
    assert not same(without / "Photos", log / "Photos")
