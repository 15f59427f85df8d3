# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The identified model of a muscle: operators, linear model, effects, geometry, provenance."""

from __future__ import annotations

import copy
import dataclasses
import math
import os
from collections.abc import Callable, Sequence
from typing import Any, TYPE_CHECKING, TypeAlias, Union

import numpy as np

from hysteresis_ros.bicep.balance import ArmBalance
from hysteresis_ros.bicep.breaking import BreakingBalance
from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.bicep.yielding import YieldingBalance
from hysteresis_ros.effects import Effect, Surroundings
from hysteresis_ros.effects.base import Values
from hysteresis_ros.effects.stages import Statics
from hysteresis_ros.errors import ModelFileError, ParameterError
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.first_stage import FirstStage
from hysteresis_ros.model.kinetic_stage import with_kinetics
from hysteresis_ros.model.linear import LinearModel
from hysteresis_ros.model.places import stage_of_places
from hysteresis_ros.model.replicates import Replicate
from hysteresis_ros.operators import HysteresisOperator

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model.controller import Controller
    from hysteresis_ros.model.observer import Observer

# The arm of a model, advanced by samples and by trials.
Lifting: TypeAlias = Union[ArmBalance, BreakingBalance, YieldingBalance]

# A wire cold enough to be fully martensite is one without drive.
COLD_DRIVE = {'voltage': 0.0, 'current': 0.0, 'pressure': 0.0, 'power': 0.0}


