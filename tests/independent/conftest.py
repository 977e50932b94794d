"""The reference modules beside these tests are imported by their plain names, under any pytest import mode.

heyoka has packages for Linux only; elsewhere these tests are not collected.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

collect_ignore_glob = [] if sys.platform == "linux" else ["test_*.py"]
