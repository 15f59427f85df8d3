# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How kernels are compiled that allocate nothing: without counting references."""

from .jit import Function, jit


def lean(function: Function) -> Function:
    """
    Return a kernel compiled by `jit` that makes no arrays.

    Numba counts references to every array that a function hands on, with atomic operations that
    cost more than a step of a Preisach operator. A function that makes no arrays needs no count:
    its caller holds all that it is given.
    """
    compiled = jit(function)
    options = getattr(compiled, 'targetoptions', None)
    if options is not None:
        options['_nrt'] = False
        options['no_cfunc_wrapper'] = True
    return compiled


def inlined(function: Function) -> Function:
    """
    Return a lean kernel that is copied to where it is called.

    For one that is called many times in a row: an arm and its state are a hundred numbers, and to
    hand them on takes longer than what is then done.
    """
    compiled = lean(function)
    options = getattr(compiled, 'targetoptions', None)
    if options is not None:
        options['forceinline'] = True
    return compiled


def merged(function: Function) -> Function:
    """
    Return a lean kernel that is part of the one that calls it, and is not compiled by itself.

    For a large one that is called in one place: `inlined` would have it compiled twice. With many
    small ones the caller becomes so large that it is compiled badly.
    """
    compiled = lean(function)
    options = getattr(compiled, 'targetoptions', None)
    if options is not None:
        options['inline'] = 'always'
    return compiled
