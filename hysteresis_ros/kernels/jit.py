# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How the kernels are compiled."""

from collections.abc import Callable

import numba


def jit(function: Callable) -> Callable:
    """Return a function that is compiled when it is first called, and kept on disk."""
    return numba.njit(cache=True, nogil=True, error_model='numpy')(function)
