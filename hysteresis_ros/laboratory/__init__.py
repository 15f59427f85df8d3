# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The virtual laboratory: physics of a shape memory bench and of the robotic bicep.

It is the experiment, not the model, and shares nothing with operators, effects and identification:
a `wire` follows one of several constitutive models: a population of grains that switch with
temperature and stress (`grains`, `grain_wire`), `brinson`, `lagoudas` or `tanaka`. It is heated by
Eq. 1 (`heat`), on a bench (`bench`) or, three of them, on an arm (`parallel_wires`, `linkage`,
`arm`) that need not be what its data sheet says (`conditions`, `hidden_physics`, `unlisted`).
Muscles that are no wires (`soft_muscle`: `mckibben`, `scp`) have a bench of their own
(`soft_bench`). `plant` puts one specimen together, `sequences` and `experiments` are what is done
with it, and `board` puts the arm behind a simulated PWM board.
"""

from hysteresis_ros.laboratory.experiments import EXPERIMENTS, experiment_tables, write_experiment
from hysteresis_ros.laboratory.hidden_physics import EFFECTS, hidden_effects, unlisted_effects
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import MUSCLES, Plant, SOFT_MUSCLES

__all__ = ['EFFECTS', 'EXPERIMENTS', 'GEOMETRY', 'MUSCLES', 'Plant', 'SOFT_MUSCLES',
           'experiment_tables', 'hidden_effects', 'unlisted_effects', 'write_experiment']
