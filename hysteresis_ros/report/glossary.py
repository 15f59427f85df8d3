# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects on a page: their names as links, and a glossary of those that are linked."""

from html import escape
import re

from hysteresis_ros.effects import catalogue
from hysteresis_ros.report.page import Html

LINKED = re.compile(r'href="#effect-(\w+)"')


def linked(text: str) -> Html:
    """Return text as HTML in which effects lead to the glossary and `...` is code."""
    known = catalogue()

    def link(found: re.Match[str]) -> str:
        name = found.group()
        return f'<a href="#effect-{name}">{name}</a>' if name in known else name

    words = re.sub(r'\b[A-Za-z_]\w*\b', link, escape(text))
    return Html(re.sub('`([^`]*)`', r'<code>\1</code>', words))


def glossary(*parts: str) -> str:
    """
    Return a section that explains the effects which parts of a page link to.

    Parameters
    ----------
    *parts : str
        HTML.

    Returns
    -------
    str
        HTML, in the order of the catalogue; '' where nothing is linked.

    """
    mentioned = {name for part in parts for name in LINKED.findall(part)}
    entries = []
    for name, effect in catalogue().items():
        if name in mentioned:
            entries.append(
                f'<div><dt id="effect-{name}">{name} ({escape(effect.stage)})</dt>'
                f'<dd>{escape(effect.sentence)}</dd>'
                f'<dd>Equation: <code>{escape(effect.equation)}</code></dd>'
                f'<dd>Source: {escape(effect.source)}</dd>'
                f'<dd>Shows in: {escape(effect.shows_in)}</dd></div>\n')
    if not entries:
        return ''
    return ('<section>\n<h2 id="glossary">Glossary of effects</h2>\n<dl class="glossary">\n'
            + ''.join(entries) + '</dl>\n</section>')
