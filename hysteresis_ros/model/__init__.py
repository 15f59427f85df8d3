# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The model of a muscle: its file, its simulation, its inverse."""

from hysteresis_ros.model.controller import Controller, Setpoint
from hysteresis_ros.model.linear import LinearModel
from hysteresis_ros.model.muscle import MuscleModel
from hysteresis_ros.model.observer import Observer
from hysteresis_ros.model.simulation import Simulator

__all__ = ['Controller', 'LinearModel', 'MuscleModel', 'Observer', 'Setpoint', 'Simulator']
