"""The logs that the page lists: found by key, never outside their folder, whatever happens to the files meanwhile."""

import os
import shutil

import pytest

import imc
from shoal.console.logs.log_library import MOST_LOGS, LogLibrary, LogLibraryError
from tests.log_messages import at


def write_log(folder, name, seconds=10):
    place = folder / name
    place.mkdir(parents=True)
    packets = [imc.encode(at(second, imc.Heartbeat)) for second in range(seconds + 1)]
    (place / "Data.lsf").write_bytes(b"".join(packets))
    (place / "Output.txt").write_text("a line\n")
    return place


def test_the_newest_log_is_first_with_its_system_times_and_files(tmp_path):
    for name in ("20260101/000005_dive", "20260102/120000", "20251231/235959"):
        write_log(tmp_path, name)
    rows = LogLibrary(tmp_path).rows()
    assert [row["name"] for row in rows] == ["20260102/120000", "20260101/000005_dive", "20251231/235959"]
    assert (rows[0]["system"], rows[0]["seconds"], rows[0]["problem"]) == ("lauv-noptilus-1", 10.0, "")
    assert [each["name"] for each in rows[0]["files"]] == ["Data.lsf", "Output.txt"]
    assert rows[0]["bytes"] == sum(each["bytes"] for each in rows[0]["files"])


@pytest.mark.parametrize(
    "name", ["../secret", "/etc/passwd", "..", ".", "", "a/b", "Data.lsf/../../secret", "\0", "link"]
)
def test_no_name_of_a_file_leads_out_of_the_log(tmp_path, name):
    (tmp_path / "secret").write_text("secret")
    place = write_log(tmp_path / "log", "20260101/000005")
    (place / "link").symlink_to(tmp_path / "secret")
    library = LogLibrary(tmp_path / "log")
    (row,) = library.rows()
    with pytest.raises(LogLibraryError):
        library.open(row["key"], name)


@pytest.mark.parametrize("key", ["", "../..", "0123456789abcdef"])
def test_no_key_but_those_of_the_list_is_a_log(tmp_path, key):
    write_log(tmp_path, "20260101/000005")
    library = LogLibrary(tmp_path)
    library.rows()
    with pytest.raises(LogLibraryError, match="not in the list"):
        library.path(key)


def test_links_to_logs_elsewhere_are_not_listed(tmp_path):
    outside = write_log(tmp_path / "outside", "20260101/000005")
    inside = tmp_path / "log" / "20260101" / "000006"
    inside.mkdir(parents=True)
    (inside / "Data.lsf").symlink_to(outside / "Data.lsf")
    (tmp_path / "log" / "20260102").symlink_to(outside.parent, target_is_directory=True)
    assert LogLibrary(tmp_path / "log").rows() == []


def test_a_file_that_becomes_a_link_or_a_pipe_after_the_list_is_not_given(tmp_path):
    place = write_log(tmp_path / "log", "20260101/000005")
    (tmp_path / "secret").write_text("secret")
    library = LogLibrary(tmp_path / "log")
    (row,) = library.rows()
    (place / "Output.txt").unlink()
    (place / "Output.txt").symlink_to(tmp_path / "secret")
    with pytest.raises(LogLibraryError, match=r"Output\.txt"):
        library.open(row["key"], "Output.txt")
    (place / "Output.txt").unlink()
    os.mkfifo(place / "Output.txt")
    with pytest.raises(LogLibraryError, match="is not a file"):
        library.open(row["key"], "Output.txt")


def test_a_log_that_is_removed_is_named_and_an_open_file_of_it_is_read_to_its_end(tmp_path):
    place = write_log(tmp_path, "20260101/000005")
    library = LogLibrary(tmp_path)
    (row,) = library.rows()
    found = library.open(row["key"], "Data.lsf")
    shutil.rmtree(place)
    with found.file as file:
        assert len(file.read()) == found.size > 100
    with pytest.raises(LogLibraryError, match=r"Data\.lsf: No such file"):
        library.open(row["key"], "Data.lsf")
    assert library.rows() == []


def test_damaged_empty_and_hostile_logs_are_listed_with_their_problem(tmp_path):
    for name, content in (("empty", b""), ("noise", os.urandom(5000)), ("<img src=x>\x1b[2J", b"x")):
        (tmp_path / "20260101" / name).mkdir(parents=True)
        (tmp_path / "20260101" / name / "Data.lsf").write_bytes(content)
    rows = LogLibrary(tmp_path).rows()
    assert {row["problem"] for row in rows} == {"empty", "no message in it"}
    assert all(row["seconds"] is None for row in rows)
    assert "\x1b" not in "".join(str(row["name"]) for row in rows)


def test_only_a_log_that_has_changed_is_read_again_and_the_list_is_limited(tmp_path, monkeypatch):
    for number in range(MOST_LOGS + 3):
        (tmp_path / "20260101" / f"{number:06}").mkdir(parents=True)
        (tmp_path / "20260101" / f"{number:06}" / "Data.lsf").write_bytes(b"")
    read = []
    from shoal.console.logs import log_library

    look = log_library.log_overview
    monkeypatch.setattr(log_library, "log_overview", lambda *given: read.append(given[0]) or look(*given))
    library = LogLibrary(tmp_path)
    assert len(library.rows()) == MOST_LOGS == len(read)
    newest = tmp_path / "20260101" / f"{MOST_LOGS + 2:06}" / "Data.lsf"
    newest.write_bytes(imc.encode(at(0, imc.Heartbeat)))
    library.rows()
    assert read[MOST_LOGS:] == [newest]


def test_logs_that_are_named_are_the_list_and_a_folder_that_is_missing_has_none(tmp_path):
    place = write_log(tmp_path, "20260101/000005")
    assert [row["name"] for row in LogLibrary(tmp_path / "none", [place]).rows()] == ["000005"]
    assert LogLibrary(tmp_path / "none").rows() == []
