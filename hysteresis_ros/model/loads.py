# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the bench has shown a muscle for an arm, under the loads that the arm puts on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.errors import ParameterError

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model.muscle import MuscleModel

# A load this share of the bench's range beyond its ends is as good as at an end.
MARGIN = 0.02
# Two neighbouring loads of the bench are far apart if every other gap is smaller by this factor.
WIDE = 1.5
# No muscle lengthens or shortens by this share of its resting length: a braided one, which does so
# the most, by a third.
LARGEST_STRAIN = 0.5
# A load this many times beyond the bench's comes from a value in another unit.
FAR_BEYOND = 10.0


def reached_angles(model: MuscleModel) -> np.ndarray:
    """Return angles [rad] of the arm at the lengths that the bench has shown, shape (k,)."""
    geometry = model.require_geometry()
    low, high = geometry.angle_range
    shortest, longest = model.ranges['length']
    theta = geometry.angle(np.linspace(shortest, longest, 100))
    return theta[np.isfinite(theta) & (theta >= low) & (theta <= high)]


def uncovered_load(model: MuscleModel, theta: np.ndarray) -> (
        tuple[tuple[float, float], tuple[float, float], bool] | None):
    """
    Compare the load of an arm with those that the model was identified under.

    Parameters
    ----------
    model : MuscleModel
    theta : ndarray, shape (k,)
        Angles [rad] that the arm takes.

    Returns
    -------
    (float, float), (float, float), bool, or None
        The arm's least and largest load; the bench's, or those on either side of a gap of the bench
        that the arm's load lies in; whether it is a gap. None if the bench covers the arm's load,
        or where that is not known.
    """
    loads = np.unique(np.round(model.provenance.get('length', {}).get('loads', ()), 3))
    geometry = model.geometry
    if geometry is None or model.load_name != 'force' or len(loads) == 0 or len(theta) == 0:
        return None
    low, high = geometry.angle_range
    force = geometry.force(np.clip(theta, low, high))
    arm = float(np.min(force)), float(np.max(force))
    margin = MARGIN * max(loads[-1] - loads[0], loads[-1])
    if arm[0] < loads[0] - margin or arm[1] > loads[-1] + margin:
        return arm, (float(loads[0]), float(loads[-1])), False
    gaps = np.diff(loads)
    if len(gaps) < 2:
        return None
    widest = int(np.argmax(gaps))
    below, above = float(loads[widest]), float(loads[widest + 1])
    wide = gaps[widest] > WIDE * np.max(np.delete(gaps, widest))
    inside = arm[0] < above - margin and arm[1] > below + margin
    return (arm, (below, above), True) if wide and inside else None


def check_lengths(model: MuscleModel, length: Measurement | None = None) -> None:
    """
    Refuse lengths that are no elongations of a muscle that contracts.

    Parameters
    ----------
    model : MuscleModel
    length : Measurement, optional
        The table that it was identified from. A model of a muscle that extends may have either
        sign, and fits badly with both.

    Raises
    ------
    ParameterError
        If an arm is known and the lengths are larger than any elongation of its muscle, or rise
        with the drive.
    """
    if model.geometry is None or model.response != 'length' or 'length' not in model.ranges:
        return
    rest, largest = model.geometry.resting_length, max(map(abs, model.ranges['length']))
    if largest > LARGEST_STRAIN * rest:
        raise ParameterError(
            f'the length table reaches {largest:.4g} m, which is no elongation of a muscle of '
            f'{rest:.4g} m; give the length less the resting length, or check its unit')
    if model.sign > 0 or length is not None and _extends(length):
        raise ParameterError(
            'the length table is of a muscle that extends when driven, and the arm needs one that '
            'contracts; give its elongation, which is negative while it is shorter than at rest')


def _extends(length: Measurement) -> bool:
    """Whether a muscle is longer, the more it is driven, under the same load."""
    drive, response = length.column(length.drive), length.column(length.response)
    return sum(float(np.sum((drive[rows] - np.mean(drive[rows])) * response[rows]))
               for _, rows in length.split()) > 0.0


def check_loads(model: MuscleModel) -> None:
    """
    Refuse an arm whose loads are of another order than those of the bench.

    Raises
    ------
    ParameterError
        If they are, which a mass or length in another unit explains. Nothing is checked where the
        loads of arm or bench are not known.
    """
    if model.geometry is None or model.response != 'length':
        return
    found = uncovered_load(model, np.array(model.geometry.angle_range).mean(keepdims=True))
    if found is None:
        return
    arm, bench, _ = found
    if arm[0] > FAR_BEYOND * bench[1] or arm[1] < bench[0] / FAR_BEYOND:
        raise ParameterError(
            f'geometry: the arm pulls each muscle with about {arm[0]:.3g} N, the bench with '
            f'{bench[0]:.3g} to {bench[1]:.3g} N; is a mass in g or a length in mm? Give the unit '
            'in the geometry, such as "payload_mass: 100 g", or bench tables with these loads')
