# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
When a running arm is diagnosed, on which of its holds, and when an effect counts as found.

The watch keeps the ends of the holds since the muscle was last cold with its memory wiped. Of those
before the window only the extremes stay that the muscle remembers: a rise that goes beyond an
earlier one wipes it, as in the model's operators (Mayergoyz, Mathematical Models of Hysteresis,
ch. 1). They are the history that each diagnosis begins with; only the window is judged.

Whether the residuals r_i have left the band b, and since when, is told by the likelihood of a
change at one hold, from which on a share w of them has the size s b,

    max over k, s, w of  sum over i >= k of  ln(1 - w + w p(r_i / (s b)) / (s p(r_i / b))),

with p Student's density with 4 degrees of freedom: a model's own errors have heavy tails, and one
large one is no change. What meets an end stop shows it in some holds only. The window begins at k.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import math
from typing import NamedTuple, TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.diagnose import FEWEST_ROWS
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.table import Measurement
from hysteresis_ros.model.onset import COLUMN as ONSET

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.measurements.live_holds import Hold

# The residual has left the band at odds of a hundred to one, and to sizes such as these.
ALARM = math.log(100.0)
SIZES = np.array([2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
# Of the holds that show it, all to one in four.
SHOWING = np.array([1.0, 0.5, 0.25])
FREEDOM = 4.0
# It is in the band again when the RMSE of so many holds in a row is.
BACK = 15
# Holds between two diagnoses: as many until an effect was named, then this share of the window.
FRESH, SHARE = 2, 0.3
# Holds that the window has at least, however long they last, and holds kept at most.
LEAST_WINDOW, MOST_HOLDS = 20, 400
# Diagnoses in a row have to agree while the number of holds grows by this factor.
GROWTH = 1.5
# The RMSE, over the band, from which on something is diagnosed. The band is that of the wire on the
# bench: the same arm with wires of another batch is up to one and a half bands off its model (the
# worst twelve holds of 42 batches), and would be told that something is missing, rightly, but not
# what its owner wants to hear.
CLEAR = 2.0
# Share of its way by which the drive goes beyond a hold, and comes back, where it counts.
VOLTAGE_SHARE = 0.01
# Drive [V] at which the muscle is cold.
COLD = 0.01
UNKNOWN = ('monitor: it is not known what the muscle remembers; call ~/initialise of the bridge, '
           'or hold it at 0 V for a while')


class Finding(NamedTuple):
    """
    What the diagnoses agree on.

    Attributes
    ----------
    effects : tuple of str
        The missing ones; none where something acts that no effect explains.
    others : tuple of str
        Effects that the data cannot tell from those.
    probability : float
        Of these effects and those together.
    since : float
        Time [s] of the last hold before.
    holds : int
        That were judged.
    """

    effects: tuple[str, ...]
    others: tuple[str, ...]
    probability: float
    since: float
    holds: int


class Watch:
    """
    The holds of a running arm, and what is to be diagnosed of them.

    Parameters
    ----------
    band : float
        RMSE [rad] that the base model's own error stays below at 95 %.
    window : float
        Time [s] that is judged at most, though at least twenty holds are.

    Attributes
    ----------
    band : float
        As given.
    finding : Finding or None
        What is found.
    """

    def __init__(self, band: float, window: float = math.inf) -> None:
        self.band = band
        self._window = window
        self.begin()

    def begin(self, known: bool = True) -> None:
        """
        Begin anew.

        Parameters
        ----------
        known : bool
            Whether the muscle is cold with its memory wiped. If not, holds count from the first
            at no voltage on, which wipes the memory, too.
        """
        self._known = known
        # With whether it is known what the muscle remembered then; others are not judged.
        self._holds: list[tuple[Hold, bool]] = []
        self._history: list[Hold] = []
        # Where the drive went for less than a hold and took the arm along, the muscle remembers
        # something, nobody knows how much; until a settled state lies beyond these angles.
        self._low, self._high = math.inf, -math.inf
        self._evidence = 0.0
        # Times of the last holds before the window, and before what is looked at for it.
        self._since = self._floor = -math.inf
        self._diagnosed = self._new = 0
        # Number of holds and what was named, of diagnoses in a row that agree.
        self._answers: list[tuple[int, set[str]]] = []
        self.finding: Finding | None = None

    @property
    def count(self) -> int:
        """Number of holds in the window."""
        return len(self._holds)

    @property
    def out_of_band(self) -> bool:
        """Whether the residual has left the band."""
        return self._evidence >= ALARM

    def add(self, hold: Hold) -> None:
        """Take the next hold."""
        if not self._known:
            if hold.voltage > COLD:
                return
            self.begin()
        sure = self._sure(hold)
        self._holds.append((hold, sure))
        if sure:
            self._follow()
        self._drop_old(hold.time)

    def _sure(self, hold: Hold) -> bool:
        """Whether it is known what the muscle remembers at a hold."""
        before = self._holds[-1][0] if self._holds else None
        if before is not None:
            beyond = VOLTAGE_SHARE * (hold.most - hold.least)
            if (hold.most > max(before.voltage, hold.voltage) + beyond
                    and hold.lowest < min(before.angle, hold.angle) - self.band):
                self._low = min(self._low, hold.lowest)
            if (hold.least < min(before.voltage, hold.voltage) - beyond
                    and hold.highest > max(before.angle, hold.angle) + self.band):
                self._high = max(self._high, hold.highest)
        if hold.angle <= self._low + self.band:
            self._low = math.inf
        if hold.angle >= self._high - self.band:
            self._high = -math.inf
        return self._low == math.inf and self._high == -math.inf

    def _follow(self) -> None:
        """See whether the residual has left the band, or is in it again."""
        self._new += 1
        holds = [hold for hold, sure in self._holds if sure and hold.time > self._floor]
        ratios = np.array([(hold.angle - hold.predicted) / self.band for hold in holds])
        if self.out_of_band and len(holds) > BACK and np.mean(ratios[-BACK:] ** 2) <= 1.0:
            self._floor = self._since = holds[-BACK - 1].time
            self._evidence = 0.0
            self._forget_answers()
            return
        # Those before the change may be history by now.
        long_ago = self.out_of_band and self._since < holds[0].time
        self._evidence, first = left_the_band(ratios)
        since = holds[first - 1].time if first else self._since if long_ago else self._floor
        if not self.out_of_band:
            self._forget_answers()
        self._since = since

    def _forget_answers(self) -> None:
        self._diagnosed = self._new = 0
        self._answers = []
        self.finding = None

    def _drop_old(self, now: float) -> None:
        while len(self._holds) > MOST_HOLDS or (
                len(self._holds) > LEAST_WINDOW and now - self._holds[0][0].time > self._window):
            self._history = remembered([*self._history, self._holds.pop(0)[0]])

    def _off(self) -> list[Hold]:
        """Return the holds since the residual began to leave the band."""
        return [hold for hold, sure in self._holds if sure and hold.time > self._since]

    @property
    def due(self) -> bool:
        """Whether there is something new to be diagnosed."""
        count = len(self._off())
        named = self.finding is not None and self.finding.effects
        fresh = (max(FRESH, SHARE * self._diagnosed) if named or count > LEAST_WINDOW else FRESH)
        return (self.out_of_band and count >= FEWEST_ROWS and self._clear()
                and (self._diagnosed == 0 or self._new >= fresh))

    def _clear(self) -> bool:
        """Whether the holds since the residual left the band are clearly beyond it."""
        squares = [(hold.angle - hold.predicted) ** 2 for hold in self._off()]
        return math.sqrt(math.fsum(squares) / max(len(squares), 1)) >= CLEAR * self.band

    def measurement(self) -> Measurement:
        """
        Return what is to be judged: the holds since the residual left the band, else the window.

        Returns
        -------
        Measurement
            Rows that are settled. Where 'history' is 1 they only lead the model to its state, and
            where 'before_onset' is 1 nothing that is tried has acted yet.

        Raises
        ------
        MeasurementError
            If there is no hold.
        """
        since = self._since if self.out_of_band else -math.inf
        begin = next((place for place, (hold, _) in enumerate(self._holds) if hold.time > since),
                     len(self._holds))
        if begin == len(self._holds):
            raise MeasurementError('monitor: no hold of the arm has ended yet since the muscle was '
                                   'cold with its memory wiped' if self._known else UNKNOWN)
        history = remembered([*self._history, *(hold for hold, _ in self._holds[:begin])])
        return as_measurement(history, self._holds[begin:], since)

    def begun(self) -> None:
        """Take note that `measurement` is being diagnosed."""
        self._diagnosed, self._new = len(self._off()), 0

    def answer(self, found: Diagnosis) -> None:
        """Take the answer to what was `begun`."""
        if not self._diagnosed:
            return      # the residual has come back meanwhile
        if found.verdict == 'unknown' and found.event is not None:
            later = [hold for hold in self._off() if hold.time >= found.event]
            if later and len(later) < len(self._off()):
                # The diagnosis knows better since when.
                self._floor = self._since = max(
                    hold.time for hold in self._off() if hold.time < found.event)
                self._diagnosed = 0
                return
        effects = tuple(found.missing) if found.verdict == 'missing' else ()
        others = tuple(name for names in found.alternatives for name in names) if effects else ()
        named = (*effects, *others) if effects else (found.verdict,)
        agreed = [*self._answers, (self._diagnosed, set(named))]
        while not set.intersection(*(names for _, names in agreed)):
            agreed.pop(0)
        self._answers = agreed
        # One more that agrees, on holds since an earlier moment, makes none later.
        if self._diagnosed < GROWTH * min(count for count, _ in agreed):
            return
        if effects or found.verdict == 'unknown':
            self.finding = Finding(effects, others, probability(found, named), self._since,
                                   self._diagnosed)
        else:
            self.finding = None


def probability(found: Diagnosis, names: Iterable[str]) -> float:
    """Return the probability of all sets of a diagnosis that only hold effects named."""
    among = set(names)
    return float(sum(one['probability'] for one in found.sets
                     if one['effects'] and among.issuperset(one['effects'])))


def left_the_band(ratios: np.ndarray) -> tuple[float, int]:
    """
    Tell whether errors have become larger.

    Parameters
    ----------
    ratios : ndarray, shape (n,)
        Errors over their usual size.

    Returns
    -------
    evidence : float
        Logarithm of the likelihood ratio of the most likely change.
    first : int
        The first error after it.
    """
    squares = ratios[::-1, None, None] ** 2 / FREEDOM
    sizes = SIZES[:, None]
    tails = ((1.0 + squares) / (1.0 + squares / sizes ** 2)) ** (0.5 * (FREEDOM + 1.0))
    gains = np.log(1.0 - SHOWING + SHOWING * tails / sizes)
    best = np.max(np.cumsum(gains, axis=0), axis=(1, 2))
    count = int(np.argmax(best))
    return float(best[count]), len(ratios) - 1 - count


def remembered(holds: Sequence[Hold]) -> list[Hold]:
    """
    Return the holds that a muscle remembers, which was cold before the first.

    These are the turning points of the voltage, alternately largest and smallest, without those
    that later ones went beyond, and the last hold.
    """
    kept: list[Hold] = []
    for hold in holds:
        while kept:
            last = kept[-1].voltage
            before = kept[-2].voltage if len(kept) > 1 else -math.inf
            if (last - before) * (hold.voltage - last) >= 0.0:
                kept.pop()              # on the way on
            elif len(kept) > 1 and (hold.voltage - before) * (before - last) >= 0.0:
                del kept[-2:]           # beyond the turning point before the last
            else:
                break
        kept.append(hold)
    return kept


def as_measurement(history: Sequence[Hold], holds: Sequence[tuple[Hold, bool]],
                   since: float = -math.inf) -> Measurement:
    """
    Return holds as the rows of one trial that began when the muscle was cold.

    Parameters
    ----------
    history : sequence of Hold
        Not judged.
    holds : sequence of (Hold, bool)
        With whether each is judged.
    since : float
        Time [s] of the last hold before the residual left the band.

    Returns
    -------
    Measurement
    """
    rows = [*((hold, False) for hold in history), *holds]
    columns = {name: np.array([getattr(hold, name) for hold, _ in rows])
               for name in ('time', 'voltage', 'angle', 'ambient')}
    ambient = columns.pop('ambient')
    if np.all(np.isfinite(ambient)):
        columns['ambient_temperature'] = ambient
    columns['trial'] = np.zeros(len(rows))
    columns['history'] = np.array([0.0 if judged else 1.0 for _, judged in rows])
    if any(hold.time <= since for hold, _ in rows):
        columns[ONSET] = np.array([1.0 if hold.time <= since else 0.0 for hold, _ in rows])
    return Measurement.from_columns(columns, 'monitor')
