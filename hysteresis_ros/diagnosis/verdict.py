# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The answer of a diagnosis, and what both kinds of measurement say in the same words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import dataclasses
from typing import Any, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis import significance
from hysteresis_ros.effects import catalogue, Effect
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.result import Brief, Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from hysteresis_ros.diagnosis.arm_fit import Fit

# Effects whose signatures agree more than this (|cosine|) cannot be told apart.
CONFUSED = 0.9
# Effects in the short table of a diagnosis.
SHOWN = 5


@dataclasses.dataclass(repr=False)
class Diagnosis(Result):
    """
    The verdict and what it rests on; `to_dict` gives the fields by the names users rely on.

    Attributes
    ----------
    verdict : str
        'adequate', 'missing', 'unknown' or 'not_excited'.
    missing : list of str
        Effects to add, in order.
    alternatives : list of list of str
        For each missing effect those that the data cannot tell from it.
    ranking : list of dict
        Every effect that was tried, best first.
    sets : list of dict
        Sets of effects with their posterior probability and RMSE, most probable first; an empty
        set is the model as it is, ``['unknown']`` what no effect of the catalogue explains. They
        add up to 1.
    noise_floor : float
        White noise of the sensor, in the unit of the response.
    structural_error : float or None
        Expected error of the base model; None on a bench, where it is not known.
    bench_error : float or None
        The part of it that the bench shows. The rest is what the wire may do besides, with a share
        from none to all that no bench of constant loads tells: see `Discrepancy.courses`.
    unexplained : float
        Share of the mean square error that nothing explains.
    experiment : str
        What to measure next.
    effects : list of Effect
        The missing ones, fitted, with intervals.
    rmse_before, rmse_after : float
        Held-out error without and with them, by which effects are chosen, as in `ranking` and
        `sets`: the RMSE of all rows, or on a bench the typical RMSE. That is the geometric mean of
        the RMSE on each part that was held out, which is a load or a few trials.
    not_excited : dict of str to str
        Unobservable effects, with the reason.
    event : float or None
        Time [s] at which something happened that lasts.
    signal : str
        Signal in which an unexplained residual shows.
    single_row : float or None
        Time [s], as `event`, of the one row that has more than half of an unexplained residual's
        square, or of that of the best set's residual: a reading that is wrong.
    uneven : bool
        Whether an unexplained residual is like noise, but larger at some times than at others.
    resembles : list of str
        Effects that an unknown one is like; they explain it with implausible values.
    explains_most : list of str
        Effects that explain most of an unknown one, but leave more than the model may be off by.
    learned : dict or None
        A learned term that is offered instead.
    quantity : str
        What was measured: 'angle', 'length', 'strain' or 'force'.
    where : list of dict
        Where the model fails, worst first, as in the JSON of `compare`; empty where no comparison
        was asked for.
    draws : int
        Random draws behind a p value; none can be smaller than 1 / (1 + draws). 0 if not known.
    pooled_before, pooled_after : float or None
        On a bench the RMSE of all rows held out, without and with the missing effects; sets are
        not chosen by it. None on an arm.
    small_error : float or None
        On a bench the error below which none matters; None on an arm.
    kept_strain : dict or None
        What martensite that keeps strain would explain of the error that is left, which no bench
        of constant loads shows and `structural_error` counts; see `diagnosis.not_on_bench`.
    kinetics : dict or None
        The same of kinetics that leave minor loops open, of which a bench goes through few; on a
        bench what they explain of a row left out, with the RMSE that it would have.
    """

    verdict: str
    missing: list[str]
    alternatives: list[list[str]]
    ranking: list[dict[str, Any]]
    sets: list[dict[str, Any]]
    noise_floor: float
    structural_error: float | None
    bench_error: float | None
    unexplained: float
    experiment: str
    effects: list[Effect]
    rmse_before: float
    rmse_after: float
    not_excited: dict[str, str]
    event: float | None
    signal: str
    single_row: float | None = None
    uneven: bool = False
    resembles: list[str] = dataclasses.field(default_factory=list)
    explains_most: list[str] = dataclasses.field(default_factory=list)
    learned: dict[str, Any] | None = None
    quantity: str = ''
    where: list[dict[str, Any]] = dataclasses.field(default_factory=list)
    draws: int = 0
    pooled_before: float | None = None
    pooled_after: float | None = None
    small_error: float | None = None
    kept_strain: dict[str, Any] | None = None
    kinetics: dict[str, Any] | None = None

    @property
    def error_name(self) -> str:
        """Name of the error by which effects are chosen."""
        return 'RMSE' if self.pooled_before is None else 'typical RMSE'

    def to_dict(self) -> dict[str, Any]:
        """Return plain types for JSON."""
        content = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)
                   if field.name != 'effects'}
        content['effects'] = [effect.to_dict() for effect in self.effects]
        return content

    def brief(self) -> Brief:
        """Return verdict, error and next experiment, with the table of the effects tried."""
        unit, scale = shown(self.quantity)
        first = f'Diagnosis: {self.verdict}'
        if self.missing:
            first += ' ' + ' + '.join(
                f'one of {", ".join([name, *rest])}' if rest else name
                for name, rest in zip(self.missing, self.alternatives))
        shares = [entry['probability'] for entry in self.sets
                  if self.missing and set(entry['effects']) == set(self.missing)]
        if shares:
            first += f' (probability {shares[0]:.2f})'
        error = f'{self.error_name} on rows not fitted: {scale * self.rmse_before:.3g} {unit}'
        if self.missing:
            error += f', with the effects {scale * self.rmse_after:.3g} {unit}'
        lines = [first, error, f'next: {self.experiment}']
        others = [f'{name} cannot be told from {", ".join(rest)}'
                  for name, rest in zip(self.missing, self.alternatives) if rest]
        if others:
            lines.insert(1, '; '.join(others))
        rows = [[row['effect'], f'{scale * row["rmse_after"]:.3g}', f'{100.0 * row["gain"]:.0f} %',
                 self.p_value(row), 'yes' if row['plausible'] else 'no']
                for row in self.ranking[:SHOWN]]
        return Brief(lines, ['effect', f'{self.error_name} after [{unit or "1"}]', 'gain', 'p',
                             'plausible'], rows)

    def p_value(self, row: dict) -> str:
        """Return the p value of a row of the ranking; `<=` before the least of these draws."""
        least = 1.0 / (1.0 + self.draws)
        if self.draws and row['p_value'] <= least * (1.0 + 1e-9):
            return f'<= {least:.2g}'
        return f'{row["p_value"]:.3f}'

    def plot(self) -> Figure:
        """
        Draw the error with each effect added alone, with 95 % intervals.

        Returns
        -------
        matplotlib.figure.Figure

        """
        from hysteresis_ros.report.plots import ranking
        return ranking(self)


