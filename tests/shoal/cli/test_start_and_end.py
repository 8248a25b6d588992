"""The start and the end of a command: no imports that are not needed, and no search for garbage at the end."""

import subprocess
import sys


def _python(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=120)
    return done.stdout


def test_a_run_begins_without_the_readers_of_plan_files_and_expressions():
    found = _python(
        "import sys, shoal.cli.run\n"
        "from autonomy.plans import parse_condition\n"
        "parse_condition('ManeuverIsDone')\n"
        "print(*[name for name in ('shoal.missions', 'support.expressions', 'imc.expressions') if name in sys.modules])"
    )
    assert found.split() == []


def test_the_end_of_a_command_leaves_all_that_there_is_to_the_system():
    found = _python(
        "import atexit, gc\n"
        "atexit.register(lambda: print('left out:', gc.get_freeze_count()))\n"
        "from shoal.cli import main\n"
        "main(['message', 'Abort'])"
    )
    assert int(found.partition("left out:")[2]) > 10_000
