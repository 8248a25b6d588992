"""Which logs belong to one run."""

from pathlib import Path

import pytest

from runtime.logs import RUN_FILE, encode_log_run_position, logs_of_run, missing_logs, read_log_run_position


def put(root: Path, name: str, number: int, first: str = "20260101/230000") -> Path:
    folder = root / name
    folder.mkdir(parents=True)
    (folder / RUN_FILE).write_bytes(encode_log_run_position(first, number))
    return folder


def test_the_logs_of_a_run_are_found_over_midnight_in_order(tmp_path: Path) -> None:
    first = put(tmp_path, "20260101/230000", 1)
    plan = put(tmp_path, "20260101/235900_plan", 2)
    last = put(tmp_path, "20260102/000100", 3)
    put(tmp_path, "20260101/230000_2", 1, "20260101/230000_2")
    (tmp_path / "20260102" / "000200").mkdir()
    for log in (first, plan, last):
        assert logs_of_run(log) == [first, plan, last]
    assert missing_logs([first, plan, last]) == []


def test_a_missing_log_is_named(tmp_path: Path) -> None:
    logs = [put(tmp_path, f"20260101/23000{number}", number) for number in (2, 5)]
    assert logs_of_run(logs[1]) == logs
    assert missing_logs(logs) == [1, 3, 4]


def test_a_log_that_does_not_say_is_alone(tmp_path: Path) -> None:
    put(tmp_path, "20260101/230000", 1)
    folder = tmp_path / "20260101" / "230100"
    folder.mkdir()
    assert logs_of_run(folder) == [folder]


def test_two_logs_with_the_same_number_are_refused(tmp_path: Path) -> None:
    one = put(tmp_path, "20260101/230000", 1)
    put(tmp_path, "20260101/230000 copy", 1)
    with pytest.raises(ValueError, match=r"log 1 of the run exists several times: .*230000, .*230000 copy"):
        logs_of_run(one)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff",
        b"[]",
        b'{"first":"../../etc","number":1}',
        b'{"first":"20260101/../x","number":1}',
        b'{"first":"20260101/x","number":0}',
        b'{"first":"20260101/x"}',
        b'{"first":"' + b"x" * 1_000_000 + b'","number":1}',
    ],
)
def test_a_file_that_makes_no_sense_says_nothing(tmp_path: Path, content: bytes) -> None:
    (tmp_path / RUN_FILE).write_bytes(content)
    assert read_log_run_position(tmp_path) is None
