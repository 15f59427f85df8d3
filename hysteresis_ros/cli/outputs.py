# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Paths on the command line: which are read, which are written, and that none destroys another.

Each option that takes a path has one of the types below as its argparse `type`; the values keep
that type, so that `check_paths` finds the inputs and outputs of any command by itself.
"""

import argparse
from collections.abc import Iterator
import os
from pathlib import Path
from typing import ClassVar, NamedTuple

from hysteresis_ros.atomic import check_writable
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.measurements.bag_storage import SUFFIXES


class InputPath(str):
    """A file or folder that a command reads."""


class OutputFile(str):
    """A file that a command writes."""


class OutputFileOrStdout(OutputFile):
    """A file that a command writes, or `-` for standard output."""


class OutputFolder(str):
    """
    A folder that a command writes to; it is made where it is missing.

    Attributes
    ----------
    names : tuple of str
        What is written there, as far as something of the same command could lie there, too.

    """

    names: ClassVar[tuple[str, ...]] = ()


class Given(NamedTuple):
    """A path that was given, and the option that it was given to."""

    option: str
    path: str

    def __str__(self) -> str:
        return f'{self.option} {self.path}'


def check_paths(args: argparse.Namespace) -> None:
    """
    Refuse outputs that would destroy an input or another output, or cannot be written.

    Parameters
    ----------
    args : argparse.Namespace
        As the command's parser returned it.

    Raises
    ------
    ParameterError
        Before anything is computed or written; it names option, path and what to do.

    """
    inputs = list(given(args, InputPath))
    folders = list(given(args, OutputFolder))
    files = [output for output in given(args, OutputFile)
             if not (isinstance(output.path, OutputFileOrStdout) and output.path == '-')]
    for any_path in [*inputs, *folders, *files]:
        if not any_path.path:
            raise ParameterError(f'{any_path.option}: the path is empty; name a file or folder')
    inside = [Given(folder.option, os.path.join(folder.path, name)) for folder in folders
              for name in getattr(folder.path, 'names', ())]
    for output in [*folders, *inside, *files]:
        for read in inputs:
            refuse_input(output, read)
    refuse_twice([*folders, *inside, *files])
    for folder in folders:
        check_folder(folder)
    made = {os.path.realpath(folder.path) for folder in folders}
    for file in files:
        check_file(file, made)


def given(args: argparse.Namespace, kind: type) -> Iterator[Given]:
    """Yield the paths of one kind that were given."""
    for name, value in vars(args).items():
        for path in value if isinstance(value, list) else [value]:
            if isinstance(path, str) and isinstance(path, kind):
                yield Given('--' + name.replace('_', '-'), path)


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
