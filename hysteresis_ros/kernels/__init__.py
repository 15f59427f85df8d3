# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Compiled functions on arrays and scalars: the loops of simulation, inverse and fit."""
