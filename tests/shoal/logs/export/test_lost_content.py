"""An export, a cut or a merge that loses most says so, counts it by reason, and ends with exit status 1."""

import pytest

import imc
from support.wgs84 import displace
from tests import command

HEADER = {"src": 0x1A, "src_ent": 7}
TABLES = ("mcap", "netcdf", "parquet", "csv", "llf")
SETS = ("euroc", "tum")


@pytest.fixture
def shoal(tmp_path, monkeypatch):
    """Runs `shoal ...` in the test's folder; returns exit code and output."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        result = command.shoal(*arguments)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run


def rpms(count):
    return [imc.Rpm(value=number, timestamp=1.7e9 + number, **HEADER) for number in range(count)]


def strange(count):
    """Messages that the definitions of the log do not have."""
    return [imc.Unknown(id=9999, payload=b"1", timestamp=1.7e9 + 0.5 + n, **HEADER) for n in range(count)]


@pytest.mark.parametrize("form", TABLES)
def test_an_export_of_less_than_half_is_written_and_ends_with_1(shoal, make_log, form, tmp_path):
    log = make_log([*rpms(40), *strange(60)])
    code, said = shoal("log", "export", log, "out", "--format", form, "--no-raw")
    assert code == 1, said
    assert "100 messages of the log: 40 " in said
    assert "skipped: 60 messages: message id 9999 is unknown" in said
    assert "Error: less than half of what is selected was written" in said
    assert (tmp_path / "out").exists()
    assert (
        shoal("log", "export", make_log([*rpms(60), *strange(40)], "most"), "b", "--format", form, "--no-raw")[0] == 0
    )


def test_an_mcap_with_the_packets_has_all(shoal, make_log):
    code, said = shoal("log", "export", make_log([*rpms(40), *strange(60)]), "out.mcap")
    assert (code, "skipped: 60 messages: message id 9999 is unknown" in said) == (0, True)


@pytest.mark.parametrize("form", ["netcdf", "parquet", "csv", "llf", *SETS])
def test_an_export_of_nothing_leaves_nothing(shoal, make_log, form, tmp_path):
    log = make_log(rpms(9) if form in SETS else strange(9))
    code, said = shoal("log", "export", log, "out", "--format", form)
    assert code != 0
    why = "without inertial samples: " if form in SETS else "message id 9999 is unknown"
    assert f"nothing of the log can be written as {form}; no out; " in said
    assert why in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("form", SETS)
def test_a_data_set_names_what_it_lacks(shoal, make_log, form):
    lat, lon, _ = displace(0.7, -0.15, 0.0, 1.0, 1.0)
    states = [imc.EstimatedState(lat=lat, lon=lon, timestamp=1.7e9 + n, **HEADER) for n in range(9)]
    code, said = shoal("log", "export", make_log(states), "out", "--format", form)
    assert code == 0
    assert "note: without inertial samples: " in said
    assert "note: without true motion: no SimulatedState of the vehicle" in said
    assert "estimated motion" not in said


@pytest.fixture
def damaged(make_log):
    """A log of which most bytes belong to no message."""
    return make_log([imc.encode(rpms(1)[0]), *map(imc.encode, rpms(20)), b"\x55" * 5000], "damaged", compression="none")


@pytest.mark.parametrize("words", [("export", "--format", "csv"), ("cut",), ("merge",)])
def test_a_log_of_which_most_cannot_be_read_ends_with_1(shoal, make_log, damaged, words, tmp_path):
    whole = make_log(rpms(5), "whole")
    name, *options = words
    logs = ["merge", whole, damaged, "-o", "out"] if name == "merge" else [name, damaged, "out", *options]
    code, said = shoal("log", *logs)
    assert code == 1, said
    assert "5 000 bytes" in said
    assert f"Error: less than half of {damaged}" in said
    assert (tmp_path / "out").is_dir()


def test_a_plan_of_which_a_format_keeps_less_than_half_is_written_and_ends_with_1(shoal, tmp_path):
    origin = "plan: p\norigin: 41.185°, -8.7062°\nspeed: 1 m/s\ndepth: 1\nmaneuvers:\n"
    goto, other = "- goto: {north: 40}\n", "- teleoperation: {}\n- dislodge: {rpm: 1000}\n"
    (tmp_path / "p.yaml").write_text(f"{origin}{goto}{other}")
    for suffix in (".plan", ".waypoints", ".kml", ".gpx", ".geojson"):
        code, said = shoal("export", "plan", "p.yaml", f"p{suffix}")
        assert code == 1, said
        assert "skipped: 2 of 3 maneuvers: " in said
        assert "Error: less than half of the maneuvers was written" in said
        assert (tmp_path / f"p{suffix}").is_file()
    for suffix in (".json", ".yml"):
        assert shoal("export", "plan", "p.yaml", f"p{suffix}")[0] == 0
    (tmp_path / "q.yaml").write_text(f"{origin}{goto}{goto}")
    assert shoal("export", "plan", "q.yaml", "q.plan")[0] == 0