@dataclasses.dataclass
class MuscleModel:
    """
    A muscle as ``F = H1[V]`` and ``L = H2[F - H1[V]]`` (Eqs. 6 and 7), with effects.

    Parameters
    ----------
    kind : str
        'two-stage', or 'preisach' for one operator of the drive; other operators keep the kind.
    drive, load_name, response : str
        What was applied, what loaded the muscle ('' or None for nothing), what was measured.
    length_stage : HysteresisOperator
        H2 with an output that rises with its input ``u = sign (x - F)``.
    force_stage : HysteresisOperator, optional
        H1. Without it x is the drive itself and the load does not count.
    sign : int
        -1 for a muscle that contracts when driven, 1 for one that extends.
    linear : LinearModel, optional
        The paper's comparison.
    effects : list of Effect
        What was added by `extend`.
    geometry : BicepGeometry, optional
        The arm it drives.
    ranges : dict of str to (float, float)
        What was seen of drive, load and response, and of the ambient temperature [degC] where that
        was recorded.
    mean_load : float
        Mean load of the bench's length table.
    replicates : list of Replicate
        H2 and effects as identified without one of the bench's loads each.
    metrics, provenance : dict
        Errors of the identification (of lengths also `rmse_by_load` [m] at `loads` [N], and
        `relative_rmse` at the ends of the transformation, halfway and of the thresholds), and
        where the model came from.
    """

    kind: str
    drive: str
    load_name: str | None
    response: str
    length_stage: HysteresisOperator | None
    force_stage: HysteresisOperator | None = None
    sign: int = -1
    linear: LinearModel | None = None
    effects: list[Effect] = dataclasses.field(default_factory=list)
    geometry: BicepGeometry | None = None
    ranges: dict[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    mean_load: float = 0.0
    replicates: list[Replicate] = dataclasses.field(default_factory=list)
    metrics: dict[str, Any] = dataclasses.field(default_factory=dict)
    provenance: dict[str, Any] = dataclasses.field(default_factory=dict)

    def __repr__(self) -> str:
        """Return kind, drive and effects in one line."""
        effects = ', '.join(effect.id for effect in self.effects) or 'no effects'
        return f'<MuscleModel {self.kind} of {self.drive}: {effects}>'

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> MuscleModel:
        """Read a model file; see `hysteresis_ros.model.files.load`."""
        from hysteresis_ros.model import files
        return files.load(path)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a model file; see `hysteresis_ros.model.files.save`."""
        from hysteresis_ros.model import files
        files.save(self, path)

    @property
    def surroundings(self) -> Surroundings:
        """Scales of the muscle that effects refer to."""
        low, high = self.ranges.get(self.response, (0.0, 1.0))
        span = max(high - low, 1e-12)
        if self.response == 'strain':
            length = 1.0
        elif self.geometry is not None:
            length = self.geometry.resting_length
        else:
            # A muscle's stroke is about a twentieth of its length.
            length = 20.0 * span
        largest = max(abs(value) for value in self.ranges.get(self.drive, (0.0, 1.0)))
        bare = Chain([], Surroundings(1.0, 1.0, 1.0, 1.0, self.drive))
        # The force table was measured at the resting length.
        rest_load = self.force_stage.output_range[0] if self.force_stage is not None else 0.0
        least = self.length_stage.output_range[0] if self.length_stage is not None else 0.0
        arm = self.geometry
        scales = (arm.moved_mass, arm.largest_moment, arm.moment_of_inertia,
                  arm.clamp_distance) if arm else ()
        return Surroundings(length, self.mean_load, float(bare.to_drive_squared(largest)), span,
                            self.drive, self.load_name, self.response, self.cold_drive,
                            self.drive_range, self.sign, rest_load, least,
                            int(arm.muscle_count) if arm else 1,
                            self.length_stage.kind if self.length_stage is not None else '',
                            self.ranges.get('ambient_temperature'), *scales)

    def with_effects(self, effects: Sequence[Effect]) -> MuscleModel:
        """Return a copy with other effects and the same operators."""
        return dataclasses.replace(self, effects=list(effects))

    def chain(self) -> Chain:
        """Return the stages with the model's effects."""
        return Chain(self.effects, self.surroundings)

    def first_stage(self, chain: Chain) -> FirstStage:
        """Return the map from drive squared to x, with a memory of its own."""
        return FirstStage(self.force_stage, chain)

    @property
    def cold_drive(self) -> float:
        """The drive of the cold state that every trial starts from."""
        if self.drive in COLD_DRIVE:
            return COLD_DRIVE[self.drive]
        return self.ranges.get(self.drive, (0.0, 0.0))[0]

    @property
    def drive_range(self) -> float:
        """Width of the drive's range, on which steps and cycles are counted."""
        low, high = self.ranges.get(self.drive, (0.0, 1.0))
        return max(high - low, 1e-12)

    def martensite(self, output: Values) -> Values:
        """Return the share of the cold phase at an output of H2 [m], 0 to 1, of any shape."""
        low, high = self.require_length_range()
        share = np.clip((output - low) / max(high - low, 1e-12), 0.0, 1.0)
        return share if self.sign < 0 else 1.0 - share

    def predict(self, measurement: Measurement, method: str = 'preisach') -> np.ndarray:
        """
        Simulate the response of every row from the inputs alone.

        Parameters
        ----------
        measurement : Measurement
            Bench table or arm run; its response column is not looked at.
        method : {'preisach', 'linear'}
            The hysteresis model with its effects, or the paper's linear model.

        Returns
        -------
        ndarray, shape (rows,)
            Force [N], length [m], strain or angle [rad].

        Raises
        ------
        ParameterError
            If the model lacks what this kind of measurement needs.
        """
        from hysteresis_ros.model import simulation
        if method == 'linear':
            return simulation.predict_linear(self, measurement)
        if method != 'preisach':
            raise ParameterError(f'method must be preisach or linear, not {method!r}')
        return simulation.predict(self, measurement)

    def controller(self, **options: Any) -> Controller:
        """Return the inverse with memory; see `Controller`."""
        from hysteresis_ros.model.controller import Controller
        return Controller(self, **options)

    def observer(self) -> Observer:
        """Return the forward model that runs along with a recording; see `Observer`."""
        from hysteresis_ros.model.observer import Observer
        return Observer(self)

    def balance(self, chain: Chain, statics: Statics | None = None, muscles: int | None = None
                ) -> ArmBalance:
        """
        Return the balance between the muscle, its memory wiped, and the arm.

        Parameters
        ----------
        chain : Chain
            Effects of the model.
        statics : Statics, optional
            The arm that the geometry describes at rest, where it was computed before.
        muscles : int, optional
            How many muscles carry the load; by default those of the geometry.

        Raises
        ------
        ParameterError
            If the model has no arm, or a muscle that cannot lift it.
        ModelFileError
            If the model has no length stage.
        """
        geometry, stage = self.require_geometry(), self._stage_of(chain)
        loaded = self.first_stage(chain).loaded
        if self.sign > 0:
            raise ParameterError('the model is of a muscle that extends when driven; the bicep '
                                 'needs one that contracts')
        if self.response != 'length' or (loaded and self.load_name != 'force'):
            raise ParameterError(
                f'the model gives {self.response} under {self.load_name}; the bicep needs a '
                'length table with forces')
        return ArmBalance(stage, geometry, chain, loaded, statics, muscles)

    def lifting(self, chain: Chain, balance: Callable[[int | None], ArmBalance] | None = None
                ) -> Lifting:
        """
        Return the same with what happens to the muscles meanwhile: they yield, or one breaks.

        Parameters
        ----------
        chain : Chain
            Effects of the model.
        balance : callable, optional
            Returns the balance for a number of muscles, None for all.
        """
        make = balance or (lambda muscles: self.balance(chain, muscles=muscles))
        intact = make(None)
        arm: ArmBalance | BreakingBalance = intact
        if chain.break_time < math.inf:
            arm = BreakingBalance(intact, make(self.remaining), chain.break_time)
        load, compliance = chain.yields
        return arm if load == math.inf else YieldingBalance(arm, load, compliance)

    @property
    def remaining(self) -> int:
        """How many muscles lift the arm after one has broken; the last one does not break."""
        return max(int(self.require_geometry().muscle_count) - 1, 1)

    def require_geometry(self) -> BicepGeometry:
        """Return the arm's geometry; ParameterError if the model has none."""
        if self.geometry is None:
            raise ParameterError(
                'the model has no arm geometry; identify it with --geometry geometry.yaml')
        return self.geometry

    def require_length_stage(self, chain: Chain | None = None) -> HysteresisOperator:
        """
        Return a copy of H2 with its memory wiped.

        Parameters
        ----------
        chain : Chain, optional
            Effects of the model, some of which make another operator of it; see `places` and
            `kinetic_stage`.

        Raises
        ------
        ModelFileError
            If the model has none.
        ParameterError
            If it has one of which they cannot.
        """
        operator = copy.deepcopy(
            self._length_stage() if chain is None else self._stage_of(chain))
        operator.reset()
        return operator

    def _stage_of(self, chain: Chain) -> HysteresisOperator:
        return with_kinetics(self, chain, stage_of_places(self, chain, self._length_stage()))

    def require_length_range(self) -> tuple[float, float]:
        """Return what H2 can give; ModelFileError if the model has none."""
        return self._length_stage().output_range

    def _length_stage(self) -> HysteresisOperator:
        if self.length_stage is None:
            raise ModelFileError(
                'the model has no length stage; identify it with a length table')
        return self.length_stage
