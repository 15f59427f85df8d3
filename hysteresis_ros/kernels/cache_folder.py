# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Find the folder in which the compiled kernels are kept between runs.

The folder's name carries a digest of everything that the machine code depends on: the sources of
this package, Python, NumPy and numba. Numba itself looks only at the file of the function that is
called, not at those of the functions that it calls in turn, and would go on using old code.
"""

from collections.abc import Iterator
import functools
import hashlib
import logging
import os
from pathlib import Path
import re
import shutil
import stat
import sys
import tempfile

import numba
import numpy as np

NAME = 'hysteresis_ros'
# Several interpreters, installations and branches take turns on one machine.
KEPT = 6
OURS = re.compile(r'kernels-[0-9a-f]{16}')


@functools.cache
def cache_folder() -> Path | None:
    """
    Return the folder for the compiled kernels, which exists and can be written.

    Returns
    -------
    Path or None
        A subfolder of ``NUMBA_CACHE_DIR`` where that is set, else of ``XDG_CACHE_HOME`` or
        ``~/.cache``, else a folder of this user's own among the temporary files. None, with one
        line in the log, if none of them can be written: kernels are then compiled in each run.
    """
    try:
        name = f'kernels-{digest()}'
    except OSError as error:
        _complain(f'its sources cannot be read ({error})')
        return None
    for parent, trusted in _parents():
        folder = parent / name
        if _prepare(parent, trusted) and _prepare(folder, trusted):
            prune(folder)
            return folder
    _complain('no folder can be written; set NUMBA_CACHE_DIR to one')
    return None


def digest() -> str:
    """Return 16 hexadecimal digits for what the machine code depends on."""
    found = hashlib.sha256()
    for part in (sys.version, np.__version__, numba.__version__):
        found.update(part.encode() + b'\0')
    sources = sorted(Path(__file__).parent.glob('*.py'))
    if not sources:
        raise FileNotFoundError(f'no Python files in {Path(__file__).parent}')
    for path in sources:
        content = path.read_bytes()
        found.update(f'{path.name}\0{len(content)}\0'.encode() + content)
    return found.hexdigest()[:16]


def prune(folder: Path) -> None:
    """Mark a folder as used now, and delete the kernels' folders beside it not used for longest."""
    try:
        os.utime(folder)
        others = [(path.stat().st_mtime, path) for path in folder.parent.iterdir()
                  if OURS.fullmatch(path.name) and path != folder]
    except OSError:     # another process prunes, too
        return
    for _, path in sorted(others, reverse=True)[KEPT - 1:]:
        shutil.rmtree(path, ignore_errors=True)


def _parents() -> Iterator[tuple[Path, bool]]:
    """Yield folders to try, and whether the user chose them, so that their owner is no matter."""
    chosen = numba.config.CACHE_DIR
    if chosen:
        yield Path(chosen).absolute() / NAME, True
    caches = os.environ.get('XDG_CACHE_HOME', '')
    if not os.path.isabs(caches):   # which the specification says to ignore
        caches = os.path.expanduser('~/.cache')
    if os.path.isabs(caches):
        yield Path(caches) / NAME, False
    user = os.getuid() if hasattr(os, 'getuid') else 'user'
    yield Path(tempfile.gettempdir()) / f'{NAME}-{user}', False


def _prepare(folder: Path, trusted: bool) -> bool:
    """
    Make a folder if it is not there, and return whether it may be used.

    Whoever can write into it can have this process run code: it has to be ours alone.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not trusted and hasattr(os, 'getuid'):
            status = folder.lstat()
            if (not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid()
                    or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
                return False
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _complain(why: str) -> None:
    logging.getLogger(__name__).warning(
        'compiled functions cannot be kept, so that each start compiles them anew: %s', why)
