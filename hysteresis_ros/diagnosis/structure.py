# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How wrong the base model is by itself, and what that looks like in an arm run.

The bench's verification says how large the error of the length is that no weight can mend. On
the arm it shows as an error of the angle that is smooth in drive and load, and differs from one
direction to the other: just what a missing effect looks like. Random errors of that kind (decoys)
tell how much of the residual any effect may explain by chance.
"""

import numpy as np

from hysteresis_ros.effects import MaterialEffect, Parameter

DECOYS = 200
# Waves that make up one random field, and the length over which it changes, as a share of the
# range of each signal.
WAVES = 12
CORRELATION = 0.45
# Spread of the decoys' size, as a logarithm.
SIZE_SPREAD = 0.2


class Offset(MaterialEffect):
    """A constant added to the elongation, to see what an error of the length does to the angle."""

    id = 'offset'
    parameters = (Parameter('size', 'm', 'what is added', 0.0, 1.0, 0.0, ()),)

    def drift(self, drive, heat, inputs, surroundings):
        """Return the offset."""
        return np.full(len(drive), self.size), np.ones(len(drive))


def length_error(model) -> float:
    """
    Return the root mean square error of the length [m] that the model has on the bench.

    That of trials not fitted where there were any, else of those fitted.
    """
    metrics = model.metrics.get('length', {})
    for part in ('verification', 'identification'):
        value = metrics.get(part, {}).get('rmse')
        if value is not None and np.isfinite(value):
            return float(value)
    return 0.0


def sensitivity(problem, effects) -> np.ndarray:
    """Return how the angle follows an error of the length [rad/m], shape (n,)."""
    step = 0.01 * problem.model.surroundings.span
    up = problem.simulate([*effects, Offset(size=step)])
    down = problem.simulate([*effects, Offset(size=-step)])
    return (up - down) / (2.0 * step)


def decoys(problem, effects, predicted, rng, count: int = DECOYS) -> np.ndarray:
    """
    Draw residuals that the base model's own error may cause.

    Parameters
    ----------
    problem : Problem
        Rows and model.
    effects : sequence of Effect
        Effects of the model.
    predicted : ndarray, shape (n,)
        Response with them.
    rng : numpy.random.Generator
        Source of randomness.
    count : int
        Number of draws.

    Returns
    -------
    ndarray, shape (count, n)
        In the unit of the response, sensor noise included.
    """
    size = length_error(problem.model)
    gain = sensitivity(problem, effects)
    drive = problem.signals.get('drive', np.zeros(len(predicted)))
    direction = problem.signals.get('direction', np.ones(len(predicted)))
    coordinates = np.column_stack([_unit(drive), _unit(predicted)])
    fields = np.empty((count, len(predicted)))
    for draw in range(count):
        common, own = (_field(coordinates, rng) for _ in range(2))
        fields[draw] = common + 0.5 * np.where(direction > 0.0, own, -own)
    fields *= gain
    # The bench says how large the error is, so that only its form is left to chance, and a little
    # of its size, because the arm goes other ways than the bench.
    wanted = size * np.sqrt(np.mean(gain ** 2)) * np.exp(SIZE_SPREAD * rng.standard_normal(count))
    fields *= (wanted / np.maximum(np.sqrt(np.mean(fields ** 2, axis=1)), 1e-300))[:, None]
    return fields + problem.noise * rng.standard_normal(fields.shape)


def _unit(values):
    return (values - values.min()) / max(np.ptp(values), 1e-12)


def _field(coordinates, rng):
    """Smooth random function of the coordinates (n, d) with unit variance, shape (n,)."""
    waves = rng.standard_normal((coordinates.shape[1], WAVES)) / CORRELATION
    phases = rng.uniform(0.0, 2.0 * np.pi, WAVES)
    weights = rng.standard_normal(WAVES)
    return np.sqrt(2.0 / WAVES) * np.cos(coordinates @ waves + phases) @ weights
