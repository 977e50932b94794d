"""Memory is asked for before it is taken: a call that cannot end says so at once, and nothing else is pushed out."""

from __future__ import annotations

import os
from pathlib import Path

LIMITS = Path("/sys/fs/cgroup")  # of a container, on Linux
FACTS = Path("/proc/meminfo")
SMALL = 2**24  # bytes that are not asked for: to ask takes a tenth of a millisecond, as long as a short run


def free_memory() -> int | None:
    """Bytes that this process may still take; None where the machine does not tell."""
    known = []
    try:
        for line in FACTS.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                known.append(int(line.split()[1]) * 1024)
        limit, used = ((LIMITS / f"memory.{name}").read_text().strip() for name in ("max", "current"))
        if limit != "max":
            known.append(int(limit) - int(used) + _cached())
    except (OSError, ValueError, IndexError):
        pass
    if not known and hasattr(os, "sysconf"):
        try:
            known.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
        except (OSError, ValueError):
            return None
    return min(known) if known else None


def _cached() -> int:
    """Bytes of files that a container's use counts too, and that the system drops when memory is asked for."""
    facts = LIMITS / "memory.stat"
    lines = facts.read_text().splitlines() if facts.exists() else []
    return sum(int(line.split()[1]) for line in lines if line.startswith("inactive_file "))


def room_for(n_bytes: float, what: str, remedy: str) -> None:
    """MemoryError where ``what`` would take more bytes than there are free.

    Parameters
    ----------
    n_bytes : float
        A lower bound of what is needed.
    remedy : str
        What to do then.
    """
    if n_bytes < SMALL:
        return
    free = free_memory()
    if free is not None and n_bytes > free:
        raise MemoryError(
            f"{what} takes at least {n_bytes / 2**30:.3g} GiB of memory, and {free / 2**30:.3g} GiB are free: {remedy}"
        )
