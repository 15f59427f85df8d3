# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Identification of the operators from bench measurements, and the paper's baselines."""
