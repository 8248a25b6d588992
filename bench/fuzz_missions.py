"""Flies missions from the strategies of the tests until one fails, and shows that one in its smallest form.

`python bench/fuzz_missions.py --examples 1000 [--dynamics] [--seed 1]` with the extra `dev` installed.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "tasks" / "ideal"))

from hypothesis import HealthCheck, given, seed, settings
from missions import check, happen, happenings
from sailing import check_voyage, sail, sailings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=1000)
    parser.add_argument("--dynamics", action="store_true", help="fly the complete vehicle, about 2 s per mission")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    options = parser.parse_args()
    print(f"seed {options.seed}")
    flown = 0

    def fly(mission):
        nonlocal flown
        flown += 1
        if options.dynamics:
            check_voyage(mission, sail(mission))
        else:
            check(mission, happen(mission))

    patient = settings(
        max_examples=options.examples, database=None, deadline=None, suppress_health_check=list(HealthCheck)
    )
    try:
        patient(seed(options.seed)(given(sailings() if options.dynamics else happenings())(fly)))()
    finally:
        print(f"{flown} missions")


if __name__ == "__main__":
    main()
