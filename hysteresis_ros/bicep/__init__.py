# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The robotic bicep: geometry, static load, and the balance between muscle and arm."""

from hysteresis_ros.bicep.geometry import BicepGeometry, Reference

__all__ = ['BicepGeometry', 'Reference']
