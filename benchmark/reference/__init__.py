# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The arm and its operator in plain Python, kept as the measure of the compiled kernels.

Nothing of the package uses this. Benchmarks divide by its speed and tests compare with its
results.
"""

from benchmark.reference.balance import ArmBalance
from benchmark.reference.preisach import Preisach

__all__ = ['ArmBalance', 'Preisach', 'arm_of']


def arm_of(model) -> ArmBalance:
    """
    Return the uncompiled balance of a model's arm.

    Parameters
    ----------
    model : hysteresis_ros.model.MuscleModel
        With a geometry and a Preisach operator as its length stage.
    """
    chain = model.chain()
    return ArmBalance(Preisach(model.require_length_stage(chain)), model.require_geometry(), chain,
                      model.first_stage(chain).loaded)
