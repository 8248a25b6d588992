"""The commands of docs/deploy.md for a boat without internet: what they collect is enough to install and run."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


def commands():
    section = (ROOT / "docs" / "deploy.md").read_text().split("## Without internet")[1].split("\n## ")[0]
    return re.findall(r"```bash\n(.*?)\n```", section, re.DOTALL)


@pytest.mark.heavy
def test_a_wheelhouse_installs_without_an_index(tmp_path, apart):
    collect, install = commands()
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "boat"], check=True)
    pip = f"{tmp_path}/boat/bin/pip"
    collect = collect.replace("python3 -m pip", pip).replace("/path/to/shoal", str(ROOT))
    subprocess.run(["bash", "-euc", collect], cwd=tmp_path, check=True, capture_output=True)
    without = [*apart, "bash", "-euc", install.replace("sudo /opt/shoal/bin/pip", pip)]
    subprocess.run(without, cwd=tmp_path, check=True, capture_output=True)
    line = "run lauv-noptilus-1 -p Simulation --clock virtual --for 5s --bus inprocess"
    done = subprocess.run([f"{tmp_path}/boat/bin/shoal", *line.split()], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "log").rglob("Data.lsf.gz"))
