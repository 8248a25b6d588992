"""Makes the ideal vehicle available to tests of several groups of tasks."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "ideal"))
