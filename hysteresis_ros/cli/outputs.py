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
from typing import ClassVar

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.paths import check_file, check_folder, Given, refuse_input, refuse_twice


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
