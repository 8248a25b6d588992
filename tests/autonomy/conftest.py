"""Makes the plans of the ideal vehicle available to tests of plans."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "tasks" / "ideal"))
