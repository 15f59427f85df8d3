# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The muscles that pull on one clamp, as kernels want them: tables and memories."""

from __future__ import annotations

from collections.abc import Sequence
import copy
import types
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.kernels.bundle import Wires
from hysteresis_ros.kernels.plain import Plain
from hysteresis_ros.operators import HysteresisOperator
from hysteresis_ros.operators.compiled import CompiledOperator

if TYPE_CHECKING:
    from hysteresis_ros.model.chain import Chain

# Compliance [m/N] of a wire whose own is not known, if it is one of the paper's.
COMPLIANCE = 2e-4
# Loads at which the factor on the strain and the loop's width are laid out, up to this many times
# the bench's mean.
LOADS, LARGEST = 1000, 8.0


def wires_of(operator: HysteresisOperator, chain: Chain, loaded: bool = True
             ) -> tuple[Wires, list[HysteresisOperator], Any]:
    """
    Return parallel muscles with memories of their own.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2 of one muscle; it is copied for each.
    chain : Chain
        Effects of the model: excess lengths of the muscles, and how a wire strains under its load.
    loaded : bool
        Whether the load is weighed against the drive.

    Returns
    -------
    wires : Wires
        What does not change.
    operators : list of HysteresisOperator
        One for each muscle.
    memories : ndarray, shape (muscles, entries)
        Their memories; of operators that are not compiled the operators themselves.
    """
    table: Any = operator.table if isinstance(operator, CompiledOperator) else None
    offsets = np.array(chain.offsets, dtype=float)
    operators, memories = with_own_memories([operator] * len(offsets))
    scales, widths, oriented, lightest, spacing = np.ones(1), np.zeros(1), np.ones(1), 0.0, 1.0
    plays, kept, orients = chain.plays and loaded, chain.keeps_strain, chain.orients
    if plays or kept or orients or len(offsets) > 1:
        loads = np.linspace(0.0, LARGEST * (chain.surroundings.load or 1.0), LOADS)
        inside = chain.load_inside(loads) + 0.0 * loads
        lightest, spacing = float(inside[0]), float(np.ptp(inside)) / (LOADS - 1)
        even = np.linspace(inside[0], inside[-1], LOADS)
        scales = np.interp(even, inside, chain.scale(loads) + 0.0 * loads)
        if plays:
            widths = np.interp(even, inside, chain.loop_width(loads))
        if orients:
            oriented = np.interp(even, inside, chain.oriented(loads))
    own = chain.compliance()
    typical = COMPLIANCE * chain.surroundings.over_paper('compliance')
    return (Wires(table, operator.output_range[0], offsets, own or typical,
                  1e-10 * (operator.upper - operator.lower), scales, widths, oriented, lightest,
                  spacing, orients, own > 0.0, kept, chain.oriented_anew, chain.cooled_on_arm),
            operators, memories)


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
    compiled = [operator for operator in operators if isinstance(operator, CompiledOperator)]
    if not compiled:
        copies = [copy.deepcopy(operator) for operator in operators]
        return copies, copies
    memories = np.empty((len(compiled), len(compiled[0].memory)))
    return [operator.with_memory(row) for operator, row in zip(compiled, memories)], memories


def kernels_for(operator: HysteresisOperator, module: types.ModuleType) -> Any:
    """Return a module of kernels for an operator: compiled if the operator is, else plain."""
    return module if isinstance(operator, CompiledOperator) else Plain().module(module)
