# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The virtual laboratory: physics of a shape memory bench and of the robotic bicep.

It is the experiment, not the model, and shares nothing with operators, effects and identification:
a `wire` follows one of several constitutive models: a population of grains that switch with
temperature and stress (`grains`, `grain_wire`), `brinson` or `lagoudas`. It is heated by Eq. 1
(`heat`), on a bench (`bench`) or, three of them, on an arm (`muscle`, `linkage`, `arm`) that need
not be what its data sheet says (`conditions`, `effects`, `unlisted`). `plant` puts one specimen
together, `sequences` and `protocols` are the experiments.
"""

from hysteresis_ros.laboratory.effects import EFFECTS, hidden_effects, unlisted_effects
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import MUSCLES, Plant
from hysteresis_ros.laboratory.protocols import PROTOCOLS, protocol_tables, write_protocol

__all__ = ['EFFECTS', 'GEOMETRY', 'MUSCLES', 'PROTOCOLS', 'Plant', 'hidden_effects',
           'protocol_tables', 'unlisted_effects', 'write_protocol']
