# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Diagnose a running arm: from its samples to what its model lacks, in sentences.

Samples become holds, holds a `Watch`, and what it has to have diagnosed is done by another process
at low priority, within a budget. Nothing here waits, and nothing that goes wrong with a diagnosis
is an exception.
"""

from __future__ import annotations

from collections.abc import Callable
import datetime
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

from hysteresis_ros.background import Background, Budget
from hysteresis_ros.diagnosis.band import error_band
from hysteresis_ros.diagnosis.diagnose import diagnose, FEWEST_ROWS
from hysteresis_ros.diagnosis.watch import COLD, probability, UNKNOWN, Watch
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.measurements.csv import write_csv
from hysteresis_ros.measurements.live_holds import HoldDetector
from hysteresis_ros.report.words import parameters_in_words

if TYPE_CHECKING:
    from hysteresis_ros.background import Outcome
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.measurements.live_holds import Hold
    from hysteresis_ros.model import MuscleModel

# Share of the range of the drive that is no change of it.
HELD = 1e-3
# Time [s] over which the share of a core can be saved up.
SAVING = 120.0

# Takes whether a diagnosis was made, and what it says or why not.
Answer = Callable[[bool, str], None]


class Monitor:
    """
    The diagnosis of a running arm.

    Parameters
    ----------
    model : MuscleModel
        With an arm.
    window : float
        Time [s] that is judged at most, though at least twenty holds are.
    settled : float
        Time [s] that a hold has to last.
    share : float
        Of a core that diagnoses may take on average.
    now : float
        Time of the wall [s].
    background : Background, optional
        What computes.

    Attributes
    ----------
    problem : str
        What went wrong with the latest computation, '' if nothing.
    """

    def __init__(self, model: MuscleModel, window: float, settled: float, share: float, now: float,
                 background: Background | None = None) -> None:
        self._model = model
        self._window = window
        low, high = model.ranges[model.drive]
        self._detector = HoldDetector(HELD * (high - low), settled)
        self._background = background or Background()
        self._budget = Budget(share, SAVING * share, now)
        self._watch: Watch | None = None
        # Holds that came before the band was known.
        self._pending: list[Hold] = []
        self._known: bool | None = None
        self._task = ''
        self._asked: list[Answer] = []
        self._found: Diagnosis | None = None
        self.problem = ''
        self.diagnoses = 0

    def begin(self) -> None:
        """Begin anew: the muscle is cold with its memory wiped, or will show whether it is."""
        self._detector.reset()
        self._pending = []
        self._known = None
        self._found = None
        if self._watch is not None:
            self._watch.begin()
        if self._task == 'diagnosis':
            self._task = 'outdated'

    def add(self, time: float, voltage: float, angle: float, predicted: float,
            ambient: float) -> None:
        """Take a sample: time [s], voltage [V], angles [rad] and the room's temperature [degC]."""
        if self._known is None:
            # An arm that is driven already remembers what nobody has seen.
            self._known = voltage <= COLD
            if self._watch is not None:
                self._watch.begin(self._known)
        hold = self._detector.add(time, voltage, angle, predicted, ambient)
        if hold is None:
            return
        if self._watch is None:
            self._pending = [*self._pending, hold][-1000:]
        else:
            self._watch.add(hold)

    def ask(self, answer: Answer) -> None:
        """Have the holds so far diagnosed, whatever the residual, and `answer` called then."""
        if self._watch is None:
            answer(False, self.problem or 'no hold of the arm has ended yet: a settled state needs '
                   'the voltage to be held')
            return
        self._asked.append(answer)

    def look(self, now: float) -> None:
        """Take what has been computed and begin what is to be; `now` is the wall's time [s]."""
        outcome = self._background.poll()
        if outcome is not None:
            self._take(outcome)
        if self._background.busy:
            return
        if self._watch is None:
            if self._pending and not self.problem:
                self._begin('band', error_band, self._model)
        elif self._asked or (self._watch.due and self._budget.may_begin(now)):
            self._diagnose(self._watch)

    def stop(self) -> None:
        """End what is being computed."""
        self._background.stop()
        self._answer(False, 'the node ends')

    def save(self, folder: str, at: datetime.datetime) -> Path:
        """
        Write what would be diagnosed as a table, whose diagnosis gives the same answer.

        Parameters
        ----------
        folder : str
            Made where it is missing; empty for ``hysteresis_ros`` in ``$ROS_HOME`` or ``~/.ros``.
        at : datetime.datetime
            For the name of the file.

        Returns
        -------
        Path

        Raises
        ------
        MeasurementError
            If there is no hold.
        OSError
            If the file cannot be written.
        """
        if self._watch is None or not self._watch.count:
            raise HysteresisError(UNKNOWN if self._known is False else
                                  'no hold of the arm has ended yet: a settled state needs the '
                                  'voltage to be held')
        measurement = self._watch.measurement()
        home = Path(os.environ.get('ROS_HOME') or Path.home() / '.ros')
        into = Path(folder).expanduser() if folder else home / 'hysteresis_ros'
        into.mkdir(parents=True, exist_ok=True)
        path = into / f'arm_{at:%Y%m%dT%H%M%S_%f}.csv'
        write_csv(measurement, path)
        return path

    @property
    def sentence(self) -> str:
        """What was found out, '' if there is nothing to say."""
        finding = self._watch.finding if self._watch is not None else None
        if finding is None or self._found is None or self._watch is None:
            return ''
        if not finding.effects:
            return (f'the arm is off its model, and no effect of the catalogue explains it '
                    f'({finding.holds} holds)')
        return (f'the model lacks {in_words(self._found)}, by {finding.holds} holds; '
                f'`hysteresis extend --add {",".join(finding.effects)}` adds it')

    def values(self, now: float) -> dict[str, Any]:
        """Return what diagnostics show, by name."""
        watch = self._watch
        values: dict[str, Any] = {
            'settled holds': len(self._pending) if watch is None else watch.count,
            'diagnoses': self.diagnoses, 'share of a core': self._budget.used(now)}
        if watch is not None:
            values['error band [rad]'] = watch.band
            values['residual'] = 'out of the band' if watch.out_of_band else 'in the band'
        if self.sentence and watch is not None and watch.finding is not None:
            finding = watch.finding
            values['missing effect'] = ', '.join(finding.effects) or 'unknown'
            values['cannot be told from'] = ', '.join(finding.others) or 'none'
            values['probability'] = finding.probability
            values.update(parameter_values(self._found))
        return values

    def _begin(self, task: str, function: Callable, *args: Any) -> None:
        try:
            self._background.start(function, *args)
            self._task = task
        except (OSError, RuntimeError) as error:
            self._fail(f'{task}: {error}')

    def _diagnose(self, watch: Watch) -> None:
        if watch.count < FEWEST_ROWS:
            self._answer(False, UNKNOWN if self._known is False and not watch.count else
                         f'{watch.count} holds of the arm have ended so far; a diagnosis needs '
                         f'{FEWEST_ROWS}')
            return
        try:
            measurement = watch.measurement()
        except HysteresisError as error:
            self._fail(str(error))
            return
        watch.begun()
        self._begin('diagnosis', diagnose, self._model, [measurement])

    def _take(self, outcome: Outcome) -> None:
        task, self._task = self._task, ''
        self._budget.spend(outcome.cpu)
        if outcome.problem:
            self._fail(f'{task}: {outcome.problem}')
        elif task == 'band':
            self._watch = Watch(outcome.value, self._window)
            self._watch.begin(self._known is not False)
            for hold in self._pending:
                self._watch.add(hold)
            self._pending = []
        elif task == 'outdated':
            self._answer(False, 'the prediction was started again meanwhile')
        elif self._watch is not None:
            self.problem = ''
            self.diagnoses += 1
            self._found = outcome.value
            self._watch.answer(outcome.value)
            self._answer(True, answer_in_words(outcome.value))

    def _fail(self, problem: str) -> None:
        self.problem = f'no diagnosis: {problem}'
        self._answer(False, self.problem)

    def _answer(self, success: bool, message: str) -> None:
        asked, self._asked = self._asked, []
        for answer in asked:
            answer(success, message)


