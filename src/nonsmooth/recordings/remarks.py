"""Remarks on a recording, collected while it is read; equal remarks on channels become one."""

from __future__ import annotations

import re

__all__ = ["Remarks"]

_NAMED = 4  # channels named in one remark
_ALIKE = 3  # more runs than this of which the same is to be said, but for numbers, share one sentence


class Remarks:
    """Sentences on a file, a run, or a channel of a run."""

    def __init__(self) -> None:
        self._channels: dict[tuple[str, str], list[str]] = {}

    def say(self, sentence: str) -> None:
        """Something about the file as a whole."""
        self._channels.setdefault(("", sentence), [])

    def of(self, run: str, channel: str, sentence: str) -> None:
        """Something about a channel of a run ("" where it concerns all runs)."""
        self._channels.setdefault((run, sentence), []).append(channel)

    def sentences(self) -> tuple[str, ...]:
        """All of them; channels of one run of which the same is to be said stand together, and so do many runs."""
        alike: dict[tuple[str, ...], list[tuple[str, list[str], str]]] = {}
        for (run, text), channels in self._channels.items():
            kind = (re.sub(r"\d+", "#", text), *channels) if run else (run, text)
            alike.setdefault(kind, []).append((run, channels, text))
        said: list[str] = []
        for group in alike.values():
            if len(group) <= _ALIKE:
                said += [_sentence(*one) for one in group]
            else:
                said.append(f"{_sentence(*group[0])} (and likewise {len(group) - 1} more runs, to {group[-1][0]!r})")
        return tuple(said)


def _sentence(run: str, channels: list[str], text: str) -> str:
    channels = list(dict.fromkeys(channels))
    named = ", ".join(map(repr, channels[:_NAMED]))
    more = f" and {len(channels) - _NAMED} more" if len(channels) > _NAMED else ""
    which = f"channel{'s' if len(channels) > 1 else ''} {named}{more}" if channels else ""
    place = ", ".join(part for part in (f"run {run!r}" if run else "", which) if part)
    return f"{place}: {text}" if place else text
