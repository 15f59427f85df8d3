# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The balance between muscle and arm: the angle for a drive and a memory.

The muscle stretches to ``L = L0 + S(F) f (H2[u] - L0) + e(F) + o`` with ``u = F - x``, where x is
the first stage's output (H1[V] in the paper's model) and F is what the arm asks for at its angle.
Where martensite keeps strain, `kernels.formation` says what becomes of ``S(F) (H2[u] - L0)``.
Everything that does not change from row to row is laid out here as tables; `kernels.trial` does the
rest.
"""

from __future__ import annotations

import copy
import functools
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.bicep.wires import kernels_for, wires_of, with_own_memories
from hysteresis_ros.effects.stages import Statics
from hysteresis_ros.kernels import trial
from hysteresis_ros.kernels.arm import Arm, MOTION, State, X
from hysteresis_ros.kernels.formation import LOAD, SIZE
from hysteresis_ros.operators import HysteresisOperator, Preisach

if TYPE_CHECKING:
    from hysteresis_ros.model.chain import Chain

# Between two angles of the grid the linkage is a straight line, which costs less than 1e-6 rad.
GRID = math.radians(0.2)
# Loads of the muscle's table, up to this many times the largest at rest.
LOADS, LARGEST = 400, 4.0
_NO_MUSCLE = np.zeros((0, SIZE)), 0.0
# Where a trial without rows ends.
ONE_EMPTY_TRIAL = np.zeros(1, dtype=np.int64)
# Load [N] over which the slope of what the transformation feels is taken.
SMALL_LOAD = 1e-3
# Longest dt of an arm that rings, as a phase [rad] of its fastest ringing; from 2.4 the method
# would not be stable.
LONGEST_PHASE = 0.7
# A step of x of less than this share of H2's range does not make an arm ring.
CALM_STEP = 0.005


class ArmBalance:
    """
    Arm and parallel muscles, advanced one sample or one trial at a time.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2; its memory is the muscle's. It is copied.
    geometry : BicepGeometry
        The linkage.
    chain : Chain
        Effects of the model: those of the material and of the mechanism count here.
    loaded : bool
        Whether the load counts; not in a model without a first stage to weigh it against.
    statics : Statics, optional
        The arm that the geometry describes at rest, where it was computed before.
    muscles : int, optional
        How many muscles carry the load; by default those of the geometry.
    """

    def __init__(self, operator: HysteresisOperator, geometry: BicepGeometry, chain: Chain,
                 loaded: bool = True, statics: Statics | None = None, muscles: int | None = None
                 ) -> None:
        statics = statics or statics_of(geometry)
        for effect in chain.mechanism:
            statics = effect.forward(statics, geometry)
        resistances = [effect.resistance() for effect in chain.mechanism]
        self.coulomb, self.viscous, self.inertia = (
            float(sum(values)) for values in zip((0.0, 0.0, 0.0), *resistances))
        self.capstan = float(sum(effect.capstan() for effect in chain.mechanism))
        stiction = float(max((effect.stiction() for effect in chain.mechanism), default=0.0))
        sticks = self.coulomb > 0.0 or self.capstan > 0.0
        leverage = (muscles or geometry.muscle_count) * np.maximum(statics.moment_arm, 1e-6)
        # What the arm gets of a tension while it sinks; its inverse while it rises.
        grip = math.exp(self.capstan)
        self.base = operator.output_range[0]
        self.has_dynamics = chain.moves
        # Range of H2's input, in the unit of the load.
        self.span = operator.upper - operator.lower
        several = len(chain.offsets) > 1
        wires, self.operators, memories = wires_of(operator, chain, loaded)
        self._load_at = statics.theta, np.maximum(statics.moment, 0.0) / leverage
        # At rest, and where the arm sinks and rises against dry friction.
        senses = (0, 1, -1) if sticks else (0,)
        lines = [_line(statics, leverage * grip ** sense, sense * self.coulomb, self.base, chain,
                       loaded) for sense in senses]
        # Where the wires only stretch the arm is stiffest, and rings fastest.
        stiffness = grip * np.max(leverage * statics.moment_arm) / wires.compliance
        swings = self.has_dynamics and loaded and not several
        # An arm that does not swing has no use for the table of its muscle.
        loads, spacing = _muscle(chain, statics, leverage / grip) if swings else _NO_MUSCLE
        self._arm = Arm(
            wires=wires,
            grid=np.column_stack([statics.theta, statics.length, statics.moment, leverage,
                                  *(column for line in lines for column in line)]),
            loads=loads, spacing=spacing, base=self.base, coulomb=self.coulomb,
            stiction=stiction, capstan=self.capstan, viscous=self.viscous, inertia=self.inertia,
            tolerance=1e-10 * self.span,
            longest=LONGEST_PHASE * math.sqrt(self.inertia / stiffness),
            heaviest=max(float(np.max(np.abs(statics.moment))), 1e-12),
            calm=CALM_STEP * self.span, sticks=sticks,
            # The wires of unequal muscles stretch when the drive changes, even if the arm sticks.
            rigid=not several and all(np.array_equal(line[0], lines[0][0]) for line in lines),
            strained=any(np.any(line[3] != 1.0) for line in lines), dynamic=self.has_dynamics,
            swings=swings, plays=chain.plays and loaded)
        self._state = State(memories, np.empty(MOTION), np.empty((len(self.operators), SIZE)))
        self._kernels = kernels_for(operator, trial)
        self.start()

    def copy(self) -> ArmBalance:
        """Return the same arm with a state of its own."""
        other = copy.copy(self)
        other.operators, memories = with_own_memories(self.operators)
        other._state = State(memories, self._state.motion.copy(), self._state.muscles.copy())
        return other

    def snapshot(self) -> tuple[list[Any], np.ndarray, np.ndarray]:
        """Return the state for `rewind`."""
        return ([operator.snapshot() for operator in self.operators],
                self._state.motion.copy(), self._state.muscles.copy())

    def rewind(self, snapshot: tuple[list[Any], np.ndarray, np.ndarray]) -> None:
        """Go back to a state that `snapshot` returned."""
        memories, motion, muscles = snapshot
        for operator, memory in zip(self.operators, memories):
            operator.rewind(memory)
        self._state.motion[:], self._state.muscles[:] = motion, muscles

    def take_over(self, other: ArmBalance) -> None:
        """
        Go on from the state of another arm, whose load may have been another.

        A single muscle there stands for all muscles here.
        """
        memories, motion, muscles = other.snapshot()
        count = len(self.operators)
        if len(memories) == 1 < count:
            memories = memories * count
        self.rewind((memories, motion, muscles))
        for own, given in zip(self.operators, other.operators * count):
            if (isinstance(own, Preisach) and isinstance(given, Preisach)
                    and not np.array_equal(own.weights, given.weights)):
                own.take_over(given)
        # No x was the last one here: what changes at once makes the arm ring.
        self._state.motion[X] = np.inf

    def start(self) -> None:
        """Wipe the memory: after a full heat and cool cycle, before the first sample."""
        self._kernels.start(self._arm, self._state)

    @property
    def output(self) -> float:
        """Output of H2 [m], which follows the martensite share; the mean of the muscles."""
        return self._kernels.output(self._arm, self._state)

    def load(self, angle: Any, clock: Any = 0.0) -> Any:
        """Return the load [N] of each muscle that holds the arm at rest at each angle [rad]."""
        return np.interp(angle, *self._load_at)

    @property
    def muscles(self) -> np.ndarray:
        """Input of H2 and what martensite keeps of each muscle, columns of `kernels.formation`."""
        muscles = self._state.muscles.copy()
        muscles[:, LOAD] = [operator.input for operator in self.operators]
        return muscles

    def settle(self, x: float, clock: float = 0.0, offset: float = 0.0) -> float:
        """Wipe the memory, take up the state of rest under `x`, and return its angle [rad]."""
        none = np.zeros(0)
        return self._kernels.run(self._arm, self._state, True, float(x), float(offset),
                                 ONE_EMPTY_TRIAL, none, none, none, none)[0]

    def step(self, x: float, dt: float, offset: float = 0.0, factor: float = 1.0,
             clock: float = 0.0) -> float:
        """
        Advance to the next sample.

        Parameters
        ----------
        x : float
            Output of the first stage, unit of the load.
        dt : float
            Time since the sample before [s].
        offset, factor : float
            What time and use add to the elongation [m] and do to the stroke.
        clock : float
            Time since the recording began [s]; it counts where a muscle breaks (`breaking`).

        Returns
        -------
        float
            Angle [rad].
        """
        return self._kernels.step(self._arm, self._state, float(x), float(dt), float(offset),
                                  float(factor))

    def run(self, cold: float, ends: np.ndarray, x: np.ndarray, dt: np.ndarray, offset: np.ndarray,
            factor: np.ndarray, clock: np.ndarray | None = None
            ) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """
        Run whole trials, each from the cold state.

        Parameters
        ----------
        cold : float
            Output of the first stage in the cold state.
        ends : ndarray of int, shape (trials,)
            Where each trial ends and the next begins.
        x, dt, offset, factor, clock : ndarray, shape (rows,)
            As for `step`, for the rows of all trials.

        Returns
        -------
        rest : float
            Angle in the cold state [rad].
        angles, outputs, inputs : ndarray, shape (rows,)
            Angle [rad], output of H2 [m], and input of the first muscle's H2.
        """
        return self._kernels.run(self._arm, self._state, True, float(cold), 0.0, ends, *(
            np.ascontiguousarray(column, dtype=float) for column in (x, dt, offset, factor)))

    def proceed(self, x: np.ndarray, dt: np.ndarray, offset: np.ndarray, factor: np.ndarray,
                clock: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Go on from the present state; angles, outputs and inputs (rows,) as of `run`."""
        return self._kernels.run(self._arm, self._state, False, 0.0, 0.0, np.array([len(x)]), *(
            np.ascontiguousarray(column, dtype=float) for column in (x, dt, offset, factor)))[1:]