def in_words(found: Diagnosis) -> str:
    """Return the missing effects of a diagnosis with their values and probability."""
    words = []
    for effect, others in zip(found.effects, found.alternatives):
        text = f'{effect.id} ({parameters_in_words(effect.id, effect.to_dict()["parameters"])})'
        words.append(text + (f' or {" or ".join(others)}' if others else ''))
    names = [*found.missing, *(name for names in found.alternatives for name in names)]
    return f'{" and ".join(words)}, probability {probability(found, names):.2f}'


def answer_in_words(found: Diagnosis) -> str:
    """Return a diagnosis in one line."""
    error = f'{found.rmse_before:.3g} rad off on average'
    if found.verdict == 'missing':
        return (f'missing: {in_words(found)}; {error}, {found.rmse_after:.3g} rad with '
                f'{" and ".join(found.missing)}')
    if found.verdict == 'unknown':
        return f'unknown: {error}, and no effect of the catalogue explains it'
    if found.verdict == 'not_excited':
        return 'not excited: the arm has moved too little to show whether an effect is missing'
    return f'adequate: {error}, no more than the base model by itself may be'


def parameter_values(found: Diagnosis | None) -> dict[str, float]:
    """Return the fitted values of a diagnosis by 'effect parameter [unit]'."""
    values = {}
    for effect in found.effects if found is not None else ():
        for name, entry in effect.to_dict()['parameters'].items():
            unit = f' [{entry["unit"]}]' if entry['unit'] not in ('', '1') else ''
            values[f'{effect.id} {name}{unit}'] = float(entry['value'])
    return values
