# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue of physical effects that a model may be missing."""

from hysteresis_ros.effects.base import (
    Effect, Inputs, needs_phase, Parameter, STAGES, Surroundings)
from hysteresis_ros.effects.catalogue import catalogue, effect_class, package_of
from hysteresis_ros.effects.stages import (
    DriveEffect, MaterialEffect, MechanismEffect, SensorEffect, Statics)

__all__ = [
    'STAGES', 'DriveEffect', 'Effect', 'Inputs', 'MaterialEffect', 'MechanismEffect', 'Parameter',
    'SensorEffect', 'Statics', 'Surroundings', 'catalogue', 'effect_class',
    'needs_phase', 'package_of']
