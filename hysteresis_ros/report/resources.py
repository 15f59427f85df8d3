# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The style and the script of a page, from the files in `web/`.

The script is our own and not a plotting library: the charts need lines, dots and a pointer, in
33 kB that a reader can read. The libraries are two to a hundred times as large, and the small ones
draw into a canvas, which neither follows dark mode nor prints as lines.
"""

import base64
import functools
import hashlib
from importlib.resources import files

# In the order in which they need each other.
SCRIPTS = ('elements', 'columns', 'scale', 'view', 'chart', 'lines', 'loop', 'means', 'controls',
           'start')


@functools.cache
def style() -> str:
    """Return the style sheet of a page."""
    return _read('page.css')


@functools.cache
def script() -> str:
    """Return the script of a page, which keeps its names to itself."""
    return "(() => {\n'use strict';\n" + '\n'.join(
        _read(f'{name}.js') for name in SCRIPTS) + '})();\n'


def script_digest() -> str:
    """Return what a content security policy calls the script: no other runs."""
    digest = hashlib.sha256(script().encode('utf-8')).digest()
    return 'sha256-' + base64.b64encode(digest).decode('ascii')


def _read(name: str) -> str:
    return (files('hysteresis_ros.report') / 'web' / name).read_text(encoding='utf-8')
