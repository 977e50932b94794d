"""``python -m nonsmooth``: the command ``nonsmooth``, also where its folder is not on the path."""

from __future__ import annotations

import sys

from nonsmooth.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