@functools.lru_cache(maxsize=16)
def statics_of(geometry: BicepGeometry) -> Statics:
    """Return the arm that a geometry describes at rest, on the grid of angles, read-only."""
    low, high = geometry.angle_range
    statics = Statics.of(geometry, np.linspace(low, high, max(int((high - low) / GRID), 2)))
    for column in vars(statics).values():
        column.setflags(write=False)
    return statics


def _line(statics: Statics, leverage: np.ndarray, friction: float, base: float, chain: Chain,
          loaded: bool) -> tuple[np.ndarray, ...]:
    """
    Return the states of the arm at rest or against a moment of friction, each shape (n,).

    What the transformation has to give, without offset; the load that it feels; what a moment that
    resists motion takes off that load; what an offset counts; and the loop's width beyond H2's.
    `leverage` (n,) [m] is the moment that all muscles make when each bears a load of one.
    """
    # A wire cannot push.
    force = np.maximum(statics.moment - friction, 0.0) / leverage
    load, weight = 0.0 * force, 0.0 * force
    if loaded:
        load = chain.load_inside(force)
        weight = (chain.load_inside(force + SMALL_LOAD) - load) / SMALL_LOAD
    scale = chain.scale(force)
    demand = (statics.length - base - chain.stretch(force)) / scale
    # Past a fold, where the arm would fall, the nearest stable state is kept.
    return (np.maximum.accumulate(demand), load, weight / leverage, 1.0 / scale,
            chain.loop_width(force))


def _muscle(chain: Chain, statics: Statics, leverage: np.ndarray) -> tuple[np.ndarray, float]:
    """Return a muscle's table over its load, shape (LOADS, 4), and the spacing of the loads [N]."""
    loads = np.linspace(0.0, LARGEST * np.max(np.abs(statics.moment / leverage)), LOADS)
    return np.column_stack([chain.load_inside(loads), chain.scale(loads), chain.stretch(loads),
                            chain.loop_width(loads)]), float(loads[1])
