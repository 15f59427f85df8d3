# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The muscles that pull on one clamp, as kernels want them: tables and memories."""

from collections.abc import Sequence
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
    table: Any = operator.table if isinstance(operator, CompiledOperator) else None
    operators, memories = with_own_memories([operator] * len(offsets))
    return (Wires(table, np.array(offsets, dtype=float), float(compliance), inside, middle,
                  tolerance), operators, memories)


def with_own_memories(operators: Sequence[HysteresisOperator]
                      ) -> tuple[list[HysteresisOperator], Any]:
    """
    Return copies of operators, and their memories as kernels take them.

    Parameters
    ----------
    operators : sequence of HysteresisOperator
        All of one kind.

    Returns
    -------
    operators : list of HysteresisOperator
    memories : ndarray, shape (operators, entries)
        Rows that the copies read and write; of operators that are not compiled the copies.
    """
    copies = [copy.deepcopy(operator) for operator in operators]
    compiled = [operator for operator in copies if isinstance(operator, CompiledOperator)]
    if not compiled:
        return copies, copies
    memories = np.empty((len(compiled), len(compiled[0].memory)))
    for row, operator in zip(memories, compiled):
        operator.move_memory(row)
    return copies, memories


def kernels_for(operator: HysteresisOperator, module: types.ModuleType) -> Any:
    """Return a module of kernels for an operator: compiled if the operator is, else plain."""
    return module if isinstance(operator, CompiledOperator) else Plain().module(module)
