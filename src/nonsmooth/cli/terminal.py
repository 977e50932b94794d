"""Text from files, made fit for a terminal: characters that steer it are shown as what they are."""

from __future__ import annotations


def printable(text: str) -> str:
    """The text with its lines and tabs; any other character that is not printed stands as its escape (``\\x1b``)."""
    return "".join(
        letter if letter.isprintable() or letter in "\n\t" else letter.encode("unicode_escape").decode()
        for letter in text
    )


def one_line(value: object, limit: int = 40) -> str:
    """A value as text on one line of at most ``limit`` characters."""
    if isinstance(value, list) and len(value) > 4:
        text = f"[{value[0]} ... {value[-1]}] ({len(value)})"
    else:
        text = str(value)
    text = printable(text[: limit + 1].replace("\n", "\\n").replace("\t", "\\t"))
    return text if len(text) <= limit else text[: limit - 3] + "..."
