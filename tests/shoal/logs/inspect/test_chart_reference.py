"""The chart that a log names, also in a configuration of others."""

from pathlib import Path

import pytest

from shoal.logs.inspect import ChartReference, read_chart_reference

HEAD = "[General]\nVehicle = lauv-noptilus-1\n"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (f"{HEAD}[Bathymetry]\nData = pool.tif\n", "pool.tif"),
        (f"{HEAD}[Bathymetry]\nData = {'x' * 5000}.tif\n", f"{'x' * 5000}.tif"),
        (f"{HEAD}[Bathymetry]\nData = 0 0 5\n", None),
        (HEAD, None),
        ("[General\n", None),
        ("\0", None),
    ],
)
def test_a_chart_that_is_not_there_is_named_whatever_the_configuration_has(
    tmp_path: Path, text: str, name: str | None
) -> None:
    (tmp_path / "Config.ini").write_text(text)
    expected = ChartReference(name, False) if name is not None else None
    assert read_chart_reference(tmp_path) == expected


def test_a_chart_beside_the_log_is_found(tmp_path: Path) -> None:
    (tmp_path / "Config.ini").write_text(f"{HEAD}[Bathymetry]\nData = pool.tif\n")
    (tmp_path / "pool.tif").write_bytes(b"")
    assert read_chart_reference(tmp_path / "Data.lsf.gz") == ChartReference("pool.tif", True)
