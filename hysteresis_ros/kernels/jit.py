# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Compile a function with numba and keep the machine code between runs: the decorator `jit`.

With ``NUMBA_DISABLE_JIT=1`` in the environment, or without numba, the same functions run as plain
Python.
"""

from collections.abc import Callable
import logging
from typing import TypeVar

Function = TypeVar('Function', bound=Callable)
Kind = TypeVar('Kind', bound=type)

try:
    from hysteresis_ros.kernels.compiler import compile_and_keep, remember_types
except ModuleNotFoundError as error:
    # Not every system has a package of numba. All works without, but for the time that it takes.
    if error.name != 'numba':
        raise

    def compile_and_keep(function: Function) -> Function:
        """Return the function as it is."""
        return function

    def remember_types(kind: Kind) -> Kind:
        """Return the class as it is."""
        return kind

    logging.getLogger(__name__).warning(
        'numba is not installed: simulations take 20 to 50 times as long; pip install numba')


def jit(function: Function) -> Function:
    """
    Compile a function for each combination of types that it is called with, and keep the result.

    The compiled function releases the GIL, and divides by zero as NumPy does: to inf or NaN. Sums
    keep their order, so that the result is that of the uncompiled function.

    Parameters
    ----------
    function : callable
        In a module of `hysteresis_ros.kernels`. It may use scalars, arrays, tuples, constants of
        these modules and other functions decorated in the same way.

    Returns
    -------
    callable
        The compiled function, or `function` itself with ``NUMBA_DISABLE_JIT=1`` or without numba.
    """
    return compile_and_keep(function)
