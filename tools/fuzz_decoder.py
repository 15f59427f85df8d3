# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fuzzing of the host's decoder: frames, changed at random, and what came of them changed again.

    python -m tools.fuzz_decoder [--runs N] [--seconds S] [--seed N] [--crash FILE]
    python -m tools.fuzz_decoder --atheris [-runs=N ...]

An input that leads to a sequence of outcomes that is new is kept, to be changed further. With
`--atheris`, Google's fuzzer (`pip install atheris`) is led by the branches taken instead, at a
tenth of the speed; what follows are its own options.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import math
from pathlib import Path
import random
import sys
import time

MOST = 512              # bytes of an input
MOST_KEPT = 4000        # inputs
LONGEST_PIECE = 32      # bytes that one change inserts or erases
MOST_CHANGES = 8        # of one input
LOOK = 256              # inputs between two looks at the clock
WORDS = (b'hello ', b'board ', b'tele ', b'ok ', b'no ', b' time=', b' counts=', b' index=',
         b' latch=', b' supply=', b' duty=', b' on=1', b' accepted=', b' obeyed=',
         b' faults=none', b' ambient=', b' protocol=', b' name=', b' boot=', b' bits=',
         b' speed=', b' re=', b' reason=', b'*', b'\n', b'\r\n', b'#', b'65535', b'65536', b'-',
         b'.', b'9999999999', b'1e5', b'nan')


class Mutator:
    """
    Changes inputs at random.

    Parameters
    ----------
    seed : int
        Of what is random.

    Attributes
    ----------
    kept : list of bytes
        What it begins with.
    """

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)
        self.kept: list[bytes] = []

    def below(self, limit: int) -> int:
        """Return a random whole number from 0 to below a limit, or 0 where that is 0."""
        return int(self._rng.random() * limit)

    def mutate(self) -> bytes:
        """Return a kept input with some changes."""
        kept = self.kept
        # The shorter one of two, as it runs faster and says as much.
        data = bytearray(min(kept[self.below(len(kept))], kept[self.below(len(kept))], key=len))
        for _ in range(1 + self.below(MOST_CHANGES)):
            self._change(data)
        return bytes(data[:MOST])

    def _change(self, data: bytearray) -> None:
        how, place = self.below(8), self.below(len(data))
        if how < 3 and data:
            data[place] = (data[place] ^ 1 << self.below(8), self.below(256),
                           48 + self.below(10))[how]
        elif how == 3:
            del data[place:place + 1 + self.below(LONGEST_PIECE)]
        elif how == 4:
            data[place:place] = WORDS[self.below(len(WORDS))]
        else:
            other = self.kept[self.below(len(self.kept))] if how < 7 else data
            start = self.below(len(other))
            data[place:place] = other[start:start + 1 + self.below(LONGEST_PIECE)]


def seeds() -> list[bytes]:
    """Return frames as a board sends them, and what is none."""
    from hysteresis_ros.bridge.protocol import encode
    telemetry = {'time': 100, 'counts': -3214, 'index': 0, 'latch': -2731, 'supply': 12.009,
                 'duty': 0.2345, 'on': 1, 'accepted': 4, 'obeyed': 1, 'faults': 'none',
                 'ambient': 22.0}
    greeting = {'protocol': 1, 'name': 'simulated', 'firmware': '1', 'boot': 1, 'time': 0,
                'bits': 32, 'speed': 1.0}
    return [encode('tele', 3, telemetry), encode('board', 0, greeting), encode('ok', 1, {'re': 2}),
            encode('no', 4, {'re': 5, 'reason': 'out_of_range'}), b'# nothing done\n', b'x' * 200]


def fuzz(check: Callable[[bytes, int], str], runs: float, seconds: float, seed: int,
         note: Callable[[bytes], object]) -> tuple[int, int]:
    """
    Check changed inputs until there were enough.

    Parameters
    ----------
    check : callable
        Takes an input and the size of pieces; returns what came of it, in words.
    runs, seconds : float
        Whatever comes first ends it.
    seed : int
        Of what is random.
    note : callable
        Gets the input at which `check` raised, before that goes on.

    Returns
    -------
    inputs, kept : int
        How many were checked, and kept because what came of them was new.
    """
    from tools.decoder_check import with_crc
    mutator = Mutator(seed)
    mutator.kept += seeds()
    seen, done, end = set(), 0, time.monotonic() + seconds
    while done < runs and (done % LOOK or time.monotonic() < end):
        data = mutator.mutate()
        # Most changes spoil a CRC, behind which the interesting code begins.
        full = with_crc(data) if mutator.below(4) else data + b'\n'
        try:
            outcome = check(full, 1 + mutator.below(len(full)))
        except Exception:
            note(full)
            raise
        done += 1
        if outcome not in seen and len(mutator.kept) < MOST_KEPT:
            seen.add(outcome)
            mutator.kept.append(data)
    return done, len(mutator.kept)


def fuzz_with_atheris(arguments: list[str]) -> None:
    """Let atheris choose the inputs; it ends the process."""
    try:
        import atheris
    except ImportError:
        sys.exit('fuzz_decoder: atheris is missing: pip install atheris')
    with atheris.instrument_imports():
        from tools.decoder_check import check, with_crc
    first = seeds()[0]

    def one(data: bytes) -> None:
        how, data = data[:1], data[1:MOST]
        check(with_crc(data) if how >= b'\x40' else data + b'\n', 1 + (how[0] if how else 0) % 32)

    def mutate(data: bytes, most: int, seed: int) -> bytes:
        """Change an input; often into one that begins as a real frame does."""
        return atheris.Mutate(b'\x80' + first if seed % 64 == 0 else data, most)

    atheris.Setup(sys.argv[:1] + arguments, one,
                  custom_mutator=lambda *given: mutate(*given))
    atheris.Fuzz()


def main(arguments: list[str] | None = None) -> int:
    """Fuzz, and say how much."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--runs', type=float, default=math.inf, help='inputs')
    parser.add_argument('--seconds', type=float, default=math.inf, help='time')
    parser.add_argument('--seed', type=int, default=1, help='of what is random')
    parser.add_argument('--crash', type=Path, default=Path('crash'),
                        help='file that takes an input at which something went wrong')
    parser.add_argument('--atheris', action='store_true', help='led by branches, slower')
    given, others = parser.parse_known_args(arguments)
    if given.atheris:
        fuzz_with_atheris(others)
    if others or math.isinf(min(given.runs, given.seconds)):
        parser.error('say how long: --runs or --seconds')
    from tools.decoder_check import check
    start = time.process_time()
    done, kept = fuzz(check, given.runs, given.seconds, given.seed, given.crash.write_bytes)
    rate = done / (time.process_time() - start)
    print(f'inputs: {done}, a second of the processor: {rate:.0f}, kept: {kept}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
