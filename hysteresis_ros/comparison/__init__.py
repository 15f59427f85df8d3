# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Compare a model with measurements: how far off it is, and where."""
