# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Minor loops that do not close, because what transforms goes with what has still to transform."""

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.material import HEATING
from hysteresis_ros.effects.stages import MaterialEffect


class Kinetics(MaterialEffect):
    """
    Branches inside the major loop are scaled from its own, by what has still to transform.

    The branches of a Preisach operator meet again where they have parted. Those of the usual
    kinetics of martensite do not: a minor loop begins a little further on each time, until it fits
    in. The weights of H2 can follow the minor loops of a bench one by one, but those of a load left
    out are off, and on an arm that turns to and fro in the middle of its way angles by degrees. The
    major loop stays that of H2, and so does the share of the transformation that does not follow
    the kinetics.

    It is a property of the wire, which is sought on a bench. What a bench does not show of it is
    part of the base model's own error, and not what an arm lacks that runs as it always did. Who
    wants to know it from an arm names it, as in ``diagnose(model, data, effects=[...])``.
    """

    id = 'kinetics'
    kinds = ('arm', 'bench')
    sentence = ('What transforms is in proportion to what has still to transform, so that minor '
                'loops do not close.')
    equation = ('y = (1 - share) H2[u] + share Y, dY = (Y1 - Y) dR / (Y1 - R) while u rises and '
                'dY = Y dD / D while it falls, with the branches R(u) and D(u) of the major loop '
                'of H2 and its upper end Y1, each counted on from the farthest u since anything '
                'went the other way; with orients g Y in the place of Y and min(R, g Y1) in that '
                'of R, g = 1 - r s(F) of stress_dependent_strain')
    source = ('Tanaka, Res Mechanica 18 (1986) 251; Liang and Rogers, J. Intell. Mater. Syst. '
              'Struct. 1 (1990) 207; orients: Brinson, J. Intell. Mater. Syst. Struct. 4 (1993) '
              '229')
    shows_in = 'small loops in the middle of the way, which shift from one to the next'
    experiment = ('go to and fro between two drives in the middle of the loop five times: each '
                  'loop begins a little further on')
    confused_with = ('fatigue', 'creep')
    parameters = (
        Parameter('share', '1', 'share of the transformation that follows the kinetics', 0.1, 1.0,
                  0.0, (0.4, 0.9), limits=(0.0, 1.0)),
        Parameter('orients', '1', 'whether each branch orients what a low load has left twinned',
                  0.0, 1.0, 0.0, (0.0,), choices=(0.0, 1.0), kinds=('bench',), form=True))

    @property
    def kinetics(self) -> float:    # type: ignore[override]
        """Return the share."""
        return self.share

    @property
    def orients_anew(self) -> float:    # type: ignore[override]
        """Return whether branches do."""
        return self.orients

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether heat contracts the muscle, whose H2 is a Preisach operator."""
        return (surroundings.drive in HEATING and surroundings.sign < 0
                and surroundings.operator == 'preisach')

    @classmethod
    def doubtful(cls, surroundings: Surroundings) -> bool:
        """Whether it is tried only where it is named: always."""
        return True
