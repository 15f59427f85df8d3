# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which of the sets of effects that were fitted to runs of an arm may be the answer."""

from __future__ import annotations

from collections.abc import Iterable
import dataclasses
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.residual import heteroscedasticity_p_value
from hysteresis_ros.diagnosis.significance import SIGNIFICANCE
from hysteresis_ros.workers import map_in_forks

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_fit import Fit, Fitter
    from hysteresis_ros.diagnosis.covariance import Covariance
    from hysteresis_ros.diagnosis.settings import Settings

# Of several effects each has to take this share off the first error, to be seen with the others.
LEAST_SHARE = 0.015
# Probability with which the base model's own error is smaller than what is called adequate. Of 122
# clean arms of six constitutive models one was called faulty at 95 %, as loads left out say more
# than what the model is off by; 98 % loses 4 of 218 cases of a wire that nobody here wrote, and
# spares 3 of 4 false alarms among 64 clean recordings of a single trial.
ADEQUATE = 0.95
# The same for noise that is not as large at all times: so many noisy recordings are called unknown
# by chance.
NOISE_SIGNIFICANCE = 0.01
# So many times the noise is more than the rows of a recording could mean by it.
MUCH_MORE = 2.0
# Of what a set explains in the rows fitted it has to explain this share in rows held out: with less
# it fails in more of that than it predicts.
PREDICTED = 0.5
# Odds beforehand that what a bench has shown of the alloy is another on the arm, over those of any
# effect.
ANOTHER_ALLOY = 0.2
# What of a `Fit` its judgement says.
JUDGED = ('log_evidence', 'values', 'spread', 'judged')


