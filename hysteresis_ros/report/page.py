# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of a self-contained HTML page: no scripts, no network, readable on a phone and in print.

Every function escapes the text it is given, names of files and columns included, and returns
HTML that `page` puts together.
"""

from collections.abc import Collection, Iterable, Sequence
from html import escape

from hysteresis_ros.report.drawing import data_address

STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 62rem; padding: 1rem 1rem 3rem; color: #1a1f26;
  background: #fff; font: 16px/1.5 system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif;
  overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: .6rem 0 .2rem; }
h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccd3db;
  padding-bottom: .2rem; }
p { margin: .5rem 0; } li { margin: .25rem 0; }
.verdict { border-left: 5px solid #2f6db5; background: #f1f5fa; padding: .7rem 1rem;
  font-size: 1.08rem; margin: 1rem 0; }
.warning { border-left: 5px solid #c9822b; background: #fdf5e9; padding: .5rem 1rem;
  margin: .6rem 0; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .93rem; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .7rem; text-align: right; border-bottom: 1px solid #dde3e9;
  overflow-wrap: normal; }
th { border-bottom: 2px solid #8b98a6; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; }
tr.strong td { font-weight: 600; background: #f1f5fa; }
figure { margin: 1rem 0; break-inside: avoid; }
img { max-width: 100%; height: auto; display: block; }
figcaption { font-size: .88rem; color: #48535f; margin-top: .2rem; }
details { margin: .6rem 0; } summary { cursor: pointer; }
footer { margin-top: 2.5rem; color: #5a6672; font-size: .85rem; }
@media screen and (max-width: 40rem) {
  /* A picture is read by moving it sideways, like a table, not with a magnifying glass. */
  figure { overflow-x: auto; } img { max-width: none; width: 44rem; }
  figcaption { position: sticky; left: 0; width: calc(100vw - 2rem); }
  td { white-space: nowrap; } }
@media print { body { max-width: none; padding: 0; font-size: 10.5pt; }
  h2 { break-after: avoid; } .verdict, .warning, tr.strong td { background: none; }
  .scroll { overflow: visible; } tr { break-inside: avoid; } }
"""


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
        A whole HTML document that forbids itself scripts and the network.

    """
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n'
        f'<h1>{escape(title)}</h1>\n' + '\n'.join(parts)
        + f'\n<footer>{escape(footer)}</footer>\n</body>\n</html>\n')


def section(heading: str, *parts: str) -> str:
    """Return a part of the page under a heading (str); the parts are HTML."""
    return f'<section>\n<h2>{escape(heading)}</h2>\n' + '\n'.join(parts) + '\n</section>'


def paragraph(text: str) -> str:
    """Return a paragraph of text."""
    return f'<p>{escape(text)}</p>'


def verdict(text: str) -> str:
    """Return the sentence that a hurried reader should see, set apart."""
    return f'<p class="verdict">{escape(text)}</p>'


def warning(text: str) -> str:
    """Return something that a reader should not overlook."""
    return f'<p class="warning">{escape(text)}</p>'


def listing(items: Iterable[str], ordered: bool = True) -> str:
    """Return a list of texts, numbered or not."""
    tag = 'ol' if ordered else 'ul'
    return f'<{tag}>' + ''.join(f'<li>{escape(item)}</li>' for item in items) + f'</{tag}>'


def table(header: Sequence[str], rows: Sequence[Sequence[str]],
          strong: Collection[int] = ()) -> str:
    """
    Return a table that scrolls sideways on a narrow screen.

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
    head = ''.join(f'<th scope="col">{escape(str(cell))}</th>' for cell in header)
    body = ''.join(
        ('<tr class="strong">' if n in strong else '<tr>')
        + ''.join(f'<td>{escape(str(cell))}</td>' for cell in row) + '</tr>\n'
        for n, row in enumerate(rows))
    return (f'<div class="scroll"><table>\n<thead><tr>{head}</tr></thead>\n'
            f'<tbody>\n{body}</tbody>\n</table></div>')


def picture(png: bytes, caption: str) -> str:
    """
    Return a picture that is part of the page.

    Parameters
    ----------
    png : bytes
        A PNG file.
    caption : str
        Says what is seen; also read out in place of the picture.

    Returns
    -------
    str

    """
    text = escape(caption)
    return (f'<figure><img alt="{text}" src="{data_address(png)}">'
            f'<figcaption>{text}</figcaption></figure>')


def details(summary: str, *parts: str) -> str:
    """Return parts that are folded away until a reader asks for them."""
    return (f'<details><summary>{escape(summary)}</summary>\n' + '\n'.join(parts)
            + '\n</details>')
