# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What models with several coupled inputs have in common: stages, memory, files."""

import abc
import math
from typing import Any, ClassVar, Mapping, Sequence

import numpy as np

from .base import HysteresisOperator, Inversion, operator_from_dict, take
from ..errors import ParameterError


class Coupled(abc.ABC):
    """
    A model of one output over several inputs, made of operators with one input each.

    Parameters
    ----------
    stages : sequence of HysteresisOperator
        One operator an input. The first takes the drive, which the inverse solves for; the
        others take the coupled inputs. The model owns them: their memory is its memory.

    """

    kind: ClassVar[str] = ''
    _kinds: ClassVar[dict[str, type['Coupled']]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        """Enter the class under its kind, for `coupled_from_dict`."""
        super().__init_subclass__(**options)
        Coupled._kinds[cls.kind] = cls

    def __init__(self, stages: Sequence[HysteresisOperator]) -> None:
        self.stages = tuple(stages)
        for stage in self.stages:
            if not isinstance(stage, HysteresisOperator):
                raise ParameterError(f'{self.kind} model: {stage!r} is no hysteresis operator')
        if len(set(map(id, self.stages))) != len(self.stages):
            raise ParameterError(f'{self.kind} model: two stages are the same object, but each '
                                 'needs a memory of its own')
        self._off = (0.0,) * len(self.stages)

    @property
    @abc.abstractmethod
    def output(self) -> float:
        """Output for the inputs committed last."""

    @property
    def saturated(self) -> bool:
        """Whether a committed input was outside the range of its operator."""
        return any(stage.saturated for stage in self.stages)

    @abc.abstractmethod
    def step(self, inputs: Sequence[float]) -> float:
        """Commit inputs, the drive first, and return the output; see the operators' `step`."""

    @abc.abstractmethod
    def peek(self, inputs: Sequence[float]) -> float:
        """Return the output that `step` would give, and commit nothing."""

    @abc.abstractmethod
    def simulate(self, inputs: np.ndarray) -> np.ndarray:
        """
        Commit a sequence of inputs and return the outputs.

        Parameters
        ----------
        inputs : ndarray, shape (M, S)
            A column for each stage, the drive first.

        Returns
        -------
        ndarray, shape (M,)

        """

    def invert(self, y: float, coupled: Sequence[float] = (),
               dead_bands: Sequence[float] = ()) -> Inversion:
        """
        Find the drive for an output and given coupled inputs; commit nothing.

        Parameters
        ----------
        y : float
            Requested output.
        coupled : sequence of float, length S - 1
            The inputs of the stages after the first.
        dead_bands : sequence of float, length S or empty
            Of each stage's inverse, see `HysteresisOperator.invert`.

        Returns
        -------
        Inversion
            The drive, the output that it gives with these coupled inputs, and whether a stage
            was asked for more than it can give. If a number is not finite the present drive
            and output, flagged as saturated.

        """
        return Inversion(*self.solve(y, coupled, dead_bands))

    def solve(self, y: float, coupled: Sequence[float],
              dead_bands: Sequence[float] = ()) -> tuple[float, float, bool]:
        """Return what `invert` does as a plain tuple, which is faster inside a control loop."""
        if len(coupled) != len(self.stages) - 1:
            raise ParameterError(f'{self.kind} model: {len(coupled)} coupled inputs given, '
                                 f'{len(self.stages) - 1} needed')
        for value in (y, *coupled):
            if not -math.inf < value < math.inf:
                return self.stages[0].input, self.output, True
        return self._solve(y, coupled, dead_bands or self._off)

    @abc.abstractmethod
    def _solve(self, y: float, coupled: Sequence[float],
               dead_bands: Sequence[float]) -> tuple[float, float, bool]:
        """Solve for finite requests: drive, its output, whether out of reach."""

    def columns(self, inputs: np.ndarray) -> np.ndarray:
        """Return inputs as a checked array of shape (M, S)."""
        array = np.asarray(inputs, dtype=float)
        if array.ndim != 2 or array.shape[1] != len(self.stages):
            raise ParameterError(f'{self.kind} model: inputs have shape {array.shape}, not '
                                 f'(rows, {len(self.stages)})')
        return array

    def reset(self) -> None:
        """Bring every stage into its cold state."""
        for stage in self.stages:
            stage.reset()

    def save(self) -> dict[str, Any]:
        """Return the memory of all stages as plain numbers and lists."""
        return {'kind': self.kind, 'stages': [stage.save() for stage in self.stages]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """
        Take over a memory that `save` returned.

        Raises
        ------
        ParameterError
            If it does not fit. All stages keep the memory that they had.

        """
        where = f'memory of a {self.kind} model'
        states = take(state, 'stages', where)
        if take(state, 'kind', where) != self.kind or not isinstance(states, list) or len(
                states) != len(self.stages):
            raise ParameterError(f'{where}: not that of a {self.kind} model with '
                                 f'{len(self.stages)} stages')
        before = [stage.save() for stage in self.stages]
        try:
            for stage, part in zip(self.stages, states):
                stage.restore(part)
        except ParameterError:
            for stage, part in zip(self.stages, before):
                stage.restore(part)
            raise

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory."""
        return {'kind': self.kind, 'stages': [stage.to_dict() for stage in self.stages]}


def coupled_from_dict(parameters: Mapping[str, Any]) -> Coupled:
    """
    Build a model of any kind, in its cold state, from what its `to_dict` returned.

    Raises
    ------
    ParameterError
        If the kind is not known, or a stage is missing or makes no sense.

    """
    kinds = Coupled._kinds
    kind = parameters.get('kind') if isinstance(parameters, Mapping) else None
    if not isinstance(kind, str) or kind not in kinds:
        raise ParameterError(
            f'coupled model of unknown kind {kind!r}: use one of {", ".join(sorted(kinds))}')
    stages = take(parameters, 'stages', f'{kind} model')
    if not isinstance(stages, list):
        raise ParameterError(f'{kind} model: stages is {stages!r}, not a list')
    return kinds[kind]([operator_from_dict(stage) for stage in stages])
