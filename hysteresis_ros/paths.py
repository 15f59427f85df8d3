# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Paths that are read and written: that none destroys another, and each can be written."""

import os
from pathlib import Path
from typing import NamedTuple

from hysteresis_ros.atomic import check_writable
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.measurements.bag_storage import SUFFIXES


class Given(NamedTuple):
    """A path that was given, and the option that it was given to."""

    option: str
    path: str

    def __str__(self) -> str:
        return f'{self.option} {self.path}'


def refuse_input(output: Given, read: Given) -> None:
    """Refuse an output that is an input, or lies in the folder of a recording that is read."""
    if same(output.path, read.path):
        what = ('to change a model in place, write a new file and rename it'
                if read.option == '--model' else 'name another file')
        raise ParameterError(f'{output}: would overwrite the input {read}; {what}')
    folder = recording_folder(read.path)
    if folder is not None and os.path.realpath(output.path).startswith(folder + os.sep):
        raise ParameterError(
            f'{output}: lies in the folder of the recording {read}; write it elsewhere')


def recording_folder(path: str) -> str | None:
    """Return the resolved folder of an input: itself, or that of a bag's storage file."""
    resolved = os.path.realpath(path)
    if os.path.isdir(resolved):
        return resolved
    folder = os.path.dirname(resolved)
    stored = resolved.removesuffix('.zstd').endswith(SUFFIXES)
    return folder if stored and os.path.exists(os.path.join(folder, 'metadata.yaml')) else None


def refuse_twice(outputs: list[Given]) -> None:
    """Refuse one path for two outputs; a device or pipe takes both."""
    for place, output in enumerate(outputs):
        for other in outputs[:place]:
            device = os.path.exists(output.path) and not (
                os.path.isfile(output.path) or os.path.isdir(output.path))
            if same(output.path, other.path) and not device:
                raise ParameterError(f'{output}: is also written by {other.option}; name two '
                                     'different paths')


def same(one: str, other: str) -> bool:
    """Tell whether two paths lead to one file, which need not exist."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return os.path.samefile(one, other)
    except OSError:
        return False


def check_folder(output: Given) -> None:
    """Refuse a folder that cannot be made or written to."""
    folder = Path(os.path.realpath(output.path))
    while not os.path.lexists(folder):
        folder = folder.parent
    if not folder.is_dir():
        raise ParameterError(f'{output}: {named(folder, output)} is a file; name a folder')
    # Not the name of any file: only whether one could be made here.
    try_writing(output, folder / '.hysteresis')


def check_file(output: Given, made: set[str]) -> None:
    """Refuse a file that cannot be written; `made` are folders that the command makes itself."""
    if os.path.isdir(output.path):
        raise ParameterError(f'{output}: is a folder; name a file')
    folder = Path(os.path.realpath(output.path)).parent
    if folder.is_dir() or os.path.exists(output.path):
        try_writing(output, output.path)
    elif os.path.lexists(folder):
        raise ParameterError(f'{output}: {named(folder, output)} is a file, not a folder; name '
                             'another')
    elif str(folder) not in made:
        raise ParameterError(f'{output}: the folder {named(folder, output)} does not exist; make '
                             'it first')


def try_writing(output: Given, path: str | os.PathLike[str]) -> None:
    """Refuse a path that cannot be written, with the reason that the system gives."""
    try:
        check_writable(path)
    except OSError as error:
        raise ParameterError(f'{output}: cannot be written ({error.strerror}); name another '
                             'path') from None


def named(folder: Path, output: Given) -> str:
    """Return a folder above an output as the user would write it."""
    relative = not os.path.isabs(output.path)
    return os.path.relpath(folder) if relative else str(folder)
