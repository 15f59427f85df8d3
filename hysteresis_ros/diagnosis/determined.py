# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether recordings determine the parameters of an effect that was fitted to them."""

from __future__ import annotations

from collections.abc import Iterable
import math

from hysteresis_ros.effects import Effect, Parameter

# An interval that covers this share of a physical range says nothing.
SPANS = 0.9


def spans(parameter: Parameter, low: float, high: float) -> bool:
    """Whether an interval of a parameter covers its whole physical range, but for a little."""
    least, most = (-parameter.high if parameter.both_signs else parameter.low), parameter.high
    return min(high, most) - max(low, least) >= SPANS * (most - least)


def undetermined(effect: Effect, kind: str) -> list[str]:
    """Return which parameters of a fitted effect have intervals that span their whole range."""
    found = []
    for parameter in effect.parameters:
        if parameter.choices or parameter.form or kind not in parameter.kinds:
            continue
        if spans(parameter, *effect.intervals.get(parameter.name, (math.nan, math.nan))):
            found.append(f'the interval of {effect.id}.{parameter.name} spans its physical range: '
                         'these recordings do not determine it')
    return found


def not_determined(effect: Effect, kind: str) -> str | None:
    """
    Return why recordings do not determine the size of a fitted effect, None if they do.

    The size is `Effect.size_parameter`. It is not determined where its interval spans the whole
    physical range, or where one too small to matter lies inside: then nothing shows the effect.
    """
    size = effect.size_parameter
    notes = [note for note in undetermined(effect, kind) if f'{effect.id}.{size.name} ' in note]
    if notes:
        return notes[0]
    low, high = effect.intervals.get(size.name, (math.nan, math.nan))
    if size.both_signs:
        small = low <= size.low and high >= -size.low
    else:
        # An interval that ends below says that there is nothing.
        small = low <= size.low and (high >= size.low or size.neutral <= size.low)
    if small:
        return f'the interval of {effect.id}.{size.name} contains a value too small to matter'
    return None


def undetermined_names(effects: Iterable[Effect], kind: str) -> set[str]:
    """Return the identifiers of fitted effects whose sizes recordings do not determine."""
    return {effect.id for effect in effects if not_determined(effect, kind)}
