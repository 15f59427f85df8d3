# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The deepest stack of the firmware, from its machine code: worst path of calls and one interrupt.

Usage: ``python firmware_stack.py firmware.elf FOLDER`` with the compiler's ``.su`` files somewhere
in the folder. It fails where the depth has no bound: recursion, calls through pointers, a heap.
"""

from pathlib import Path
import re
import subprocess
import sys
from typing import NamedTuple

RAM = 2048                  # bytes of the ATmega328P
RETURN_ADDRESS = 2          # bytes
FORBIDDEN = {'malloc', 'calloc', 'realloc', 'free', 'alloca'}

_FUNCTION = re.compile(r'^[0-9a-f]+ <(\w+)>:$')
_CALL = re.compile(r'\t(?:r?call|r?jmp)\t.*<(\w+)>$')
_INDIRECT = re.compile(r'\t(?:e?icall|e?ijmp)\b')
_PUSH = re.compile(r'\tpush\t')


class Function(NamedTuple):
    """
    What the machine code of one function says.

    Attributes
    ----------
    calls : set of str
        Functions that it calls or ends in.
    pushes : int
        Registers that it saves.
    indirect : bool
        Whether it calls through a pointer.

    """

    calls: set
    pushes: int
    indirect: bool


def read_functions(listing: str) -> dict[str, Function]:
    """
    Read a disassembly.

    Parameters
    ----------
    listing : str
        What ``avr-objdump -d`` prints.

    Returns
    -------
    dict of str to Function

    """
    found: dict[str, Function] = {}
    name = ''
    for line in listing.splitlines():
        start = _FUNCTION.match(line)
        if start:
            name = start.group(1)
            found[name] = Function(set(), 0, False)
        elif name:
            here = found[name]
            call = _CALL.search(line)
            # A jump to its own start is a loop, a call is recursion.
            if call and (call.group(1) != name or 'call' in line):
                here.calls.add(call.group(1))
            found[name] = Function(here.calls, here.pushes + bool(_PUSH.search(line)),
                                   here.indirect or bool(_INDIRECT.search(line)))
    return found


def read_frames(folder: Path) -> dict[str, int]:
    """
    Read the compiler's own account of each function's stack.

    Parameters
    ----------
    folder : pathlib.Path
        Where ``-fstack-usage`` wrote.

    Returns
    -------
    dict of str to int
        Bytes, return address included.

    Raises
    ------
    ValueError
        If a function's use is not known when it is compiled.

    """
    frames = {}
    for path in sorted(folder.rglob('*.su')):
        for line in path.read_text(encoding='utf-8').splitlines():
            place, size, kind = line.split('\t')
            name = place.rpartition(':')[2]
            if kind != 'static':
                raise ValueError(f'{name}: its stack is {kind}')
            frames[name] = max(int(size), frames.get(name, 0))
    return frames


def deepest(name: str, functions: dict[str, Function], frames: dict[str, int],
            above: tuple = ()) -> tuple[int, tuple]:
    """
    Find the path of calls that takes the most stack.

    Parameters
    ----------
    name : str
        Function in which it begins.
    functions : dict of str to Function
        Who calls whom.
    frames : dict of str to int
        Bytes of each function; those of the compiler's library are counted by their pushes.
    above : tuple of str
        Functions that led here.

    Returns
    -------
    depth : int
        Bytes.
    path : tuple of str
        Functions, outermost first.

    Raises
    ------
    ValueError
        If there is no bound.

    """
    if name in above:
        raise ValueError(f'{name}: recursion, {" -> ".join((*above, name))}')
    function = functions.get(name, Function(set(), 0, False))
    if function.indirect:
        raise ValueError(f'{name}: calls through a pointer')
    own = frames.get(name, RETURN_ADDRESS + function.pushes)
    below = [deepest(callee, functions, frames, (*above, name))
             for callee in sorted(function.calls)]
    depth, path = max(below, default=(0, ()))
    return own + depth, (name, *path)


def report(elf: Path, folder: Path) -> str:
    """
    Say how deep the stack gets and how much memory is left for it.

    Parameters
    ----------
    elf : pathlib.Path
        The linked firmware.
    folder : pathlib.Path
        Of the compiler's ``.su`` files.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If the stack has no bound or no room.

    """
    def run(*command: str) -> str:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    functions = read_functions(run('avr-objdump', '-d', str(elf)))
    heap = FORBIDDEN & functions.keys()
    if heap:
        raise ValueError(f'{", ".join(sorted(heap))}: there is to be no heap')
    frames = read_frames(folder)
    if 'main' not in frames:
        raise ValueError(f'{folder}: the compiler wrote no .su files there (-fstack-usage)')
    depth, path = deepest('main', functions, frames)
    interrupt = max(deepest(name, functions, frames)[0]
                    for name in functions if name.startswith('__vector_'))
    sizes = dict(line.split()[:2] for line in run('avr-size', '-A', str(elf)).splitlines()
                 if line.startswith('.'))
    static = sum(int(sizes.get(section, 0)) for section in ('.data', '.bss', '.noinit'))
    total = static + depth + interrupt
    if total > RAM:
        raise ValueError(f'{total} bytes of {RAM}: the stack runs into the variables')
    return (f'Stack: {depth} bytes in {" > ".join(path)}\n'
            f'       {interrupt} in an interrupt; with {static} of variables '
            f'{total} of {RAM} bytes')


def main() -> int:
    """
    Print the report.

    Returns
    -------
    int
        Exit status: 1 where the stack has no bound or no room.

    """
    try:
        print(report(Path(sys.argv[1]), Path(sys.argv[2])))
    except ValueError as error:
        print(f'firmware: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
