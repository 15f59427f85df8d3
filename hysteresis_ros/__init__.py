# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Hysteresis models that drive artificial muscles and find the physics they lack."""

__version__ = '0.1.0'
