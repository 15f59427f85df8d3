# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Other shifts by the load from which the fit of a bench begins again.

Between two rows a steep wire may transform anywhere, so that shifts under which each load
transforms between the same rows fit nearly alike, and a fit ends at the next of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from hysteresis_ros.effects import Effect
from hysteresis_ros.effects.material import StressDependence

# Shifts to begin at, over the one found.
OTHERS = 0.8, 0.9, 1.1, 1.25


def at_other_shifts(effects: Sequence[Effect]) -> list[list[Effect]]:
    """Return effects once for each shift to begin at; none where no effect shifts anything."""
    if all(one.id != StressDependence.id for one in effects):
        return []
    return [[one.with_values(C=factor * one.C) if one.id == StressDependence.id else one
             for one in effects] for factor in OTHERS]
