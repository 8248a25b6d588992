"""Jobs are done in processes: a process that dies or hangs loses nothing, and none stays behind."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from shoal.campaigns import Job, ProcessPool, UnreadableResult
from shoal.scenarios import ScenarioResult
from tests.outside import until

ROOT = Path(__file__).parents[4]


class Trial:
    """Does what the name of the job's file says, and counts in which process."""

    def __init__(self):
        self.done = 0

    def __call__(self, job):
        self.done += 1
        words = job.path.name.split()
        return getattr(self, words[0])(job, *words[1:])

    def tell(self, job, *_):
        return ScenarioResult(job.name, job.seed or 0, metrics={"pid": os.getpid(), "done": self.done})

    def die(self, job, number):
        os.kill(os.getpid(), int(number))

    def die_once(self, job, number):
        try:
            (job.log_root / "died").touch(exist_ok=False)
        except FileExistsError:
            return self.tell(job)
        return self.die(job, number)

    def hang(self, job, *_):
        time.sleep(1000.0)

    def scatter(self, job, *_):
        Path(tempfile.mkdtemp(), "file").write_text("left behind")
        return self.tell(job)

    def fail(self, job, *_):
        raise ZeroDivisionError("of a kind")

    def leave(self, job, *_):
        sys.exit(3)

    def search(self, job, module):
        return ScenarioResult(job.name, 0, error=str(__import__(module).__file__))


class Stillborn(Trial):
    def __init__(self):
        os._exit(7)


def jobs(*names, **more):
    return [Job(number, Path(name), **more) for number, name in enumerate(names)]


@pytest.mark.heavy
def test_each_job_is_done_once_and_processes_are_kept():
    with ProcessPool(2, make_runner=Trial) as pool:
        told = [(job.key, result.metrics) for job, result in pool.run(jobs(*["tell"] * 40))]
        again = [result.metrics["pid"] for _, result in pool.run(jobs("tell", "tell", "tell"))]
    assert sorted(key for key, _ in told) == list(range(40))
    pids = {metrics["pid"] for _, metrics in told}
    assert 1 <= len(pids) <= 2
    assert os.getpid() not in pids
    assert max(metrics["done"] for _, metrics in told) >= 20
    assert set(again) <= pids


def test_without_workers_this_process_does_the_jobs():
    with ProcessPool(0, make_runner=Trial) as pool:
        told = [result.metrics for _, result in pool.run(jobs("tell", "tell"))]
    assert told == [{"pid": os.getpid(), "done": 1}, {"pid": os.getpid(), "done": 2}]


@pytest.mark.heavy
def test_jobs_are_asked_for_when_there_is_somebody_for_them():
    asked, known = [], []

    def coming():
        for job in jobs(*["tell"] * 6):
            asked.append((job.key, len(known)))
            yield job

    with ProcessPool(2, make_runner=Trial) as pool:
        for job, _ in pool.run(coming()):
            known.append(job.key)
    assert [key for key, _ in asked] == list(range(6))
    assert all(results >= key - 1 for key, results in asked)


@pytest.mark.heavy
def test_a_job_whose_process_dies_is_done_by_another_one(tmp_path):
    with ProcessPool(2, make_runner=Trial) as pool:
        work = [*jobs("tell", "tell", "tell"), Job("x", Path("die_once 9"), seed=4, log_root=tmp_path)]
        told = {job.key: result for job, result in pool.run(work)}
    assert set(told) == {0, 1, 2, "x"}
    assert not any(result.error for result in told.values())
    assert told["x"].seed == 4


@pytest.mark.heavy
def test_processes_that_are_killed_from_outside_lose_nothing_and_double_nothing():
    told = []
    with ProcessPool(2, make_runner=Trial) as pool:
        for job, result in pool.run(jobs(*["tell"] * 30)):
            told.append(job.key)
            assert not result.error
            if job.key % 10 == 0:
                os.kill(int(result.metrics["pid"]), signal.SIGKILL)
    assert sorted(told) == list(range(30))


@pytest.mark.heavy
def test_a_process_that_died_while_it_was_idle_costs_its_next_job_nothing(tmp_path):
    with ProcessPool(1, make_runner=Trial) as pool:
        [(_, first)] = pool.run(jobs("tell"))
        os.kill(int(first.metrics["pid"]), signal.SIGKILL)
        [(_, result)] = pool.run([Job("x", Path("die_once 9"), log_root=tmp_path)])
    assert not result.error


