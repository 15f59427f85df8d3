# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The loops that cost time, as compiled functions of arrays and numbers.

Each file holds one concept. The same functions run uncompiled where NUMBA_DISABLE_JIT is 1.
"""
