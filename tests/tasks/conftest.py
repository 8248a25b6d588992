"""Tests of several groups of tasks fly the same ideal vehicle."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "ideal"))
