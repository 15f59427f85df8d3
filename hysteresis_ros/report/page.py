# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of a self-contained HTML page: no network, readable on a phone, in the dark and in print.

Every function escapes the text it is given, names of files and columns included, and returns
HTML that `page` puts together. Text that is HTML already comes as `Html`.
"""

from collections.abc import Collection, Iterable, Sequence
from html import escape
import re
from typing import NamedTuple

from hysteresis_ros.comparison.where import number
from hysteresis_ros.report.drawing import data_address
from hysteresis_ros.report.resources import script, script_digest, style

# Facts with more characters take the whole width.
LONG = 90


class Html(str):
    """Text that is HTML already and is not escaped again."""


class Bar(NamedTuple):
    """
    A number to be drawn as a bar.

    Attributes
    ----------
    name : str
        Text or Html.
    value : float
    low, high : float or None
        Its interval.
    strong, hollow : bool
        Whether it is brought out, and whether it is only an outline.

    """

    name: str
    value: float
    low: float | None = None
    high: float | None = None
    strong: bool = False
    hollow: bool = False


def html(text: str) -> Html:
    """Return text as HTML: escaped, unless it is HTML already."""
    return text if isinstance(text, Html) else Html(escape(text))


def page(title: str, *parts: str, footer: str = '') -> str:
    """
    Put a page together.

    Parameters
    ----------
    title : str
    *parts : str
        HTML from the functions below.
    footer : str
        Text.

    Returns
    -------
    str
        A whole HTML document, which forbids itself the network and every script but its own. All
        that it says can be read without the script, too.

    """
    policy = (f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
              f"script-src '{script_digest()}'")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{escape(title)}</title>\n<style>{style()}</style>\n</head>\n<body>\n'
        f'<main>\n<h1>{escape(title)}</h1>\n' + '\n'.join(parts)
        + f'\n</main>\n<footer>{escape(footer)}</footer>\n'
        f'<script>{script()}</script>\n</body>\n</html>\n')


def section(heading: str, *parts: str) -> str:
    """Return a part of the page under a heading (str); the parts are HTML."""
    return f'<section>\n<h2>{escape(heading)}</h2>\n' + '\n'.join(parts) + '\n</section>'


def paragraph(text: str) -> str:
    """Return a paragraph of text."""
    return f'<p>{html(text)}</p>'


def warning(text: str) -> str:
    """Return something that a reader should not overlook."""
    return f'<p class="warning">{html(text)}</p>'


def listing(items: Iterable[str], ordered: bool = True) -> str:
    """Return a list of texts, numbered or not."""
    tag = 'ol' if ordered else 'ul'
    return f'<{tag}>' + ''.join(f'<li>{html(item)}</li>' for item in items) + f'</{tag}>'


def facts(entries: Iterable[Sequence[str]]) -> str:
    """Return names and what is said of them, (name, content), in two columns; long ones in one."""
    found = [(name, html(content)) for name, content in entries if content]
    return '<dl class="facts">' + ''.join(
        ('<div class="wide">' if len(re.sub('<[^>]*>', '', content)) > LONG else '<div>')
        + f'<dt>{html(name)}</dt><dd>{content}</dd></div>' for name, content in found) + '</dl>'


def command(text: str) -> Html:
    """Return a command of the terminal, which the page's script gives a button to copy it."""
    return Html(f'<div class="command"><code>{escape(text)}</code></div>')


def bars(rows: Sequence[Bar], unit: str) -> str:
    """
    Return numbers with a bar after each.

    Parameters
    ----------
    rows : sequence of Bar
    unit : str
        Of the values.

    Returns
    -------
    str

    """
    ends = [row.high if row.high is not None else row.value for row in rows]
    longest = max([row.value for row in rows] + ends, default=0.0) or 1.0

    def percent(value: float) -> str:
        return f'{100.0 * min(max(value / longest, 0.0), 1.0):.2f}%'

    items = []
    for row in rows:
        kind = ' '.join(['strong'] * row.strong + ['hollow'] * row.hollow)
        interval, line = '', ''
        if row.low is not None and row.high is not None:
            interval = f' ({number(row.low)} to {number(row.high)})'
            line = (f'<i style="left:{percent(row.low)};'
                    f'width:calc({percent(row.high)} - {percent(row.low)})"></i>')
        items.append(
            f'<li class="{kind}"><span class="name">{html(row.name)}</span>'
            f'<span class="value">{number(row.value)} {escape(unit)}{interval}</span>'
            f'<span class="bar" aria-hidden="true"><span style="width:{percent(row.value)}">'
            f'</span>{line}</span></li>\n')
    return '<ul class="bars">\n' + ''.join(items) + '</ul>'


def table(header: Sequence[str], rows: Sequence[Sequence[str]],
          strong: Collection[int] = ()) -> str:
    """
    Return a table; on a narrow screen each row becomes a block of names and numbers.

    Parameters
    ----------
    header : sequence of str
    rows : sequence of sequence of str
    strong : collection of int
        Rows to bring out.

    Returns
    -------
    str

    """
    head = ''.join(f'<th scope="col">{html(str(cell))}</th>' for cell in header)
    labels = [escape(str(cell)) for cell in header]
    body = ''.join(
        ('<tr class="strong">' if n in strong else '<tr>')
        + ''.join(f'<td data-label="{name}">{html(cell)}</td>'
                  for name, cell in zip(labels, row)) + '</tr>\n'
        for n, row in enumerate(rows))
    return (f'<div class="scroll"><table>\n<thead><tr>{head}</tr></thead>\n'
            f'<tbody>\n{body}</tbody>\n</table></div>')


def picture(png: bytes, caption: str, alt: str = '', chart: str = '') -> str:
    """
    Return a picture that is part of the page.

    Parameters
    ----------
    png : bytes
        A PNG file.
    caption : str
        Stands below it.
    alt : str
        Says what the picture shows to whoever does not see it; the caption by default.
    chart : {'', 'lines', 'loop', 'signals'}
        The chart that the page's script puts in its place.

    Returns
    -------
    str

    """
    kind = f' data-chart="{chart}"' if chart else ''
    return (f'<figure{kind}><img alt="{escape(alt or caption)}" src="{data_address(png)}">'
            f'<figcaption>{html(caption)}</figcaption></figure>')


def data(name: str, text: str) -> str:
    """Return an element that holds JSON for the page's script; `as_json` makes it safe."""
    return f'<script type="application/json" id="{escape(name)}">{text}</script>'


def details(summary: str, *parts: str) -> str:
    """Return parts that are folded away until a reader asks for them."""
    return (f'<details><summary>{escape(summary)}</summary>\n' + '\n'.join(parts)
            + '\n</details>')
