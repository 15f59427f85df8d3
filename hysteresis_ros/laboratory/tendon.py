# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A polymer cord between muscle and weight, which goes on stretching with a power of time.

The law of W. N. Findley, 26-year creep and recovery of poly(vinyl chloride) and polyethylene,
Polymer Engineering and Science 27 (1987) 582-585, under a dead weight F::

    e(t) = C F (t / t_1)^n,    t_1 = 60 s
"""

import dataclasses

# t_1 [s].
MINUTE = 60.0


@dataclasses.dataclass(frozen=True)
class Tendon:
    """
    A cord; by default it does not stretch.

    Parameters
    ----------
    compliance : float
        C, elongation over tension after a minute [m/N].
    exponent : float
        n.
    """

    compliance: float = 0.0
    exponent: float = 0.2

    def elongation(self, tension: float, time: float) -> float:
        """Return it under a tension [N] for a time [s], in m."""
        return self.compliance * tension * (time / MINUTE) ** self.exponent
