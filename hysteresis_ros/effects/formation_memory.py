# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Martensite that keeps the strain of the load under which it formed until it is heated again."""

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.material import HEATING
from hysteresis_ros.effects.stages import MaterialEffect


class FormationMemory(MaterialEffect):
    """
    Variants that formed under a load stay as that load has oriented them.

    On a bench the load holds still, and martensite has the strain of that load either way. On an
    arm the load changes with the angle while the muscle transforms: what formed early on the way
    down keeps the strain of the raised arm's load. How the strain grows with the load is what
    `stress_dependent_strain` says; where it does not grow, nothing is kept. A part of that growth
    is elastic, because martensite is softer than austenite, and is not kept: a wire that keeps all
    of its transformation strain shows `kept` from 0.6 to 0.9. A heavier load than that of its
    formation may orient martensite anew, which shows where friction holds the arm on its way up. A
    trial begins with martensite that formed while the arm cooled down, or that the load at rest has
    oriented, as where the wire was cold before it was hung.

    It is a property of the wire that no bench of constant loads shows, so it is part of the base
    model's own error, and not what an arm lacks that runs as it always did. Who wants to know it
    names it, as in ``diagnose(model, data, effects=[...])``.
    """

    id = 'formation_memory'
    sentence = 'Martensite keeps the strain of the load under which it formed until it is heated.'
    equation = ('L = L0 + (1 - kept) S(F) y + kept P + e(F), y = H2 - L0: dP = S(F) dy where y '
                'grows, dP = P dy / y where it falls; with anew, P is at least S(F) y')
    source = ('the mean transformation strain as a memory: Lagoudas and others, Int. J. Plasticity '
              '32-33 (2012) 155; kept = 0 is detwinned martensite as of Brinson, J. Intell. Mater. '
              'Syst. Struct. 4 (1993) 229; anew = 1 is detwinning as of Popov and Lagoudas, '
              'Int. J. Plasticity 23 (2007) 1679')
    shows_in = 'heating against cooling, where the load changes with the angle'
    experiment = ('cool the arm part of the way, change its payload while it is held, heat it: '
                  'kept strain does not follow')
    confused_with = ('stress_dependent_strain', 'backlash')
    parameters = (
        Parameter('kept', '1', 'share of the strain that is kept', 0.1, 1.0, 0.0, (0.4, 0.9),
                  limits=(0.0, 1.0)),
        Parameter('anew', '1', '1: a heavier load than that of its formation orients martensite '
                  'anew, 0: it does not', 0.0, 1.0, 0.0, (0.0,), choices=(0.0, 1.0),
                  kinds=('arm',)),
        Parameter('cooled', '1', '1: a trial begins with martensite that formed while the arm '
                  'cooled down, 0: that the load at rest has oriented', 0.0, 1.0, 1.0, (1.0,),
                  choices=(1.0, 0.0), kinds=('arm',)))

    @property
    def keeps_strain(self) -> float:    # type: ignore[override]
        """Return the share."""
        return self.kept

    @property
    def oriented_anew(self) -> bool:    # type: ignore[override]
        """Return whether a heavier load orients it anew."""
        return self.anew == 1.0

    @property
    def cooled_on_arm(self) -> bool:    # type: ignore[override]
        """Return whether a trial begins with what the way down to rest has left."""
        return self.cooled == 1.0

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all, on a muscle that heat transforms."""
        return surroundings.load > 0.0 and surroundings.drive in HEATING

    @classmethod
    def doubtful(cls, surroundings: Surroundings) -> bool:
        """Whether it is tried only where it is named: always."""
        return True
