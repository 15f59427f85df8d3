# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of an arm that the model itself has made, and what is found in them."""

import dataclasses

from model_support import effect_of, runs
import numpy as np

from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.selection import Selection
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.measurements import Measurement

TRIED = ('payload_error', 'encoder_offset', 'supply_sag', 'frame_tilt')
NOISE = 2e-3


def recording(model, effects=(), noise=NOISE, change=0.0, seed=5):
    """Return three settled trials of the arm with effects, with noise and a change of the angle."""
    clean = runs(model.with_effects(list(effects)), rows=30)
    rng = np.random.default_rng(seed)
    angle = clean.column('angle') + noise * rng.standard_normal(clean.rows) + change
    return Measurement.from_columns({**clean.columns, 'angle': angle})


def selection(model, measured, names=TRIED, seed=0, **settings):
    """Return what is found of some effects in a recording."""
    problem = problem_for(model, [measured], names)
    found = Selection(problem, dataclasses.replace(Settings(), **settings),
                      np.random.default_rng(seed), lambda items, total: items)
    found.run()
    return found


def heavier(model):
    """Return what is found where the arm carries 15 g more."""
    return selection(model, recording(model, [effect_of(model, 'payload_error', dm=15.0)]))
