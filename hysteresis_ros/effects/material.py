# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects on the muscle itself: how load, time and use change ``L = H2[s (x - c F)]``.

Those of the load (`stress_dependence`, `stress_dependent_strain`, `series_compliance`) are part of
what a bench measures, so adding them on bench tables refits the weights of H2.
"""

import math
from typing import ClassVar

import numpy as np

from hysteresis_ros.effects.base import (
    Inputs, PAPER, Parameter, Surroundings, Values)
from hysteresis_ros.effects.stages import MaterialEffect
from hysteresis_ros.kernels.play import follow


# Drives that make a muscle hot.
HEATING = ('voltage', 'current', 'power', 'temperature')


class StressDependence(MaterialEffect):
    """The load shifts the transformation along the temperature axis."""

    id = 'stress_dependence'
    sentence = 'Load shifts the transformation to higher temperatures (Clausius-Clapeyron).'
    equation = ('T -> T - sigma / C: H2[F - C T], where V^2 stands for T in a heated wire; '
                "where 1 / C grows with the bench's strain S: F -> F (1 + follows (S(F) - 1)); "
                'on the arm alone: F -> F + shift (F - Fp), Fp = 0 where C is known, else Fm')
    source = ('Clausius-Clapeyron relation of shape memory alloys: dT / dsigma in proportion to '
              'the strain (Lagoudas and others, Int. J. Plasticity 32-33 (2012) 155) or constant '
              '(Brinson, J. Intell. Mater. Syst. Struct. 4 (1993) 229); Eq. 2 of the paper')
    shows_in = 'load at the same drive'
    experiment = 'the same loop under three or more loads'
    confused_with = ('supply_sag', 'series_compliance')
    kinds = ('arm', 'bench')
    of_alloy = True
    universal = True
    SHIFT = Parameter('shift', '1', 'influence of the load against that in the bench model, less '
                      'one', 0.02, 1.0, 0.0, (-0.2, 0.2), both_signs=True, kinds=('arm',))
    # From Brinson (1993), where C is constant, to Lagoudas and others (2012), where it is not.
    FOLLOWS = Parameter('follows', '1', 'share by which 1 / C is in proportion to the strain that '
                        'grows with the load, as of Clausius-Clapeyron', 0.0, 1.0, 0.0, (0.5,),
                        limits=(0.0, 1.0), kinds=('bench',), form=True)
    # Unit, range and scale. Of a 0.2 mm wire 5 to 15 MPa/K at 2 to 12 K/V^2, of others not known.
    RANGES: ClassVar[dict[tuple[str, str | None], tuple[str, float, float, str]]] = {
        ('voltage', 'force'): ('N/V^2', 0.2, 6.0, 'load per drive squared'),
        ('current', 'force'): ('N/A^2', 1.0, 1e3, ''),
        ('temperature', 'stress'): ('MPa/K', 5.0, 15.0, ''),
        ('temperature', 'force'): ('N/K', 0.01, 100.0, '')}
    PREFIX = {'MPa/K': 1e6}

    @classmethod
    def describe(cls, surroundings: Surroundings | None) -> tuple[Parameter, ...]:
        """Give C the unit and range of this muscle's load and drive."""
        if surroundings is None:
            surroundings = PAPER
        known = (surroundings.load or 1.0) / (surroundings.full_drive_squared or 1.0)
        unit, low, high, scale = cls.RANGES.get(
            (surroundings.drive, surroundings.load_name),
            ('load/drive squared', 1e-3 * known, 1e3 * known, ''))
        starts = tuple(float(value) for value in np.geomspace(low, high, 5)[1:-1])
        return (Parameter('C', unit,
                          'load that shifts the transformation by one unit of drive squared',
                          low, high, 0.0, starts, log=True, kinds=('bench',),
                          scale=scale).of(surroundings), cls.FOLLOWS, cls.SHIFT)

    parameters = (FOLLOWS, SHIFT)

    @property
    def follows_strain(self) -> float:  # type: ignore[override]
        """Return the share by which the shift follows the strain."""
        return self.follows

    @property
    def load_per_drive_squared(self) -> float:  # type: ignore[override]
        """Return C in units of load over drive squared; 0 keeps the model's own first stage."""
        return self.C * self.PREFIX.get(self.parameters[0].unit, 1.0)

    def shift_load(self, load: Values, surroundings: Surroundings) -> Values:
        """Weigh the load more or less than the bench model does."""
        # Where C is known, another one leaves the unloaded muscle as it is; weights that were
        # fitted without it are right at the bench's mean load.
        pivot = 0.0 if self.C else surroundings.load
        return self.shift * (load - pivot)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all."""
        return surroundings.load > 0.0


class StressDependentStrain(MaterialEffect):
    """A higher load orients more martensite, so the stroke grows until it saturates."""

    id = 'stress_dependent_strain'
    sentence = 'The transformation strain grows with the load and saturates.'
    equation = ("S(F) = (1 - r s(F)) / (1 - r s(Fm)), s(F) = exp(-(F / F0)^n), Fm the bench's mean "
                'load; on the arm alone: + growth (1 - s(F)) above the line, from no load where r '
                'is known, else from Fm; the cold muscle at rest keeps its length, or the hot one')
    source = ('orientation of martensite variants under stress: exponential (n = 1) as H_cur of '
              'Lagoudas and others, Int. J. Plasticity 32-33 (2012) 155, Gaussian (n = 2), between '
              'the two as where the strain grows from no load on (n = 1.5), or from '
              'a critical stress on (larger n) as of Brinson, J. Intell. Mater. Syst. Struct. 4 '
              '(1993) 229')
    shows_in = 'load, cold side'
    experiment = 'the same loop under three or more loads'
    confused_with = ('series_compliance',)
    kinds = ('arm', 'bench')
    of_alloy = True
    universal = True
    limit = 'phase_modulus'
    parameters = (
        Parameter('r', '1', 'share of the strain that is missing without load', 0.02, 1.0, 0.0,
                  (0.3, 0.8), limits=(0.0, 1.0), kinds=('bench',)),
        # Beyond 5 mean loads the growth is a straight line over the bench's loads, whatever F0 is.
        Parameter('F0', 'loads', "load scale of the saturation over the bench's mean load",
                  0.1, 5.0, 1.0, (0.5, 1.5), log=True, limits=(0.02, 4.99), kinds=('bench',)),
        Parameter('growth', '1', 'growth of the strain with the load against that on the bench',
                  0.02, 1.0, 0.0, (-0.2, 0.2), both_signs=True, kinds=('arm',)),
        Parameter('n', '1', 'how late and abruptly it grows: 1 exponential, 2 Gaussian, 4 as from '
                  'a critical load on', 1.0, 4.0, 1.0, (1.0,), choices=(1.0, 1.5, 2.0, 4.0),
                  kinds=('bench',), form=True),
        Parameter('hot', '1', 'with a growth, 0: the cold muscle at rest is as long as on the '
                  'bench, 1: the hot one is', 0.0, 1.0, 0.0, (0.0,), choices=(0.0, 1.0),
                  kinds=('arm',)))

    def scale(self, load: Values, surroundings: Surroundings) -> Values:
        """Grow with the load, one at the bench's mean load."""
        on_bench, growth = self._shares(load, surroundings)
        # A stroke of nothing could not be inverted.
        return np.maximum(on_bench + growth, 0.02) / self._at_mean()

    def strain_of_bench(self, load: Values, surroundings: Surroundings) -> Values:
        """Return the strain under a load over that under the bench's mean load."""
        return (1.0 - self.r * self._missing(load, surroundings)) / self._at_mean()

    def oriented(self, load: Values, surroundings: Surroundings) -> Values:
        """Return the strain under a load over that under an infinite one."""
        # What is never oriented could not be divided by.
        return np.maximum(1.0 - self.r * self._missing(load, surroundings), 0.02)

    def stretch(self, load: Values, surroundings: Surroundings) -> Values:
        """Return what keeps the cold muscle's resting length, whatever the growth, if anything."""
        if self.hot:
            return 0.0 * load
        on_bench, growth = self._shares(np.float64(surroundings.rest_load), surroundings)
        return 0.0 * load + float(growth / max(on_bench, 0.02)) * surroundings.least

    def in_limit(self) -> bool:
        """
        Whether the interval of F0 reaches the straight line.

        Orientation saturates. Growth in proportion to the load is that of a softer martensite.
        """
        largest = next(one for one in self.parameters if one.name == 'F0').bounds[1]
        _, high = self.intervals.get('F0', (0.0, 0.0))
        return self.n == 1.0 and high >= largest

    def _shares(self, load: Values, surroundings: Surroundings) -> tuple[Values, Values]:
        """Return the share of the strain under a load on the bench, and what the arm adds to it."""
        missing = self._missing(load, surroundings)
        # As for the shift of `stress_dependence`.
        pivot = 1.0 if self.r else self._missing(surroundings.load, surroundings)
        return 1.0 - self.r * missing, self.growth * (pivot - missing)

    def _missing(self, load: Values, surroundings: Surroundings) -> Values:
        """Return s, the part of what grows that is still missing under a load."""
        return np.exp(-(np.maximum(load, 0.0) / (self.F0 * surroundings.load)) ** self.n)

    def _at_mean(self) -> float:
        """Return the strain under the mean load over that under an infinite one, at least 0.02."""
        return max(1.0 - self.r * math.exp(-self.F0 ** -self.n), 0.02)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all."""
        return surroundings.load > 0.0


class SeriesCompliance(MaterialEffect):
    """Crimps, cables and the wire's own elasticity stretch with the load."""

    id = 'series_compliance'
    sentence = 'The load stretches crimps, cable and wire elastically.'
    equation = 'L += F / k'
    source = "Hooke's law"
    shows_in = 'force'
    experiment = 'hang weights on the cold muscle'
    confused_with = ('payload_error', 'geometry_error')
    kinds = ('arm', 'bench')
    universal = True
    parameters = (
        Parameter('compliance', 'mm/N', 'elongation per load', 0.005, 0.65, 0.0, (0.02, 0.1),
                  log=True, scale='compliance'),)

    # Crimps and cable of 2 kN/m and more, and the wire itself with about 0.15 mm/N.
    UNITS = {'mm/N': 1e-3, '1/GPa': 1e-9, '%/N': 1e-2, 'mm/MPa': 1e-9}
    # The same wire of 0.27 m and 0.2 mm in the units of other tables, with the range's scale.
    RANGES = {('strain', 'stress'): ('1/GPa', 'strain per stress', 0.004, 0.3, ''),
              ('strain', 'force'): ('%/N', 'strain per load', 0.002, 0.2, 'strain per load'),
              ('length', 'stress'): ('mm/MPa', 'elongation per stress', 0.0002, 0.02, 'length')}

    @classmethod
    def describe(cls, surroundings: Surroundings | None) -> tuple[Parameter, ...]:
        """Give the compliance the unit of this muscle's response and load."""
        if surroundings is None:
            return cls.parameters
        kind = surroundings.response, surroundings.load_name
        if kind not in cls.RANGES:
            return super().describe(surroundings)
        unit, meaning, low, high, scale = cls.RANGES[kind]
        starts = float(np.sqrt(low * high)), 0.3 * high
        return (Parameter('compliance', unit, meaning, low, high, 0.0, starts, log=True,
                          scale=scale).of(surroundings),)

    def stretch(self, load: Values, surroundings: Surroundings) -> Values:
        """Return the elastic elongation."""
        return self.compliance * self.UNITS[self.parameters[0].unit] * load

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all."""
        return surroundings.load > 0.0


class RPhase(MaterialEffect):
    """An intermediate phase takes up a share of the strain early and nearly without hysteresis."""

    id = 'r_phase'
    sentence = 'A part of the strain comes early, in a narrow step with little hysteresis.'
    equation = 'L -= p l0 s((q -+ w/2 - q0) / d), s the logistic step, q the drive squared, w = 3 %'
    source = 'R-phase transformation of NiTi: 0.3 to 1 % strain, 2 to 5 K hysteresis'
    shows_in = 'a shoulder on cooling at low load'
    experiment = 'a fine staircase of cooling steps'
    confused_with = ('slack',)
    kinds = ('arm', 'bench')
    of_alloy = True
    parameters = (
        Parameter('strain', '% of l0', 'strain of the step', 0.05, 1.0, 0.0, (0.2, 0.5), log=True),
        Parameter('position', '1', 'drive squared q0 at the step over the largest', 0.05, 0.8, 0.3,
                  (0.15, 0.35, 0.55)),
        Parameter('width', '1', 'width d of the step over the largest drive squared', 0.005, 0.1,
                  0.03, (0.03,), log=True),)

    memory = ('_played',)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive heats: pressure transforms nothing."""
        return surroundings.drive in HEATING

    # Width w of the step's own hysteresis over the largest drive squared.
    LOOP = 0.03

    def start(self) -> None:
        """Forget the past: cold."""
        self._played = 0.0

    def advance(self, drive: float, drive_squared: float, inputs: Inputs,
                surroundings: Surroundings) -> tuple[float, float]:
        """Return the strain of the step, with a small play as its hysteresis."""
        half = 0.5 * self.LOOP * surroundings.full_drive_squared
        self._played = min(max(self._played, drive_squared - half), drive_squared + half)
        return float(self._strain(self._played, surroundings)), 1.0

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the same for a whole trial at once."""
        half = 0.5 * self.LOOP * surroundings.full_drive_squared
        played = follow(np.ascontiguousarray(drive_squared, float), half, 0.0)
        return self._strain(played, surroundings), np.ones(len(drive))

    def _strain(self, drive_squared: Values, surroundings: Surroundings) -> Values:
        argument = (drive_squared / surroundings.full_drive_squared - self.position) / self.width
        step = 0.5 * (1.0 + np.tanh(0.5 * argument))
        return surroundings.sign * self.strain / 100.0 * surroundings.length * step


class Slack(MaterialEffect):
    """The muscle hangs loose over a part of the way."""

    id = 'slack'
    sentence = 'A dead length has to be taken up before the muscle pulls.'
    equation = 'L += Ls, F = max(F, 0)'
    source = 'unilateral contact'
    shows_in = 'low force'
    experiment = 'sweep the preload'
    confused_with = ('r_phase', 'geometry_error')
    parameters = (
        Parameter('Ls', 'mm', 'dead length', 0.1, 5.0, 0.0, (0.5, 2.0), log=True, scale='length'),)

    def stretch(self, load: Values, surroundings: Surroundings) -> Values:
        """Return the dead length, the same under any load; that a wire cannot push holds anyway."""
        return 1e-3 * self.Ls + 0.0 * load


class UnequalMuscles(MaterialEffect):
    """Parallel muscles of different length do not share the load equally."""

    id = 'unequal_muscles'
    sentence = 'The parallel muscles differ in length, so one carries more than the others.'
    equation = 'sum of F_i = n F, with L_i = L - dL_i for each muscle i'
    source = 'the paper, Sec. VI-B: small length differences cause discrepancies'
    shows_in = 'smeared knees'
    experiment = 'run the arm on one muscle at a time'
    confused_with = ('slack', 'geometry_error')
    parameters = (
        Parameter('shorter', 'mm', 'how much one lacks against one that is as on the bench', 0.0,
                  8.0, 0.0, (-1.0, 0.5, 2.0), both_signs=True, scale='length'),
        Parameter('longer', 'mm', 'how much another one exceeds it', 0.0, 8.0, 0.0,
                  (-1.0, 0.5, 2.0), both_signs=True, scale='length'),)

    @property
    def offsets(self) -> tuple[float, ...]:     # type: ignore[override]
        """Excess length [m] of each muscle; equal ones count as one."""
        if self.shorter == self.longer == 0.0:
            return (0.0,)
        return -1e-3 * self.shorter, 0.0, 1e-3 * self.longer
