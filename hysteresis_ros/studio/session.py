# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the page of `hysteresis studio` shows and does, without the page.

A session holds a model and recordings. Effects are ticked and their parameters set; each change
simulates the recordings anew. Fit, diagnosis, saving and report are those of the command line, and
`commands` says which commands repeat them.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
import os
import threading
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.comparison.compare import check_alike, running_time, trial_numbers
from hysteresis_ros.diagnosis.extend import base_of, extend, extend_by_hand, Extension
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import may_differ, observable, present
from hysteresis_ros.diagnosis.parameters import starts_of
from hysteresis_ros.effects import catalogue, effect_class
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.measurements.quantities import shown
from hysteresis_ros.paths import check_file, Given, refuse_input
from hysteresis_ros.report.provenance import Origin
from hysteresis_ros.report.recording import extremes
from hysteresis_ros.studio.commands import Source
from hysteresis_ros.studio.parts import Part, parts_of, rows_of, select
from hysteresis_ros.studio.sliders import Slider, sliders_of
from hysteresis_ros.studio.views import axis, Curves, Entry, Errors

if TYPE_CHECKING:
    from hysteresis_ros.api import Progress
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.bench_problem import BenchProblem
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.effects import Effect
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.model import MuscleModel

# Values from which an effect may start when it is ticked; each costs a simulation.
STARTS = 6
# Of many parts this share is kept unseen.
UNSEEN_SHARE = 4
# As many rows as a chart shows.
MOST_DRAWN = 3000
MODEL_NAME, REPORT_NAME = 'extended.yaml', 'report.html'