def ranking_row(effect: Effect, fit: Fit, before: float, after: float, p_value: float,
                gain: tuple[float, float]) -> dict[str, Any]:
    """
    Return the entry of one effect by itself.

    Parameters
    ----------
    effect : Effect
        Fitted, with intervals.
    fit : Fit
    before, after : float
        Error on rows that were not fitted, as in `Diagnosis`.
    p_value : float
    gain : (float, float)
        Interval of the relative reduction of that error.
    """
    return {'effect': effect.id, 'rmse_before': before, 'rmse_after': after,
            'gain': 1.0 - after / before if before > 0.0 else 0.0,
            'gain_low': gain[0], 'gain_high': gain[1],
            'p_value': p_value, 'parameters': effect.to_dict()['parameters'],
            'plausible': not fit.implausible()}


def add_signatures(rows: Sequence[dict[str, Any]], signatures: np.ndarray,
                   weight_columns: np.ndarray) -> None:
    """
    Say of ranked effects how much refitted weights absorb, and with what each is confused.

    Parameters
    ----------
    rows : list of dict
        See `ranking_row`; gets 'absorbed' and 'confused_with'.
    signatures : ndarray, shape (effects, n)
        What each changes in the response.
    weight_columns : ndarray, shape (n, K)
        How each weight of H2 moves the response.
    """
    if not rows:
        return
    alike = significance.cosines(signatures)
    size = np.linalg.norm(signatures, axis=1)
    remaining = np.linalg.norm(significance.residualise(weight_columns, signatures), axis=1)
    absorbed = 1.0 - (remaining / np.maximum(size, 1e-300)) ** 2
    for row, share, cosines in zip(rows, absorbed, alike):
        row['absorbed'] = float(np.clip(share, 0.0, 1.0))
        row['confused_with'] = [other['effect'] for other, cosine in zip(rows, cosines)
                                if other is not row and cosine > CONFUSED]


def shown_or_not(found: Diagnosis) -> Diagnosis:
    """
    Return a diagnosis in which no effect is both ranked and one that could not have shown.

    What is missing, or may be instead, has shown; of the others the reason stands.
    """
    named = {*found.missing, *(name for names in found.alternatives for name in names)}
    hidden = {name: reason for name, reason in found.not_excited.items() if name not in named}
    ranking = [{**row, 'confused_with': [name for name in row['confused_with']
                                         if name not in hidden]}
               for row in found.ranking if row['effect'] not in hidden]
    return dataclasses.replace(found, ranking=ranking, not_excited=hidden)


def in_order(rows: Iterable[dict[str, Any]], missing: Sequence[str]) -> list[dict[str, Any]]:
    """Return ranked effects, the missing ones first, then the plausible ones by error."""
    order = {name: position for position, name in enumerate(missing)}
    return sorted(rows, key=lambda row: (order.get(row['effect'], len(order)),
                                         not row['plausible'], row['rmse_after']))


def next_experiment(verdict: str, names: Sequence[str], alternatives: Sequence[Sequence[str]],
                    unobservable: Mapping[str, str]) -> str:
    """
    Return what to measure next.

    Parameters
    ----------
    verdict : str
    names : sequence of str
        Missing effects, or those that an unknown one is like.
    alternatives : list of list of str
    unobservable : dict of str to str
    """
    effects = catalogue()
    if verdict == 'unknown':
        return '; '.join([
            'repeat the recording with another sequence of the drive and look at the residual',
            *(f'what is like {name} shows best so: {effects[name].experiment}'
              for name in names)])
    for name, others in zip(names, alternatives):
        if others:
            return (f'to tell {name} from {" and ".join(others)}: '
                    + '; '.join(effects[one].experiment for one in [name, *others]))
    if names:
        return f'record again after `extend --add {",".join(names)}` and compare'
    if unobservable:
        name = next(iter(unobservable))
        return f'to see {name}, too: {effects[name].experiment}'
    return 'nothing: the model explains this recording'
