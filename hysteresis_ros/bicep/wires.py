# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The muscles that pull on one clamp, as kernels want them: tables and memories."""

import copy
import types
from typing import Any

import numpy as np

from hysteresis_ros.kernels.bundle import Wires
from hysteresis_ros.kernels.plain import Plain
from hysteresis_ros.operators import HysteresisOperator, Preisach
from hysteresis_ros.operators.compiled import CompiledOperator

# Compliance [m/N] of a wire whose own is not known.
COMPLIANCE = 2e-4


def wires_of(operator: HysteresisOperator, offsets: tuple[float, ...], compliance: float
             ) -> tuple[Wires, list[HysteresisOperator], Any]:
    """
    Return parallel muscles with memories of their own.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2 of one muscle; it is copied for each.
    offsets : tuple of float
        Excess length dL_i [m] of each muscle; one entry for equal muscles.
    compliance : float
        Elastic compliance of a wire [m/N]; 0 stands for a typical wire's.

    Returns
    -------
    wires : Wires
        What does not change.
    operators : list of HysteresisOperator
        One for each muscle.
    memories : ndarray, shape (muscles, entries)
        Their memories; of operators that are not compiled the operators themselves.
    """
    compliance = compliance or COMPLIANCE
    tolerance = 1e-10 * (operator.upper - operator.lower)
    middle = 0.5 * (operator.lower + operator.upper)
    inside = 0.0
    if len(offsets) > 1 and isinstance(operator, Preisach):
        # Of other operators the wires are elastic only beyond what H2 can give.
        inside = compliance
        operator = operator.tilted(inside)
    operators: list[HysteresisOperator]
    table: Any = None
    memories: Any
    if isinstance(operator, CompiledOperator):
        muscles = [copy.deepcopy(operator) for _ in offsets]
        table, memories = operator.table, np.empty((len(offsets), len(operator.memory)))
        for row, muscle in zip(memories, muscles):
            muscle.move_memory(row)
        operators = [*muscles]
    else:
        operators = memories = [copy.deepcopy(operator) for _ in offsets]
    return (Wires(table, np.array(offsets, dtype=float), float(compliance), inside, middle,
                  tolerance), operators, memories)


def kernels_for(operator: HysteresisOperator, module: types.ModuleType) -> Any:
    """Return a module of kernels for an operator: compiled if the operator is, else plain."""
    return module if isinstance(operator, CompiledOperator) else Plain().module(module)
