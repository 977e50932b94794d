"""The reference modules beside these tests are imported by their plain names, under any pytest import mode."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parent / "independent"))
