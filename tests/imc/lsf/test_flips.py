"""Bits that flip in an indexed log of a shipped profile, or in its index, never give wrong rows silently."""

import sys
from collections import Counter
from importlib import util
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[3] / "bench" / "flips.py"
spec = util.spec_from_file_location("flips", BENCH)
assert spec
assert spec.loader
bench = util.module_from_spec(spec)
sys.modules["flips"] = bench
spec.loader.exec_module(bench)


@pytest.fixture(scope="module")
def packets(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return bench.packets_of_profile(tmp_path_factory.mktemp("run"), seconds=3.0)


@pytest.mark.heavy
@pytest.mark.parametrize("form", bench.FORMS)
def test_no_flip_is_silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, packets: bytes, form: str) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = bench.write(tmp_path / form / "Data.lsf", packets, form)
    results = list(bench.flips(path, 12, seed=1))
    assert [result for result in results if result.startswith("silent")] == []
    assert Counter(results)["reported"] >= 1
