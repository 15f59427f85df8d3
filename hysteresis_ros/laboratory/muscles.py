# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Every muscle of the laboratory by the name that users give it."""

from hysteresis_ros.laboratory.brinson import BrinsonMaterial
from hysteresis_ros.laboratory.grain_wire import GrainMaterial
from hysteresis_ros.laboratory.lagoudas import LagoudasMaterial
from hysteresis_ros.laboratory.mckibben import McKibbenMaterial
from hysteresis_ros.laboratory.scp import ScpMaterial
from hysteresis_ros.laboratory.tanaka import TanakaMaterial

# Constitutive models of the wire; the first is the usual one.
MUSCLES = {kind.name: kind for kind in (
    GrainMaterial, BrinsonMaterial, LagoudasMaterial, TanakaMaterial)}
# Muscles that are no wires; they are on the bench only.
SOFT_MUSCLES = {kind.name: kind for kind in (McKibbenMaterial, ScpMaterial)}
