"""The reference modules beside these tests are imported by their plain names, under any pytest import mode."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