class FittedSets:
    """
    Sets of effects that were fitted, and which of them may be the answer.

    Parameters
    ----------
    fitter : Fitter
        Of the runs, with the covariance of the base model's residuals.
    settings : Settings
    rng : numpy.random.Generator

    Attributes
    ----------
    fits : dict of frozenset of str to Fit
        The best full fit of each set.
    p_values : dict of str to float
        Of single effects, over all of them; those that are missing are taken for 1.
    largest_rmse : float
        Root mean square that the base model's own error stays below at `ADEQUATE`, but for what
        martensite keeps, in the unit of the response.
    rmse_50 : float
        Its median.
    odds : float
        Logarithm of the odds that an effect acts, before any data.
    temper : float
        What log evidences are divided by; see `Settings.coarsening`.
    """

    def __init__(self, fitter: Fitter, settings: Settings, rng: np.random.Generator) -> None:
        self.fitter, self.settings = fitter, settings
        self.problem, self.covariance = fitter.problem, fitter.covariance
        self.fits: dict[frozenset[str], Fit] = {}
        self.p_values: dict[str, float] = {}
        self.odds = math.log(settings.prior / (1.0 - settings.prior))
        self._of_alloy = {effect.id for effect in self.problem.model.effects if effect.of_alloy}
        self.temper = 1.0 + len(self.problem.measured) / settings.coarsening
        # By least squares.
        self._least: dict[frozenset[str], np.ndarray] = {}
        # Each with the response that it belongs to.
        self._errors: dict[frozenset[str], tuple[np.ndarray, float, float]] = {}
        self._sizes: dict[frozenset[str], tuple[np.ndarray, Covariance, float, float]] = {}
        self._largest_noises: dict[frozenset[str], tuple[np.ndarray, float]] = {}
        self._noise_p_values: dict[frozenset[str], tuple[np.ndarray, float]] = {}
        self._predicts: dict[frozenset[str], tuple[np.ndarray, bool]] = {}
        # The same draws for all, or chance would decide between two sets.
        self._seed = int(rng.integers(2 ** 32))
        self.largest_rmse = self._largest_error(self.covariance)
        self.rmse_50 = self._largest_error(self.covariance, 0.5)
        # Each with the covariance that it belongs to.
        self._largest_errors: dict[frozenset[str], tuple[Covariance, float, float]] = {}

    @property
    def base(self) -> Fit:
        """Without any further effect."""
        return self.fits[frozenset()]

    def keep(self, fit: Fit) -> None:
        """Keep a fit where it is the best of its effects."""
        names = frozenset(fit.names)
        if names not in self.fits or fit.log_evidence > self.fits[names].log_evidence:
            self.fits[names] = fit

    def judge_all(self) -> None:
        """Judge all fits under the covariances that are at hand now."""
        def judged(names: frozenset[str]) -> dict[str, Any]:
            fit = self.fitter.judge(self.fits[names])
            return {name: getattr(fit, name) for name in JUDGED}

        found = map_in_forks(judged, self.fits, self.problem.jobs)
        self.fits = {names: dataclasses.replace(fit, **own)
                     for (names, fit), own in zip(self.fits.items(), found)}

    def keep_least(self, names: frozenset[str], predicted: np.ndarray) -> None:
        """Keep the response (n,) of a set that was fitted by least squares."""
        self._least[names] = predicted
        self._errors.pop(names, None)
        self._sizes.pop(names, None)

    def log_posterior(self, names: frozenset[str]) -> float:
        """
        Return the logarithm of a set's posterior probability, but for a constant.

        An effect whose equation contains that of another one says that both act. What the bench has
        shown of the alloy is seldom another on the arm.
        """
        fit = self.fits[names]
        rarer = sum(math.log(effect.prior_odds * (
            ANOTHER_ALLOY if effect.id in self._of_alloy else 1.0)) for effect in fit.effects)
        return fit.log_evidence / self.temper + self.odds * self.acting(names) + rarer

    def acting(self, names: frozenset[str]) -> int:
        """Return how many effects act in a set, as `log_posterior` counts them."""
        return len(names) + sum(bool(effect.replaces) for effect in self.fits[names].effects)

    def ranked(self) -> list[frozenset[str]]:
        """Return all sets that were fitted, most probable first."""
        return sorted(self.fits, key=lambda names: -self.log_posterior(names))

    def best_of(self, size: int) -> list[frozenset[str]]:
        """Return the most probable sets of so many effects: those that larger ones grow from."""
        return [names for names in self.ranked() if len(names) == size][:self.settings.beam]

    def error(self, names: frozenset[str]) -> float:
        """
        Return the RMSE of a set on all judged rows, fitted by least squares.

        Parameters
        ----------
        names : frozenset of str
            A set that was fitted.

        Returns
        -------
        float
            In the unit of the response.

        Raises
        ------
        KeyError
            If the set was not fitted.
        """
        return self._errors_of(names)[1]

    def own_error(self, names: frozenset[str]) -> float:
        """
        Return the RMSE of a set without the shares of what has one course (`Discrepancy.courses`).

        That is known but for its share, so that it hides nothing of another course: the base model
        may be wrong by much and still miss nothing by little.
        """
        return self._errors_of(names)[2]

    def _errors_of(self, names: frozenset[str]) -> tuple[np.ndarray, float, float]:
        """Return the response of a set with its smallest `error` and `own_error`."""
        fit = self.fits[names]
        known = self._errors.get(names)
        if known is None or known[0] is not fit.predicted:
            residuals = [self.problem.measured - one for one in self._responses(names)]
            own = map((fit.covariance or self.covariance).discrepancy.besides_courses, residuals)
            self._errors[names] = known = (
                fit.predicted, min(map(rms, residuals)), min(map(rms, own)))
        return known

    def _responses(self, names: frozenset[str]) -> tuple[np.ndarray, np.ndarray]:
        """Return the response of a set, and that by least squares."""
        fit = self.fits[names]
        return fit.predicted, (self._least[names] if names in self._least
                               else self.fitter.towards_least(fit))

    def noise_free_rmse(self, names: frozenset[str]) -> float:
        """
        Return the size of a set's residual without white noise, as an error of the base model.

        It is as improbable as one of that RMSE, where each row counts by what it may be off by: see
        `Covariance.equivalent_rmse`.
        """
        fit, noise = self.fits[names], self.white_noise(names)
        covariance = fit.covariance or self.covariance
        known = self._sizes.get(names)
        if (known is None or known[0] is not fit.predicted or known[1] is not covariance
                or known[2] != noise):
            residuals = [self.problem.measured - response for response in self._responses(names)]
            sizes = covariance.equivalent_rmse(
                self._without_unknown_past(fit, residuals), noise,
                np.random.default_rng(self._seed), self.settings.draws, ADEQUATE)
            self._sizes[names] = known = fit.predicted, covariance, noise, float(np.min(sizes))
        return known[3]

    def _without_unknown_past(self, fit: Fit, residuals: list[np.ndarray]) -> list[np.ndarray]:
        """
        Return residuals (n,) without what a past that was not recorded may explain of them.

        Before a trial an effect with a memory may have been in any state: a play, say, at its other
        end. It explains of the first row of a trial as much as it changes any row, at most.
        """
        first = np.append(True, np.diff(self.problem.trial) != 0)
        others = [effect for effect in fit.effects if not effect.memory]
        if len(others) == len(fit.effects) or np.all(first):
            return residuals
        without, = self.fitter.simulate([others])
        reach = np.max(np.abs(fit.predicted - without))
        return [np.where(first, np.sign(residual) * np.maximum(np.abs(residual) - reach, 0.0),
                         residual) for residual in residuals]

    def white_noise(self, names: frozenset[str]) -> float:
        """
        Return how much of a set's residual is white noise, in the unit of the response.

        What is larger than the base model's own error could be, and not as large at all times, is
        no noise: it has a cause. Where it depends on how much is noise whether the base model
        suffices, it is the most that it may be at 95 %.
        """
        noise = 0.0 if self.uneven(names) else self.fits[names].noise
        beyond = self.own_error(names) ** 2 - self.largest_rmse ** 2
        if noise ** 2 < beyond < (MUCH_MORE * noise) ** 2:
            noise = self._noise_at_most(names)
        return noise

    def _noise_at_most(self, names: frozenset[str]) -> float:
        """Return the white noise of a set's residual that it stays below at 95 %."""
        fit = self.fits[names]
        known = self._largest_noises.get(names)
        if known is None or known[0] is not fit.predicted:
            noise = (fit.covariance or self.covariance).noise_at_most(
                fit.require_values(), self.problem.measured - fit.predicted)
            self._largest_noises[names] = known = (fit.predicted, noise)
        return known[1]

    def uneven(self, names: frozenset[str]) -> bool:
        """Whether a set's residual looks like noise, but has a cause: see `white_noise`."""
        return (self.fits[names].noise > self.largest_rmse
                and self._noise_p_value(names) <= NOISE_SIGNIFICANCE)

    def _noise_p_value(self, names: frozenset[str]) -> float:
        """Return the p value that a set's residual is as large at all times."""
        fit = self.fits[names]
        known = self._noise_p_values.get(names)
        if known is None or known[0] is not fit.predicted:
            p_value = heteroscedasticity_p_value(
                self.problem.measured - fit.predicted, self.problem.trial,
                np.random.default_rng(self._seed), self.settings.draws)
            self._noise_p_values[names] = known = (fit.predicted, p_value)
        return known[1]

    def sufficient(self, names: frozenset[str]) -> bool:
        """
        Whether base model and equations of the effects could be as wrong as a set's residual.

        Along the way that the arm takes with these effects: friction, say, keeps the load from a
        muscle that cools down, which no load at rest shows. What the effects make the model more
        uncertain by counts as far as they explain more than that: with an effect that explains as
        little as it makes uncertain, anything would suffice. And their equations may be off by a
        share of what they explain together: with changes that cancel, anything would, too.
        """
        return (self.noise_free_rmse(names) <= self._allowed(names)
                and (not names or self.predicts(names)))

    def predicts(self, names: frozenset[str]) -> bool:
        """
        Whether a set explains in rows held out at least half of what it explains in those fitted.

        Effects that are found in some rows and say nothing of the others stand for something else.
        """
        fit = self.fits[names]
        known = self._predicts.get(names)
        if known is None or known[0] is not fit.predicted:
            before, after, fitted = (rms(self.problem.measured - response) ** 2 for response in (
                self.base.predicted, self.fitter.cross_validate([fit])[0].held_out, fit.predicted))
            self._predicts[names] = known = (
                fit.predicted, before - after > PREDICTED * (before - fitted))
        return known[1]

    def _allowed(self, names: frozenset[str]) -> float:
        """Return the largest RMSE that a set may have, in the unit of the response."""
        covariance = self.fits[names].covariance
        if covariance is None:
            return self.largest_rmse
        known = self._largest_errors.get(names)
        if known is None or known[0] is not covariance:
            along = covariance.of(covariance.discrepancy.of_model_alone())
            self._largest_errors[names] = known = (
                covariance, self._largest_error(along), self._largest_error(covariance))
        _, own, with_equations = known
        explained = self.own_error(frozenset()) ** 2 - self.own_error(names) ** 2
        further = own ** 2 - self.largest_rmse ** 2 + min(
            with_equations ** 2 - own ** 2, self.settings.form ** 2 * max(explained, 0.0))
        if further > 0.0:
            # The share beyond doubt, as James and Stein shrink an estimate by it. From half of what
            # is explained on, that share falls faster than the uncertainty grows; but a model that
            # may be more wrong must not have to fit better.
            explained = max(explained, 1e-300)
            further = min(further, explained / 2.0)
            further *= 1.0 - further / explained
        return math.sqrt(self.largest_rmse ** 2 + further)

    def _largest_error(self, covariance: Covariance, level: float = ADEQUATE) -> float:
        """Return the RMS that a discrepancy stays below at a probability; see `own_error`."""
        return covariance.largest_error(
            np.random.default_rng(self._seed), self.settings.draws, level, courses=False)

    def valid(self) -> list[frozenset[str]]:
        """
        Return the sets that may be the answer, most probable first.

        All values are physical, the size of a form that was chosen is determined, and each effect
        matters: without it the error is larger by a practical size, and by more than the expected
        error of the base model; or, as that repeats itself with the drive, it remembers something
        of its own, and the set is clearly less probable without it. And without it the error is
        larger than the base model's own could be, or what stays is clearly less probable. A single
        effect also has to explain more than the best of all would by chance; no set of as few
        effects has a smaller residual, by more than the base model's error and that of an effect's
        equation could be; and no set of fewer effects, of which fewer act, suffices with a residual
        that is as small but for the base model's error.
        """
        physical = [names for names in self.ranked() if not self.fits[names].implausible()
                    and not self._form_in_doubt(names)]
        valid = [names for names in physical if self._each_matters(names)
                 and (len(names) != 1 or self.p_values.get(next(iter(names)), 1.0) <= SIGNIFICANCE)
                 and not self._surpassed(names, physical)]
        return [names for names in valid if not any(
            0 < len(fewer) < len(names) and self.acting(fewer) < self.acting(names)
            and self.sufficient(fewer) and self._hardly_better(names, fewer) for fewer in valid)]

    def _form_in_doubt(self, names: frozenset[str]) -> bool:
        """Whether an effect of a set has a form whose size the rows do not determine."""
        fit = self.fits[names]
        if not any(effect.size_parameter.form for effect in fit.effects):
            return False
        return any(effect.size_parameter.form and not_determined(effect, self.problem.kind)
                   for effect in self.fitter.with_intervals(fit))

    def _each_matters(self, names: frozenset[str]) -> bool:
        error = self.own_error(names)
        for without in subsets(names):
            if without not in self.fits:
                continue
            before = self.own_error(without)
            least = max(self.settings.practical * before,
                        LEAST_SHARE * self.own_error(frozenset()))
            if before - error < least or self._would_do(without, names):
                return False
            if self._hardly_better(names, without):
                return False
        return True

    def _hardly_better(self, names: frozenset[str], fewer: frozenset[str]) -> bool:
        """
        Whether a set explains no more than one of fewer effects but for the base model's error.

        As that repeats itself with the drive, it is more if all that the set has beyond remembers
        something of its own and the set is clearly more probable.
        """
        gain = self.own_error(fewer) ** 2 - self.own_error(names) ** 2
        return gain < self.covariance.size ** 2 and not (
            self._remembers(names, fewer) and self._clearly_more_probable(names, fewer))

    def _remembers(self, names: frozenset[str], without: frozenset[str]) -> bool:
        """Whether what a set has more than a smaller one has a memory of its own."""
        return all(effect.memory for effect in self.fits[names].effects
                   if effect.id not in without)

    def _surpassed(self, names: frozenset[str], others: Iterable[frozenset[str]]) -> bool:
        """Whether another set of as few effects predicts far better."""
        form = self.settings.form * self.error(frozenset())
        least = self.own_error(names) ** 2 - self.covariance.size ** 2 - form ** 2
        return least > 0.0 and any(self.own_error(other) ** 2 < least for other in others
                                   if 0 < len(other) <= len(names))

    def _would_do(self, without: frozenset[str], names: frozenset[str]) -> bool:
        """
        Whether a smaller set may be the answer, and is not clearly less probable.

        Where its residual is larger than the base model's own error could be, and that of the
        larger set is not, it must not be less probable at all.
        """
        if not self.sufficient(without) or self.fits[without].implausible():
            return False
        if self.noise_free_rmse(without) > self.largest_rmse >= self.noise_free_rmse(names):
            return self.log_posterior(names) < self.log_posterior(without)
        return not self._clearly_more_probable(names, without)

    def _clearly_more_probable(self, names: frozenset[str], without: frozenset[str]) -> bool:
        """Whether a smaller set is so much less probable that it would not be reported."""
        odds = self.log_posterior(names) - self.log_posterior(without)
        return odds >= -math.log(self.settings.reported)


def rms(residual: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(residual ** 2)))


def subsets(names: frozenset[str]) -> list[frozenset[str]]:
    """Return the sets that lack one of the effects named."""
    return [names - {name} for name in names]
