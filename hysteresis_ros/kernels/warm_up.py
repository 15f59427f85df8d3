# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Make the compiled functions ready before they are needed.

A function is compiled, or read from the cache, when it is first called. In a control loop that
would be a pause of seconds, so each loop is run through once before it counts. The cache is filled
after an installation: see `compile_kernels`.
"""

from __future__ import annotations

import contextlib
import math
import time
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.errors import HysteresisError

if TYPE_CHECKING:
    from hysteresis_ros.model import Controller, MuscleModel

# The first call, one in each direction, and one that changes nothing.
SHARES = 0.5, 0.9, 0.1, 0.1
DT = 0.1    # s


def warm_up(model: MuscleModel | None = None) -> float:
    """
    Run controller and observer of a model through a few samples, and return how long it took.

    Parameters
    ----------
    model : MuscleModel, optional
        It stays as it is. By default a small one without effects.

    Returns
    -------
    float
        Time taken [s].
    """
    start = time.perf_counter()
    model = small_model() if model is None else model
    warm_up_controller(model)
    warm_up_observer(model)
    return time.perf_counter() - start


def warm_up_controller(model: MuscleModel) -> float:
    """Run a controller of the model through a few setpoints; return how long it took [s]."""
    start = time.perf_counter()
    # What a model cannot do, it says when it is asked in earnest.
    with contextlib.suppress(HysteresisError):
        arm = model.geometry is not None
        for horizon in (math.inf, 1.0):
            controller = model.controller(arm=arm, horizon=horizon)
            for sample, share in enumerate(SHARES):
                length, force = _reference(model, controller, share)
                controller.setpoint(length, force, sample * DT, ambient=math.nan)
                controller.hold(sample * DT + 0.5 * DT)
            controller.reset()
    return time.perf_counter() - start


def warm_up_observer(model: MuscleModel) -> float:
    """Run an observer of the model through a few samples; return how long it took [s]."""
    start = time.perf_counter()
    with contextlib.suppress(HysteresisError):
        observer = model.observer()
        for sample, share in enumerate(SHARES):
            observer.step(sample * DT, _within(model.ranges[model.drive], share), math.nan)
        observer.reset()
    return time.perf_counter() - start


def small_model() -> MuscleModel:
    """Return a two-stage model of the paper's size with few cells and an arm."""
    from hysteresis_ros.bicep.geometry import BicepGeometry
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.operators import Preisach

    geometry = BicepGeometry(
        clamp_distance=0.017, clamp_height=0.006, anchor_height=0.2655, forearm_length=0.30,
        resting_length=0.27, payload_mass=0.1, forearm_mass=0.04)
    low, high = (float(geometry.length(angle)) for angle in (0.8, 2.4))
    cells = np.ones(4 * 5 // 2)
    return MuscleModel(
        kind='two-stage', drive='voltage', load_name='force', response='length',
        force_stage=Preisach(np.linspace(0.0, 6.0, 5), cells * 14.0 / 36.0, 7.5),
        length_stage=Preisach(np.linspace(-10.0, 6.0, 5), cells * (high - low) / 256.0,
                              0.5 * (low + high)),
        geometry=geometry, mean_load=4.0,
        ranges={'voltage': (0.0, 6.0), 'force': (0.5, 14.5), 'length': (low, high)})


def _reference(model: MuscleModel, controller: Controller,
               share: float) -> tuple[float, float]:
    """Return a length [m] and a force [N] within reach of the arm, or else of the bench."""
    if model.geometry is not None:
        # Far from the ends of the linkage, where a reference may be out of reach.
        angle = _within(model.geometry.angle_range, 0.4 + 0.2 * share)
        with contextlib.suppress(HysteresisError):
            return controller.reference(angle)
    return (_within(model.ranges[model.response], share),
            _within(model.ranges.get(model.load_name or '', (0.0, 0.0)), share))


def _within(limits: tuple[float, float], share: float) -> float:
    low, high = limits
    return float(low + share * (high - low))
