"""A file has its old content or the new one, whatever happens while it is written."""

import errno
import os
import re
import stat
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from runtime.profile import write_sections
from support.atomic_files import new_file, new_folder, remove_file, replace_file, write_file, write_output
from tests.outside import largest_file


@pytest.fixture
def calls(monkeypatch):
    """What the system was asked for, in order, by the names of the files."""
    made = []

    def watch(name):
        real = getattr(os, name)

        def call(*args, **options):
            what = args[0]
            named = os.readlink(f"/proc/self/fd/{what}") if isinstance(what, int) else os.fspath(what)
            result = real(*args, **options)
            made.append((name, re.sub(r"\.[0-9a-f]{8}\.part$", ".part", Path(named).name)))
            return result

        monkeypatch.setattr(os, name, call)

    for name in ("fsync", "replace", "unlink"):
        watch(name)
    return made


def test_content_is_on_the_disk_before_its_name_and_the_name_before_it_returns(tmp_path, calls):
    write_file(tmp_path / "a.imc", b"new")
    assert (tmp_path / "a.imc").read_bytes() == b"new"
    assert calls == [("fsync", "a.imc.part"), ("replace", "a.imc.part"), ("fsync", tmp_path.name)]


def test_all_that_replace_files_put_the_content_on_the_disk_before_its_name(tmp_path, calls):
    """A power cut after a rename alone leaves an empty file."""
    (tmp_path / "folder").mkdir()

    def in_file():
        with new_file(tmp_path / "a", force=True) as part:
            part.write_text("new")

    def in_folder():
        with new_folder(tmp_path / "folder", force=True) as part:
            (part / "a").write_text("new")

    def in_results():
        with replace_file(tmp_path / "a") as file:
            file.write(b"new")

    for write in (in_file, in_folder, in_results, lambda: write_sections(tmp_path / "a", {"A": {"B": "new"}})):
        calls.clear()
        write()
        (renamed,) = [place for place, (name, _) in enumerate(calls) if name == "replace"]
        assert calls[renamed - 1] == ("fsync", calls[renamed][1])
        assert calls[renamed + 1][0] == "fsync"


def test_what_can_be_made_again_is_whole_without_waiting_for_the_disk(tmp_path, calls):
    with replace_file(tmp_path / "a", durable=False) as file:
        file.write(b"new")
    assert (tmp_path / "a").read_bytes() == b"new"
    assert calls == [("replace", "a.part")]


def test_two_may_replace_a_file_at_once(tmp_path):
    """As two commands that note which vehicles there are."""
    path = tmp_path / "a"
    contents = [bytes([number]) * 1000 * number for number in range(1, 5)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda number: write_file(path, contents[number % 4]), range(40)))
    assert path.read_bytes() in contents
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_program_has_left_is_removed_after_an_hour(tmp_path):
    path = tmp_path / "a[1].imc"
    code = "import os, sys; from pathlib import Path; from support.atomic_files import replace_file\n"
    code += "with replace_file(Path(sys.argv[1])) as file: file.write(b'half'); file.flush(); os._exit(9)"
    for _ in range(2):
        assert subprocess.run([sys.executable, "-c", code, str(path)]).returncode == 9
    old, recent = tmp_path.iterdir()
    os.utime(old, (0.0, old.stat().st_mtime - 3700.0))
    other = tmp_path / "a1.imc.0123abcd.part"
    other.write_bytes(b"of another file")
    os.utime(other, (0.0, 0.0))
    write_file(path, b"new")
    assert set(tmp_path.iterdir()) == {path, recent, other}


def test_an_error_of_another_file_keeps_its_name(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"old")
    with pytest.raises(FileNotFoundError, match=re.escape(str(tmp_path / "source"))), replace_file(path) as file:
        file.write((tmp_path / "source").read_bytes())
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == {"a": b"old"}


def test_a_new_folder_is_on_the_disk_too(tmp_path, calls):
    write_file(tmp_path / "x" / "y" / "a", b"new")
    assert calls[:2] == [("fsync", tmp_path.name), ("fsync", "x")]
    assert calls[-1] == ("fsync", "y")


def test_the_files_of_a_new_folder_are_on_the_disk_before_its_name(tmp_path, calls):
    with new_folder(tmp_path / "log") as part:
        (part / "Data.lsf.gz").write_bytes(b"new")
    names = [name for name, _ in calls]
    assert calls[0] == ("fsync", "Data.lsf.gz")
    assert names == ["fsync", "fsync", "replace", "fsync"]


def test_the_first_of_two_writers_of_a_folder_has_it_and_the_other_is_refused(tmp_path):
    def write_twice():
        with new_folder(tmp_path / "log") as part:
            (part / "a").write_text("late")
            with new_folder(tmp_path / "log") as other:
                (other / "b").write_text("first")

    with pytest.raises(FileExistsError, match="already exists"):
        write_twice()
    assert [file.name for file in tmp_path.iterdir()] == ["log"]
    assert {file.name: file.read_text() for file in (tmp_path / "log").iterdir()} == {"b": "first"}


