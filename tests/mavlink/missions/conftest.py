"""Makes the sample missions available to the tests of this folder."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
