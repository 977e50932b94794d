"""The work that these tests spread is imported by its own name, here and in the processes of a cluster."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
