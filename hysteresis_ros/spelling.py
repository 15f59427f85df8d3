# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Names in messages: which one was probably meant, and lists of them."""

from __future__ import annotations

from collections.abc import Iterable
import difflib


def closest(name: str, columns: Iterable[str], similarity: float = 0.6) -> str | None:
    """Return the column whose name is most like this one, or None."""
    lowered = {str(column).lower(): column for column in columns}
    matches = difflib.get_close_matches(name.lower(), lowered, 1, similarity)
    return lowered[matches[0]] if matches else None


def suggestion(name: str, columns: Iterable[str]) -> str:
    """Return the end of a message: the column that was probably meant, or what there is."""
    close = closest(name, columns)
    if close:
        return f'; is {close!r} meant? Rename it'
    return f'; the columns are {short_list(columns)}'


def short_list(names: Iterable[str], most: int = 12) -> str:
    """Return names for a message, in quotes, cut off after some."""
    names = [repr(str(name)[:40]) for name in names]
    return ', '.join(names[:most]) + (', ...' if len(names) > most else '')


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return the message for a name that does not exist: what was probably meant, or all."""
    known = list(known)
    close = closest(name, known, 0.7)
    return f'there is no {what} {name!r}; ' + (
        f'did you mean {close!r}?' if close else f'there are {", ".join(known)}')
