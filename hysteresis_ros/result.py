# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How results show themselves: a few lines of text, and a small table in a notebook."""

import abc
from html import escape
from typing import NamedTuple


class Brief(NamedTuple):
    """
    A result in a few lines.

    Attributes
    ----------
    lines : list of str
        At most five; the first says what the result is.
    header : list of str
        Names of the table's columns.
    rows : list of list of str
        Cells of the table; may be empty.

    """

    lines: list[str]
    header: list[str]
    rows: list[list[str]]

    def to_text(self) -> str:
        """Return the lines as text."""
        return '\n'.join(self.lines)

    def to_html(self) -> str:
        """Return lines and table as an HTML fragment in which all text is escaped."""
        first, *others = [escape(line) for line in self.lines]
        parts = [f'<p><b>{first}</b></p>', *(f'<p>{line}</p>' for line in others)]
        if self.rows:
            head = ''.join(f'<th>{escape(cell)}</th>' for cell in self.header)
            body = ''.join('<tr>' + ''.join(f'<td>{escape(cell)}</td>' for cell in row) + '</tr>'
                           for row in self.rows)
            parts.append(f'<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>')
        return f'<div>{"".join(parts)}</div>'


class Result(abc.ABC):
    """What a computation returns to a person: `repr`, print and notebooks show it in brief."""

    @abc.abstractmethod
    def brief(self) -> Brief:
        """Return the result in a few lines and a small table."""

    def __repr__(self) -> str:
        return self.brief().to_text()

    def _repr_html_(self) -> str:
        """Return what a notebook shows in place of the text."""
        return self.brief().to_html()
