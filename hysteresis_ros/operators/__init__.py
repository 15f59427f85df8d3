# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Hysteresis operators, their exact inverses, and the cascade that couples them."""

from .areas import signed_areas
from .base import HysteresisOperator, Inversion, operator_from_dict
from .branch import Branch, PiecewiseQuadratic
from .everett import cell_areas, cells
from .preisach import Preisach

__all__ = [
    'Branch',
    'HysteresisOperator',
    'Inversion',
    'PiecewiseQuadratic',
    'Preisach',
    'cell_areas',
    'cells',
    'operator_from_dict',
    'signed_areas',
]
