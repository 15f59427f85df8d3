# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that are replaced as a whole: a reader finds the old content or the new, never half."""

from collections.abc import Iterator
import contextlib
import errno
import os
import secrets
import stat
from typing import IO

AnyPath = str | os.PathLike[str]


@contextlib.contextmanager
def replacing(path: AnyPath, mode: str = 'w') -> Iterator[IO]:
    """
    Open a file for writing that takes the place of `path` only when all of it is written.

    The content goes to a temporary file in the same folder, which is renamed at the end and
    removed if anything fails before. A new file has the mode that a plain `open` would give, an
    existing one keeps its mode and owner, a link keeps pointing where it points. What is no
    regular file (a pipe, /dev/stdout) is written to directly.

    Parameters
    ----------
    path : str or Path
    mode : {'w', 'wb'}
        UTF-8 text, or bytes.

    Yields
    ------
    file

    Raises
    ------
    OSError
        If the file cannot be written; it names `path`, not the temporary file.

    """
    encoding = None if 'b' in mode else 'utf-8'
    with naming(path):
        before = status(path)
        if before is not None and not stat.S_ISREG(before.st_mode):
            with open(path, mode, encoding=encoding) as file:
                yield file
            return
        target = os.path.realpath(path)
        descriptor, partial = temporary(target, before)
        try:
            with open(descriptor, mode, encoding=encoding) as file:
                yield file
                file.flush()
                # Some file systems report a full disk only now.
                os.fsync(descriptor)
            os.replace(partial, target)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(partial)
            raise


def write_text(path: AnyPath, text: str) -> None:
    """Write UTF-8 text to a file as `replacing` does."""
    with replacing(path) as file:
        file.write(text)


def write_bytes(path: AnyPath, data: bytes) -> None:
    """Write bytes to a file as `replacing` does."""
    with replacing(path, 'wb') as file:
        file.write(data)


def check_writable(path: AnyPath) -> None:
    """
    Raise the OSError that `replacing` would raise at once, and leave everything as it is.

    The folder is tried with a temporary file, because permissions alone say little about network
    and read-only file systems.
    """
    with naming(path):
        before = status(path)
        if before is None or stat.S_ISREG(before.st_mode):
            descriptor, partial = temporary(os.path.realpath(path), before)
            os.close(descriptor)
            os.unlink(partial)
        elif stat.S_ISDIR(before.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        elif not os.access(path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextlib.contextmanager
def naming(path: AnyPath) -> Iterator[None]:
    """Let errors of the system name the file that was asked for, not the temporary one."""
    try:
        yield
    except OSError as error:
        error.filename = os.fspath(path)
        raise


def status(path: AnyPath) -> os.stat_result | None:
    """Return the status of what a path leads to, None if there is nothing."""
    try:
        return os.stat(path)
    except FileNotFoundError:
        return None


def temporary(target: str, before: os.stat_result | None) -> tuple[int, str]:
    """
    Make an empty temporary file beside a target.

    Parameters
    ----------
    target : str
        Not a link.
    before : os.stat_result or None
        Status of the file that is there.

    Returns
    -------
    descriptor : int
    partial : str
        Path of the temporary file.

    """
    if before is not None and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), target)
    folder, name = os.path.split(target)
    # A name may have 255 bytes, and that of the target may have all of them.
    partial = os.path.join(folder, f'.{name[:40]}.{secrets.token_hex(4)}.part')
    descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
    if before is not None:
        # Only root may give a file away; then the copy is the writer's own.
        with contextlib.suppress(OSError):
            os.fchown(descriptor, before.st_uid, before.st_gid)
        with contextlib.suppress(OSError):
            os.fchmod(descriptor, stat.S_IMODE(before.st_mode))
    return descriptor, partial
