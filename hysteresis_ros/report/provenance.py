# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the numbers of a page come from: command, date, versions, files and their hashes."""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
import datetime
import hashlib
from importlib import metadata
import platform
from typing import TYPE_CHECKING

from hysteresis_ros import __version__
from hysteresis_ros.atomic import AnyPath
from hysteresis_ros.report import page

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement

LIBRARIES = ('numpy', 'scipy', 'numba')


@dataclasses.dataclass(frozen=True)
class Origin:
    """
    The command that wrote a page.

    Attributes
    ----------
    command : str
        As it was typed, '' from Python.
    reading : tuple of str
        Those of its options that say how recordings are read, to be given again to the next.
    """

    command: str = ''
    reading: tuple[str, ...] = ()


def provenance(origin: Origin, model_path: str, measurements: Sequence[Measurement],
               sources: Sequence[str] = ()) -> str:
    """
    Return the section of a page that says where its numbers come from.

    Parameters
    ----------
    origin : Origin
    model_path : str
        The model's file.
    measurements : sequence of Measurement
        With the hashes of their files; may be empty where only names are known.
    sources : sequence of str
        Names of recordings, where `measurements` is empty.

    Returns
    -------
    str
        HTML.
    """
    files = [('model', model_path, digest(model_path))]
    files += [('measurement', one.source, one.digest) for one in measurements]
    files += [('measurement', name, '') for name in sources if not measurements]
    made = [['command', origin.command or 'none: written from Python'],
            ['date', datetime.datetime.now(datetime.timezone.utc).strftime('%Y-%m-%d %H:%M UTC')],
            ['versions', ', '.join(versions())]]
    return page.section(
        'Provenance', page.facts(made),
        page.table(['file', 'name', 'SHA-256'],
                   [[role, name, known or '-'] for role, name, known in files]))


def versions() -> list[str]:
    """Return the package, Python and the libraries that compute, with their versions."""
    found = [f'hysteresis_ros {__version__}', f'Python {platform.python_version()}']
    for name in LIBRARIES:
        try:
            found.append(f'{name} {metadata.version(name)}')
        except metadata.PackageNotFoundError:
            found.append(f'{name} not installed')
    return found


def digest(path: AnyPath) -> str:
    """Return the SHA-256 of a file, '' where it cannot be read."""
    try:
        with open(path, 'rb') as file:
            return hashlib.sha256(file.read()).hexdigest()
    except OSError:
        return ''