@pytest.mark.heavy
def test_a_job_that_kills_two_processes_is_a_result():
    with ProcessPool(1, make_runner=Trial) as pool:
        told = {job.key: result for job, result in pool.run(jobs("tell", "die 11", "tell"))}
    assert [bool(told[key].error) for key in range(3)] == [False, True, False]
    assert told[1].error == "2 processes that ran it ended (SIGSEGV)"
    assert not told[1].passed


@pytest.mark.heavy
def test_a_job_that_hangs_ends_at_the_limit_and_is_reported_where():
    with ProcessPool(2, make_runner=Trial, wall_limit=0.5) as pool:
        told = {job.key: result for job, result in pool.run(jobs("hang", "tell", "tell"))}
    assert told[0].error.startswith("not done after 0.5 s of wall time: in ")
    assert f"{Path(__file__).name}:" in told[0].error
    assert "(hang)" in told[0].error
    assert not told[1].error
    assert not told[2].error


@pytest.mark.heavy
def test_what_goes_wrong_in_a_job_is_its_result():
    with ProcessPool(1, make_runner=Trial) as pool:
        told = {job.key: result for job, result in pool.run(jobs("fail", "leave", "tell"))}
    assert told[0].error.startswith("ZeroDivisionError: of a kind\nTraceback")
    assert told[1].error.startswith("SystemExit: 3\n")
    assert told[2].metrics["done"] == 3


def test_what_goes_wrong_in_this_process_is_a_result_too():
    with ProcessPool(0, make_runner=Trial) as pool:
        assert [result.error[:10] for _, result in pool.run(jobs("fail", "leave"))] == ["ZeroDivisi", "SystemExit"]


@pytest.mark.heavy
def test_processes_that_cannot_start_are_an_error():
    with (
        ProcessPool(2, make_runner=Stillborn) as pool,
        pytest.raises(OSError, match="end before they can work: exit status 7"),
    ):
        list(pool.run(jobs("tell", "tell")))


@pytest.mark.heavy
def test_who_has_heard_enough_may_leave_and_ask_again():
    with ProcessPool(2, make_runner=Trial) as pool:
        for job, _ in pool.run(jobs("hang", "tell")):
            assert job.key == 1
            break
        assert [result.name for result, _ in pool.run(jobs("tell"))] == ["tell"]


@pytest.mark.heavy
def test_folders_of_a_user_are_searched(tmp_path):
    (tmp_path / "of_the_user.py").write_text("")
    with ProcessPool(1, make_runner=Trial, code=[tmp_path]) as pool:
        [(_, result)] = pool.run(jobs("search of_the_user"))
    assert result.error == str(tmp_path / "of_the_user.py")


@pytest.mark.heavy
def test_nothing_stays_in_the_folder_of_temporary_files(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with ProcessPool(1, make_runner=Trial, wall_limit=0.2) as pool:
        told = [result.error for _, result in pool.run(jobs("scatter", "hang", "scatter"))]
        assert [bool(error) for error in told] == [False, True, False]
        assert list(tmp_path.rglob("file"))
    assert not list(tmp_path.iterdir())


def test_a_wrong_file_can_be_told_from_a_failed_run():
    [job] = jobs("folder/name.scenario.yaml")
    assert job.failed_result("no such file", UnreadableResult) == UnreadableResult("name", 0, error="no such file")
    assert not job.failed_result("x").passed


PROGRAM = """
from pathlib import Path
from shoal.campaigns import Job, ProcessPool
from tests.shoal.campaigns.jobs.test_pool import Trial

if __name__ == "__main__":
    with ProcessPool(2, make_runner=Trial) as pool:
        for job, result in pool.run([Job(n, Path("hang" if n > 3 else "tell")) for n in range(6)]):
            print(int(result.metrics["pid"]), flush=True)
"""


@pytest.mark.heavy
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_stays_behind(tmp_path, number):
    """Ctrl-C goes to all processes of a terminal; other signals, often, to one."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    folder = tmp_path / "temporary"
    folder.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(folder)}
    process = subprocess.Popen(
        [sys.executable, program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        start_new_session=True,
    )  # fmt: skip
    pids = [int(process.stdout.readline()) for _ in range(4)]
    if number == signal.SIGINT:
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, said = process.communicate(timeout=20.0)
    assert process.returncode == -number
    until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in pids))
    until(lambda: not list(folder.iterdir()))
    assert said.count("Traceback") == (1 if number == signal.SIGINT else 0)
