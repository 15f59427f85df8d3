# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the instruments make of the truth: resolution and noise."""

import math

import numpy as np

# AMT103 with 2048 pulses per turn, of which both edges of both channels count.
COUNTS_PER_REVOLUTION = 4 * 2048
COUNT = 2.0 * math.pi / COUNTS_PER_REVOLUTION

# Load cell: 0.1 % of 15 N. Position sensor: Honeywell SPS-L035-LATS, 0.04 mm.
FORCE_NOISE = 0.015
LENGTH_RESOLUTION = 4e-5
LENGTH_NOISE = 1.5e-5
SUPPLY = 12.0
SUPPLY_NOISE = 0.01
AMBIENT_RESOLUTION = 0.0625


def encoder_counts(angle: float) -> int:
    """Return the quadrature counts of an angle [rad]; 0 is the upward vertical."""
    return math.floor(angle / COUNT)


def counted_angle(counts: int) -> float:
    """Return the angle in the middle of a count [rad]."""
    return (counts + 0.5) * COUNT


def load_cell(force: float, rng: np.random.Generator, noise: float = FORCE_NOISE) -> float:
    """Return the load cell's reading of a force [N], with noise of a standard deviation [N]."""
    return force + noise * rng.standard_normal()


def position_sensor(length: float, rng: np.random.Generator) -> float:
    """Return the position sensor's reading of an elongation [m]."""
    noisy = length + LENGTH_NOISE * rng.standard_normal()
    return LENGTH_RESOLUTION * round(noisy / LENGTH_RESOLUTION)


def thermometer(temperature: float, rng: np.random.Generator) -> float:
    """Return the ambient thermometer's reading [degC]."""
    noisy = temperature + 0.5 * AMBIENT_RESOLUTION * rng.standard_normal()
    return AMBIENT_RESOLUTION * round(noisy / AMBIENT_RESOLUTION)


def supply_meter(supply: float, rng: np.random.Generator) -> float:
    """Return the board's reading of its own supply [V]."""
    return supply + SUPPLY_NOISE * rng.standard_normal()
