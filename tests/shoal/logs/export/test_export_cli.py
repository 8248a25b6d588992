"""`shoal log export` and `import` as users run them."""

import sys
from pathlib import Path

import pytest

import imc
from runtime.logs import summarize
from shoal.logs.edit.tlog_import import import_tlog
from shoal.logs.export import LogSource
from shoal.logs.export.csv import export_csv
from shoal.logs.export.euroc import export_euroc
from shoal.logs.export.llf import export_llf
from shoal.logs.export.tum_rgbd import export_tum_rgbd
from tests import command
from tests.mavlink.flights import DataFlashWriter, ULogWriter
from tests.outside import largest_file

LOGS = Path(__file__).parents[3] / "data" / "logs"
HEADER = {"src": 0x1A, "src_ent": 7}


@pytest.fixture
def shoal(tmp_path, monkeypatch):
    """Runs `shoal log ...` in the test's folder; returns exit code and output."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        result = command.shoal("log", *arguments)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run


@pytest.fixture
def rpms(make_log):
    """Rpm 0 to 99, one per second."""
    return make_log([imc.Rpm(value=number, timestamp=1.7e9 + number, **HEADER) for number in range(100)])


@pytest.mark.parametrize(
    ("form", "made"),
    [("mcap", "log.mcap"), ("netcdf", "log.nc"), ("parquet", "log-parquet"), ("csv", "log-csv"), ("llf", "log-llf")],
)
def test_every_format_has_a_name_of_its_own(shoal, rpms, form, made, tmp_path):
    code, said = shoal("export", rpms, "--format", form)
    assert code == 0, said
    assert f"in {made}" in said
    assert (tmp_path / made).exists()
    assert not list(tmp_path.glob("*.part"))


def test_a_log_goes_out_and_comes_back(shoal, tmp_path):
    assert shoal("export", LOGS / "dune-idle", "idle.mcap")[0] == 0
    code, said = shoal("import", "idle.mcap")
    assert (code, said) == (0, "6 647 messages: idle\n")
    packets = [[packet for _, packet in imc.Log(log).packets()] for log in (LOGS / "dune-idle", tmp_path / "idle")]
    assert packets[0] == packets[1]


def test_the_ending_of_the_name_says_the_format(shoal, rpms, tmp_path):
    assert shoal("export", rpms, "a.csv")[0] == 0
    assert (tmp_path / "a.csv" / "Rpm.csv").is_file()
    assert shoal("export", rpms, "a.nc")[0] == 0
    assert (tmp_path / "a.nc").read_bytes().startswith(b"\x89HDF")
    code, said = shoal("export", rpms, "a.xyz")
    assert (code, "unknown ending '.xyz'; choose a format with --format" in said) == (2, True)
    assert shoal("export", rpms, "a.xyz", "--format", "llf")[0] == 0
    assert shoal("export", rpms, "a-csv")[0] == 0
    assert (tmp_path / "a-csv" / "Rpm.csv").is_file(), "as the name that an export has by itself"


def test_a_part_is_chosen(shoal, rpms, tmp_path):
    code, said = shoal("export", rpms, "a.csv", "--from", "10", "--to", "20s", "-m", "Rpm")
    assert code == 0, said
    rows = (tmp_path / "a.csv" / "Rpm.csv").read_text().splitlines()[1:]
    assert [row.rsplit(",", 1)[1] for row in rows] == [str(number) for number in range(10, 20)]


def test_a_part_without_messages_is_refused(shoal, rpms, tmp_path):
    code, said = shoal("export", rpms, "a.csv", "-m", "EstimatedState")
    assert (code, "no message is selected" in said) == (2, True)
    assert not (tmp_path / "a.csv").exists()


def test_unknown_names_are_refused(shoal, rpms):
    code, said = shoal("export", rpms, "-m", "EstimatedStat")
    assert (code, "EstimatedState" in said) == (2, True)


def test_what_exists_is_replaced_only_by_force(shoal, rpms, tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"mine")
    (tmp_path / "b.csv").mkdir()
    (tmp_path / "b.csv" / "notes.txt").write_text("mine")
    for out in ("a.mcap", "b.csv"):
        code, said = shoal("export", rpms, out)
        assert (code, "already exists" in said) == (2, True)
    assert (tmp_path / "a.mcap").read_bytes() == b"mine"
    for out in ("a.mcap", "b.csv"):
        assert shoal("export", rpms, out, "--force")[0] == 0
    assert (tmp_path / "a.mcap").stat().st_size > 1000
    assert sorted(path.name for path in (tmp_path / "b.csv").iterdir()) == ["Rpm.csv", "notes.txt"]
    assert shoal("import", "a.mcap", rpms)[0] == 2
    assert len(imc.Log(rpms)) == 100


@pytest.mark.parametrize("form", ["mcap", "netcdf", "parquet", "csv", "llf"])
def test_a_full_disk_leaves_nothing_behind(shoal, tmp_path, form):
    with largest_file(3000):
        code, said = shoal("export", LOGS / "dune-idle", "-f", form)
    assert (code, "too large" in said.lower(), "None" in said) == (2, True, False), said
    assert not list(tmp_path.iterdir())


def test_damage_is_reported_and_the_rest_exported(shoal, make_log):
    packets = [imc.encode(imc.Rpm(value=number, timestamp=1.7e9, **HEADER)) for number in range(9)]
    packets[4] = b"garbage"
    code, said = shoal("export", make_log([*packets, imc.encode(imc.Unknown(id=9999, timestamp=1.7e9))]), "a.csv")
    assert code == 0
    assert "9 messages of the log: 8 rows in a.csv" in said
    assert "skipped: 1 message: message id 9999 is unknown" in said
    assert "skipped: byte 96: 7 bytes" in said


def test_empty_logs_and_other_files_are_refused(shoal, make_log, tmp_path):
    code, said = shoal("export", make_log([]))
    assert (code, "no message in this log" in said) == (2, True)
    assert shoal("export", tmp_path / "nowhere")[0] == 2
    (tmp_path / "a.tlog").write_bytes(b"garbage" * 100)
    code, said = shoal("import", "a.tlog")
    assert (code, "a.tlog: not an MCAP, .tlog, .BIN or .ulg file: no autopilot in its 700 bytes" in said) == (2, True)
    assert not (tmp_path / "a").exists()


def test_what_has_to_be_imported_is_said(shoal):
    code, said = shoal("info", LOGS / "ardusub.tlog")
    assert (code, f"convert it with shoal log import {LOGS / 'ardusub.tlog'}" in said) == (2, True)


def test_a_tlog_is_imported_under_a_name(shoal, tmp_path):
    code, said = shoal("import", LOGS / "ardusub.tlog", "dive", "--system", "bluerov")
    assert code == 0
    assert "337 bytes" in said
    assert next(imc.Log(tmp_path / "dive").messages("Announce")).sys_name == "bluerov"


FLIGHTS = {
    "a.BIN": DataFlashWriter().add(1.0, "MSG", Message="ArduSub V4.1.1").data,
    "a.ulg": ULogWriter()
    .text(1.0, 6, "hello" * 20)
    .text(2.0, 6, "again" * 20)
    .text(3.0, 6, "hello" * 20)
    .text(4.0, 6, "again")
    .data,
}


@pytest.mark.parametrize("name", FLIGHTS)
def test_the_logs_of_autopilots_are_imported_and_what_is_damaged_is_reported(shoal, tmp_path, name):
    (tmp_path / name).write_bytes(FLIGHTS[name] + bytes(100) + FLIGHTS[name][-100:])
    code, said = shoal("import", name, "flight")
    assert (code, f"bytes of {name} skipped: in no whole record" in said) == (0, True), said
    assert f"{name}: no GPS has given the time" in said
    assert imc.Log(tmp_path / "flight").counts()["Announce"] == 1


@pytest.mark.parametrize("name", ["a.BIN", "a.ulg", "a.tlog", "a"])
@pytest.mark.parametrize("data", [b"", b"\xff" * 5_000_000], ids=["empty", "garbage"])
def test_garbage_is_refused_by_name_and_leaves_no_folder(shoal, tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    code, said = shoal("import", name, "flight")
    assert (code, f"{name}: " in said, len(said) < 200) == (2, True, True), said
    assert not (tmp_path / "flight").exists()


def test_progress_is_a_share_of_the_file(tmp_path):
    """It was the number of bytes, so the bar was full at once."""
    told = []
    (tmp_path / "log").mkdir()
    import_tlog(LOGS / "ardusub.tlog", tmp_path / "log", progress=told.append)
    assert told
    assert all(0.0 < share <= 1.0 for share in told)


@pytest.mark.parametrize("write", [export_csv, export_euroc, export_tum_rgbd, export_llf])
def test_progress_of_an_export_is_a_share_of_the_log(write, make_log, tmp_path):
    log = imc.Log(make_log([imc.encode(imc.Rpm(value=n, src=0x1A, timestamp=1.7e9 + n)) for n in range(50)]))
    told = []
    (tmp_path / "out").mkdir()
    write(LogSource(log, summarize(log)), tmp_path / "out", progress=told.append)
    assert told
    assert all(0.0 < share <= 1.0 for share in told)
    assert told[-1] == 1.0


def test_a_missing_extra_is_named(shoal, rpms, monkeypatch):
    for module in ("mcap", "pyarrow", "zstandard", "netCDF4"):
        monkeypatch.setitem(sys.modules, module, None)
    for module in ("mcap", "mcap_writer", "parquet", "netcdf"):
        monkeypatch.delitem(sys.modules, f"shoal.logs.export.{module}", raising=False)
    for form in ("mcap", "parquet", "netcdf"):
        code, said = shoal("export", rpms, "-f", form)
        assert (code, "pip install 'shoal[analysis]'" in said) == (2, True), said
    assert shoal("export", rpms, "-f", "csv")[0] == 0
