# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Hysteresis operators, their exact inverses, and the models that couple them."""

from .additive import Additive
from .areas import signed_areas, signed_lengths
from .base import HysteresisOperator, Inversion, operator_from_dict
from .bouc_wen import BoucWen
from .cascade import Cascade
from .dead_zones import DeadZones
from .everett import cell_areas, cells
from .kinetic import Kinetic
from .linear import Linear
from .play import PrandtlIshlinskii
from .preisach import Preisach

__all__ = [
    'Additive',
    'BoucWen',
    'Cascade',
    'DeadZones',
    'HysteresisOperator',
    'Inversion',
    'Kinetic',
    'Linear',
    'PrandtlIshlinskii',
    'Preisach',
    'cell_areas',
    'cells',
    'operator_from_dict',
    'signed_areas',
    'signed_lengths',
]
