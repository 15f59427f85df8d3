# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The encoder's disc on the shaft, and what its reading head sees of it.

The head is fixed to the frame. Seen from the centre of a disc that sits off the shaft's axis, the
head is in another direction than seen from the axis; it is this direction that the track counts.
"""

import dataclasses
import math


@dataclasses.dataclass(frozen=True)
class EncoderDisc:
    """
    A disc; by default it is centred, and has as many pulses as its reader counts on.

    Parameters
    ----------
    radius : float
        Of the track that is read, the AMT103's [m].
    off_centre : float
        Distance of the disc's centre from the axis [m].
    direction : float
        Direction from the axis to the centre where the shaft's angle is zero [rad], seen from that
        to the head.
    pulses : float
        Per revolution, over those that the reader counts on.
    counted_from : float
        Angle of the shaft at which the counts were set [rad].
    """

    radius: float = 0.011
    off_centre: float = 0.0
    direction: float = 0.0
    pulses: float = 1.0
    counted_from: float = 0.0

    def reading(self, angle: float) -> float:
        """Return the angle that the counts give for an angle of the shaft [rad]."""
        return self.counted_from + self.pulses * (self._seen(angle) - self.counted_from)

    def _seen(self, angle: float) -> float:
        """Return the angle of the disc under the head [rad]."""
        if self.off_centre == 0.0:
            return angle
        turned = angle + self.direction
        return angle + math.atan2(self.off_centre * math.sin(turned),
                                  self.radius - self.off_centre * math.cos(turned))
