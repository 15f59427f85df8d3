# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's linear model, which ignores hysteresis (Eqs. 11 and 15)."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hysteresis_ros.errors import ModelFileError


@dataclasses.dataclass(frozen=True)
class LinearModel:
    """
    ``F = k1 V + F0`` at resting length and ``L = k2 (F - k1 V - F0)`` (Eq. 11).

    For a muscle without a recorded load, F is zero.

    Parameters
    ----------
    k1 : float
        Force per drive [N/V for a voltage].
    k2 : float
        Elongation per force [m/N]; the paper's 0.88 mm/V is a misprint for mm/N.
    F0 : float
        Pretension [N].
    """

    k1: float
    k2: float
    F0: float

    def force(self, drive: ArrayLike) -> Any:
        """Force [N] at resting length under `drive`."""
        return self.k1 * np.asarray(drive) + self.F0

    def length(self, drive: ArrayLike, load: ArrayLike) -> Any:
        """Elongation under `drive` and `load`."""
        return self.k2 * (np.asarray(load) - self.k1 * np.asarray(drive) - self.F0)

    def drive_for_force(self, force: ArrayLike) -> Any:
        """Drive for a force at resting length: Eq. 15 with L = 0."""
        return (np.asarray(force) - self.F0) / self.k1

    def drive_for_length(self, length: ArrayLike, load: ArrayLike) -> Any:
        """Drive for an elongation under a load (Eq. 15)."""
        return (np.asarray(load) - self.F0 - np.asarray(length) / self.k2) / self.k1

    def to_dict(self) -> dict[str, float]:
        """Return the three numbers by name."""
        return {name: float(value) for name, value in dataclasses.asdict(self).items()}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> 'LinearModel':
        """
        Build from what `to_dict` returned.

        Raises
        ------
        ModelFileError
            If a number is missing or not finite.
        """
        try:
            model = cls(**{name: float(content[name]) for name in ('k1', 'k2', 'F0')})
        except (KeyError, TypeError, ValueError):
            raise ModelFileError('the linear model needs the numbers k1, k2 and F0') from None
        if not all(math.isfinite(value) for value in dataclasses.astuple(model)):
            raise ModelFileError('the linear model has a number that is not finite')
        return model