def test_a_folder_that_another_program_makes_meanwhile_is_not_written_to(tmp_path):
    def write_while_it_is_made():
        with new_folder(tmp_path / "log"):
            (tmp_path / "log").mkdir()

    with pytest.raises(FileExistsError, match="already exists"):
        write_while_it_is_made()
    assert not list((tmp_path / "log").iterdir())


def test_what_a_killed_program_has_left_of_a_folder_is_removed_after_an_hour(tmp_path):
    old, recent = (tmp_path / f"log.0123abc{digit}.part" for digit in "de")
    for part in (old, recent):
        part.mkdir()
        (part / "a").write_text("half")
        os.utime(part, (0.0, 0.0))
    os.utime(old / "a", (0.0, 0.0))
    with new_folder(tmp_path / "log"):
        pass
    assert set(tmp_path.iterdir()) == {tmp_path / "log", recent}


def test_a_place_where_no_folder_can_be_made_is_named_as_it_was_given(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="Not a directory") as caught, new_folder(tmp_path / "file" / "log"):
        pass
    assert caught.value.filename == str(tmp_path / "file" / "log")


def test_what_is_removed_stays_removed(tmp_path, calls):
    write_file(tmp_path / "a", b"old")
    calls.clear()
    remove_file(tmp_path / "a")
    remove_file(tmp_path / "a")
    remove_file(tmp_path / "no folder" / "a")
    assert list(tmp_path.iterdir()) == []
    assert calls[-1] == ("fsync", tmp_path.name)


@pytest.mark.parametrize("failing", ["fsync", "replace"])
def test_the_old_content_survives_a_failure_which_names_the_file(tmp_path, monkeypatch, failing):
    path = tmp_path / "a.imc"
    write_file(path, b"old")

    def fail(*_):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, failing, fail)
    with pytest.raises(OSError, match=re.escape(str(path))) as caught:
        write_file(path, b"new")
    assert (caught.value.errno, caught.value.filename) == (errno.EIO, str(path))
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == {"a.imc": b"old"}


def test_the_old_content_survives_a_full_disk_which_names_the_file(tmp_path):
    path = tmp_path / "a.imc"
    write_file(path, b"old")
    code = "import sys; from pathlib import Path; from support.atomic_files import write_file\n"
    code += "try: write_file(Path(sys.argv[1]), bytes(100_000))\n"
    code += "except OSError as error: print(error.errno, error.filename)"
    with largest_file(50_000):
        done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True)
    assert done.stdout.split() == [str(errno.EFBIG), str(path)], done.stderr
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == {"a.imc": b"old"}


def test_a_file_where_a_folder_should_be_is_named(tmp_path):
    (tmp_path / "x").write_text("")
    with pytest.raises(OSError, match=re.escape(str(tmp_path / "x"))):
        write_file(tmp_path / "x" / "a", b"")


def test_permissions_are_those_asked_for_or_what_the_umask_leaves(tmp_path):
    path, mask = tmp_path / "a", os.umask(0o027)
    try:
        write_file(path, b"")
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
        write_file(path, b"", 0o604)
        assert stat.S_IMODE(path.stat().st_mode) == 0o604
    finally:
        os.umask(mask)


def test_an_output_goes_through_links_keeps_permissions_and_leaves_devices(tmp_path):
    target, link, pipe = tmp_path / "target", tmp_path / "link", tmp_path / "pipe"
    write_file(target, b"old", 0o600)
    link.symlink_to(target)
    write_output(link, b"new")
    assert (link.is_symlink(), target.read_bytes(), stat.S_IMODE(target.stat().st_mode)) == (True, b"new", 0o600)
    os.mkfifo(pipe)
    with ThreadPoolExecutor() as pool:
        read = pool.submit(pipe.read_bytes)
        write_output(pipe, b"piped")
        assert read.result(10.0) == b"piped"
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    reader, writer = os.pipe()
    write_output(Path(f"/dev/fd/{writer}"), b"through a link to no path")  # as /dev/stdout
    assert os.read(reader, 100) == b"through a link to no path"
    os.close(reader)
    os.close(writer)
    with pytest.raises(OSError, match=re.escape(str(tmp_path))):
        write_output(tmp_path, b"")
    with largest_file(10), pytest.raises(OSError, match=re.escape(str(target))):
        write_output(link, bytes(100))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "pipe", "target"]
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize("number", [errno.EBUSY, errno.EACCES])
def test_an_output_that_cannot_be_replaced_is_overwritten(number, tmp_path, monkeypatch):
    target = tmp_path / "target"
    target.write_bytes(b"older and longer")

    def fail(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "replace", fail)
    write_output(target, b"new")
    assert target.read_bytes() == b"new"
    with pytest.raises(OSError, match=re.escape(str(tmp_path / "other"))):
        write_output(tmp_path / "other", b"new")
    monkeypatch.setattr(os, "access", lambda *_: False)  # as of a user who is not root
    with pytest.raises(PermissionError, match=re.escape(str(target))):
        write_output(target, b"newer")
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]