class Session:
    """
    A model, recordings, and the effects that are tried on them.

    Its methods may be called from several threads.

    Parameters
    ----------
    model : MuscleModel
    recordings : sequence of Measurement
        Of one quantity; none for a live arm that has not been heard yet.
    model_path : str
        Where the model came from.
    unseen : int
        How many recordings, the last ones, are not fitted; by default a quarter of the trials of
        one recording, or of several recordings.
    reading : tuple of str
        Options of the command line that say how recordings are read.
    folder : str
        For what is saved.

    Attributes
    ----------
    version : int
        Changes whenever something changes that a page shows.
    diagnosis : Diagnosis or None
        Of the base model, on the rows that are fitted.
    extension : Extension or None
        The latest fit, while the effects have its values.
    saved : list of str
        Models that were written, the latest last.

    Raises
    ------
    MeasurementError, ParameterError, ModelFileError
        If model and recordings do not go together.
    """

    def __init__(self, model: MuscleModel, recordings: Sequence[Measurement], *,
                 model_path: str, unseen: int | None = None, reading: tuple[str, ...] = (),
                 folder: str = '.') -> None:
        self._lock = threading.RLock()
        self.model, self.model_path, self.folder = model, model_path, folder
        self.version = 0
        self.diagnosis: Diagnosis | None = None
        self.extension: Extension | None = None
        self.saved: list[str] = []
        self._reading = reading
        self._effects: dict[str, Effect] = {}
        self._hidden: dict[str, str] = {}
        self._reported = ''
        self.recordings: list[Measurement] = []
        self.parts: list[Part] = []
        self.unseen: list[Part] = []
        if recordings:
            self._take(recordings)
            count = len(self.parts) // UNSEEN_SHARE or int(len(self.parts) > 1)
            if unseen is not None:
                count = unseen
            self.unseen = self.parts[len(self.parts) - count:]
            self._divide()

    @property
    def ready(self) -> bool:
        """Whether there is anything to look at."""
        return bool(self.recordings)

    @property
    def quantity(self) -> str:
        """What was measured."""
        return self.recordings[0].response if self.recordings else 'angle'

    @property
    def effects(self) -> list[Effect]:
        """The effects that are ticked, in the order in which they were."""
        return list(self._effects.values())

    def update(self, recordings: Sequence[Measurement]) -> None:
        """
        Take recordings that have grown; what was ticked and set stays.

        Parameters
        ----------
        recordings : sequence of Measurement
            A new trial of one that is known is fitted.
        """
        with self._lock:
            unseen = {part.name for part in self.unseen}
            self._take(recordings)
            self.unseen = [part for part in self.parts if part.name in unseen]
            self.extension = None
            self._divide()

    def touch(self) -> None:
        """Have pages look again at what they show."""
        with self._lock:
            self.version += 1

    def hold_out(self, names: Collection[str]) -> None:
        """
        Keep these parts, by their names, unseen and fit the others.

        Raises
        ------
        ParameterError
            If nothing would be left to fit.
        """
        with self._lock:
            unseen = [part for part in self.parts if part.name in names]
            if len(unseen) == len(self.parts):
                raise ParameterError('something has to be fitted; leave one part of the data in')
            if unseen != self.unseen:
                self.diagnosis = None
            self.unseen, self.extension = unseen, None
            self._divide()

    def catalogue(self) -> list[Entry]:
        """Return the effects that this kind of measurement can show, by stage."""
        with self._lock:
            kind = self._problem.kind if self.ready else 'arm'
            surroundings = self.model.surroundings
            own = {effect.id for effect in self.model.effects}
            fixed = {effect.id for effect in self.model.effects
                     if self.ready and not may_differ(self._problem, effect)}
            shares = self.probabilities()
            return [Entry(name, effect.stage, effect.sentence, name in self._effects,
                          name in own and (name in fixed or not self.ready),
                          self._hidden.get(name, ''),
                          shares.get(name, 0.0) if self.diagnosis else None)
                    for name, effect in catalogue().items()
                    if kind in effect.kinds and effect.available(surroundings)]

    def probabilities(self) -> dict[str, float]:
        """Return for each effect, and 'unknown', the probability of the sets that have it."""
        found: dict[str, float] = {}
        for entry in self.diagnosis.sets if self.diagnosis else ():
            for name in entry['effects']:
                found[name] = found.get(name, 0.0) + entry['probability']
        return found

    def tick(self, name: str, on: bool = True) -> None:
        """
        Add an effect, or take it away.

        It begins at the values that predict the fitted rows best of those that a fit would start
        from, and of what a diagnosis has found.

        Raises
        ------
        ParameterError
            If there is no such effect, or the model has it for good.
        """
        with self._lock:
            kind = effect_class(name)
            if not on:
                self._effects.pop(name, None)
            elif name not in self._effects:
                if any(entry.name == name and entry.built_in for entry in self.catalogue()):
                    raise ParameterError(f'the model already has the effect {name}')
                if not self.ready:
                    raise ParameterError('there is no recording yet')
                for other in kind.replaces:
                    self._effects.pop(other, None)
                self._effects[name] = self._best_start(name)
            self.extension = None
            self._simulate()

    def slide(self, name: str, value: float) -> None:
        """
        Set a parameter.

        Parameters
        ----------
        name : str
            `effect.parameter`.
        value : float
            In the parameter's unit.

        Raises
        ------
        ParameterError
            If the effect is not ticked, has no such parameter, or the value is not finite.
        """
        with self._lock:
            effect, _, parameter = name.partition('.')
            if effect not in self._effects:
                raise ParameterError(f'the effect {effect} is not ticked')
            self._effects[effect] = self._effects[effect].with_values(**{parameter: value})
            self.extension = None
            self._simulate()

    def sliders(self) -> list[Slider]:
        """Return the sliders of the effects that are ticked."""
        with self._lock:
            return [slider for effect in self.effects
                    for slider in sliders_of(effect, self._problem.kind)]

    def errors(self) -> dict[str, Errors]:
        """Return the errors on 'fitted' rows and, where there are any, on 'unseen' ones."""
        with self._lock:
            found = {}
            for name, rows in (('fitted', self._fitted), ('unseen', ~self._fitted)):
                if np.any(rows):
                    found[name] = Errors(*(
                        float(np.sqrt(np.mean((values - self._measured)[rows] ** 2)))
                        for values in (self._before, self._now)))
            return found

    def curves(self) -> Curves:
        """Return what the charts draw."""
        with self._lock:
            unit, scale = shown(self.quantity)
            rows, x, label = self._drawn, self._x, self._x_label
            spans = [(float(x[inside].min()), float(x[inside].max()))
                     for trial in np.unique(self._trial[~self._fitted])
                     for inside in [(self._trial == trial) & ~self._fitted]]
            return Curves(
                x[rows], label, f'{self.quantity} [{unit}]' if unit else self.quantity, unit,
                scale * self._measured[rows], scale * self._before[rows], scale * self._now[rows],
                self._trial[rows], spans)

    def fit(self) -> Extension:
        """
        Fit the effects that are ticked to the rows that are not unseen, as `extend` does.

        Returns
        -------
        Extension
            The sliders have its values, unless other effects were ticked meanwhile.

        Raises
        ------
        ParameterError
            If no effect is ticked.
        """
        with self._lock:
            names, train, test = self._for_extension()
            force = any(name in self._hidden for name in names)
            unseen, problem = self.unseen, self._problem
        found = extend(self.model, names, train, test, force=force)
        with self._lock:
            if names == list(self._effects):
                self._effects = {effect.id: effect for effect in found.added}
                self._simulate()
                if problem is self._problem and unseen == self.unseen:
                    self.extension = found
        return found

    def diagnose(self, progress: Progress | None = None) -> Diagnosis:
        """
        Find what the base model misses in the rows that are not unseen.

        Parameters
        ----------
        progress : callable, optional
            ``progress(items, total)`` returns the items.

        Returns
        -------
        Diagnosis
            It is that of the session unless others became unseen meanwhile.
        """
        from hysteresis_ros import api

        with self._lock:
            self._require_recording()
            train, unseen = self._train(), self.unseen
        found = api.diagnose(self.model, train, progress=progress)
        with self._lock:
            if [part.name for part in unseen] == [part.name for part in self.unseen]:
                self.diagnosis = found
            self.version += 1
        return found

    def save(self, name: str = MODEL_NAME) -> str:
        """
        Write the extended model and return its path.

        Parameters
        ----------
        name : str
            Of a file in the session's folder, ending in .yaml.

        Raises
        ------
        ParameterError
            If no effect is ticked, or the file is an input or cannot be written.
        """
        with self._lock:
            path = self._output(name, '.yaml')
            extension = self._extended()
        extension.model.save(path)
        with self._lock:
            if path in self.saved:
                self.saved.remove(path)
            self.saved.append(path)
            self.version += 1
        return path

    def report(self, name: str = REPORT_NAME) -> str:
        """
        Write the page of the command that shows the present state, and return its path.

        That is `extend` with effects ticked, `diagnose` after a diagnosis, else `compare`.

        Parameters
        ----------
        name : str
            Of a file in the session's folder, ending in .html.

        Raises
        ------
        ParameterError
            If the file is an input or cannot be written.
        """
        from hysteresis_ros.atomic import write_text
        from hysteresis_ros.comparison.compare import compare
        from hysteresis_ros.report.comparison_page import comparison_page, rendered
        from hysteresis_ros.report.diagnosis_page import write_diagnosis, write_extension
        from hysteresis_ros.report.plots import figures

        with self._lock:
            self._require_recording()
            path = self._output(name, '.html')
            self._reported = path
            origin = Origin(self.commands()[-1], self._reading)
            recordings, train, found = list(self.recordings), self._train(), self.diagnosis
            extension = self._extended() if self._effects else None
            test = select(recordings, self.unseen)
        if extension is not None:
            output = self.saved[-1] if self.saved else self._default_output()
            write_extension(path, self.model, extension, train, test, output, origin)
        elif found is not None:
            write_diagnosis(path, self.model, train, found, self.model_path, origin)
        else:
            comparison = compare(self.model, recordings)
            write_text(path, comparison_page(
                comparison, rendered(figures(comparison)), self.model_path, origin, recordings))
        with self._lock:
            self.version += 1
        return path

    def commands(self) -> list[str]:
        """Return the commands that repeat what is shown, in their order."""
        with self._lock:
            source = Source(self.model_path, [one.source for one in self.recordings],
                            self._reading)
            if not self.ready:
                return []
            if self._effects:
                found = [source.diagnose(self.parts, self.unseen)] if self.diagnosis else []
                force = any(name in self._hidden for name in self._effects)
                output = self.saved[-1] if self.saved else self._default_output()
                return [*found, source.extend(
                    self.effects, self.parts, self.unseen, output,
                    fitted=self.extension is not None, force=force, report=self._reported)]
            if self.diagnosis:
                return [source.diagnose(self.parts, self.unseen, self._reported)]
            return [source.compare(report=self._reported)]

    def _take(self, recordings: Sequence[Measurement]) -> None:
        """Prepare all that depends on the recordings alone."""
        recordings = list(recordings)
        check_alike(recordings)
        problem = problem_for(self.model, recordings)
        self._hidden = observable(problem)[1]
        self._problem: ArmProblem | BenchProblem = problem
        self.recordings = recordings
        self.parts = parts_of(recordings)
        # Bench tables are judged on the rows to which weights are refitted, others on all.
        rows = (problem.chosen if problem.refits
                else [np.arange(one.rows) for one in recordings])
        self._rows, self._exact = rows, problem.settled
        self._measured = self._pick([one.column(one.response) for one in recordings])
        sizes = np.cumsum([0] + [one.rows for one in recordings])
        chosen = np.concatenate([start + part for start, part in zip(sizes, rows)])
        self._trial = trial_numbers(recordings)[chosen]
        time = running_time(recordings)
        self._x, self._x_label = axis(None if time is None else time[chosen], len(chosen))

    def _divide(self) -> None:
        """Prepare what depends on which rows are fitted, too."""
        self._fitted = np.ones(len(self._measured), dtype=bool)
        for part in self.unseen:
            self._fitted &= ~rows_of(self.recordings, self._rows, part)
        self._before = self._predict(self.model.effects)
        self._drawn = extremes([self._measured, self._measured - self._before], self._trial,
                               MOST_DRAWN)
        self._simulate()

    def _simulate(self) -> None:
        """Predict the response with the effects as they are now."""
        self.version += 1
        if self.ready:
            self._now = (self._predict(self._all(self.effects)) if self._effects
                         else self._before)

    def _predict(self, effects: Sequence[Effect]) -> np.ndarray:
        if self._problem.refits:
            return self._problem.solve(effects, self._fitted).predicted
        return self._pick([simulator.run(effects, exact=self._exact)
                           for simulator in self._problem.simulators])

    def _pick(self, columns: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate([column[rows] for column, rows in zip(columns, self._rows)])

    def _all(self, effects: Sequence[Effect]) -> list[Effect]:
        """Return the model's effects with others added, which may replace some."""
        return [*base_of(self.model, map(type, effects)).effects, *effects]

    def _best_start(self, name: str) -> Effect:
        kind = effect_class(name)
        own = present(self.model, kind, self._problem.settled)
        starts = starts_of(own, self._problem.kind, self._measured[self._fitted], STARTS)
        if any(effect.id == name for effect in self.model.effects):
            starts.append(own)
        if self.diagnosis:
            starts += [own.with_values(**effect.values) for effect in self.diagnosis.effects
                       if effect.id == name]
            starts += [own.with_values(**{key: entry['value']
                                          for key, entry in row['parameters'].items()})
                       for row in self.diagnosis.ranking if row['effect'] == name]

        def error(effect: Effect) -> float:
            residual = self._predict(self._all([*self.effects, effect])) - self._measured
            size = float(np.mean(residual[self._fitted] ** 2))
            return size if np.isfinite(size) else np.inf
        return min(starts, key=error)

    def _require_recording(self) -> None:
        if not self.ready:
            raise ParameterError('there is no recording yet')

    def _train(self) -> list[Measurement]:
        return select(self.recordings, [part for part in self.parts if part not in self.unseen])

    def _for_extension(self) -> tuple[list[str], list[Measurement], list[Measurement]]:
        """Return the names of the effects, and what is fitted and what is not."""
        if not self._effects:
            raise ParameterError('no effect is ticked; tick one first')
        return list(self._effects), self._train(), select(self.recordings, self.unseen)

    def _extended(self) -> Extension:
        """Return the latest fit, or the effects with the values that were set by hand."""
        _, train, test = self._for_extension()
        return self.extension or extend_by_hand(self.model, self.effects, train, test)

    def _default_output(self) -> str:
        return os.path.join(self.folder, MODEL_NAME) if self.folder != '.' else MODEL_NAME

    def _output(self, name: str, suffix: str) -> str:
        """Return the path of a file in the folder; refuse one that is an input or elsewhere."""
        name = name.strip()
        if os.path.basename(name) != name or name.startswith('.') or not name.endswith(suffix) or (
                name == suffix):
            raise ParameterError(f'{name!r} is no name of a file that ends in {suffix}; the folder '
                                 'is that of the option --output')
        path = name if self.folder == '.' else os.path.join(self.folder, name)
        inputs = [Given('--model', self.model_path),
                  *(Given('--data', one.source) for one in self.recordings)]
        for given in inputs:
            refuse_input(Given('save', path), given)
        check_file(Given('save', path), set())
        return path
