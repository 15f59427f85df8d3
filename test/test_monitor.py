# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of a running arm, with injected time and without a process."""

import dataclasses
import datetime

from node_support import small_model
import numpy as np
import pytest

from hysteresis_ros.background import Outcome
from hysteresis_ros.diagnosis.band import error_band
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.monitor import Monitor
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.measurements import read_measurement

NOW = datetime.datetime(2026, 1, 2, 3, 4, 5, tzinfo=datetime.timezone.utc)


class Here:
    """What computes for the monitor, at once and here, unless an outcome is given."""

    def __init__(self, *outcomes):
        self.outcomes = list(outcomes)
        self.tasks = []
        self.busy = False

    def start(self, function, *args):
        """Take a task."""
        self.tasks.append((function, args))
        self.busy = True

    def poll(self):
        """Return what was given for it, else what it gives."""
        if not self.busy:
            return None
        self.busy = False
        function, args = self.tasks[-1]
        if self.outcomes:
            return self.outcomes.pop(0)
        return Outcome(function(*args), '', 1.0)

    def stop(self):
        """Forget the task."""
        self.busy = False


BAND = Outcome(0.01, '', 1.0)


class Arm:
    """Holds of an arm that is some angle off its model, with a monitor beside it."""

    def __init__(self, *outcomes, model=None, **changed):
        self.here = Here(*outcomes)
        self.model = model or small_model()
        values = {'window': 1800.0, 'settled': 20.0, 'share': 1.0, 'now': 0.0, **changed}
        self.monitor = Monitor(self.model, background=self.here, **values)
        self.observer = self.model.observer()
        self.time = 0.0

    def hold(self, voltages, off=0.0, start=0.0):
        """Hold voltages for 30 s each; what is computed comes at the end of each."""
        for voltage in [start, *voltages] if self.time == 0.0 else voltages:
            for _ in range(6):
                predicted = self.observer.step(self.time, voltage)
                self.monitor.add(self.time, voltage, predicted + off, predicted, 22.0)
                self.time += 5.0
            self.monitor.look(self.time)
            self.monitor.look(self.time)


def drives(count, seed=1):
    """Return random voltages, no two of them alike."""
    return np.random.default_rng(seed).uniform(2.0, 6.0, count).tolist()


def found(name='missing', effects=()):
    """Return a true diagnosis with another verdict, for speed."""
    return dataclasses.replace(TEMPLATE, verdict=name, missing=[one.id for one in effects],
                               effects=list(effects), alternatives=[[] for _ in effects],
                               sets=[{'effects': sorted(one.id for one in effects) or ['unknown'],
                                      'probability': 0.97, 'rmse': 0.01}], event=None)


@pytest.fixture(scope='module', autouse=True)
def template():
    """Make one diagnosis for all: the arm's encoder was set to zero at a wrong angle."""
    global TEMPLATE
    arm = Arm(BAND)
    arm.hold(drives(13), 0.1)
    TEMPLATE = next(
        diagnose(*args) for function, args in arm.here.tasks if function is diagnose)


def test_an_arm_off_its_model_is_named():
    """After eight holds the first diagnosis, and the name when twelve agree."""
    effect, = TEMPLATE.effects
    arm = Arm(BAND, *[Outcome(found('missing', [effect]), '', 1.0)] * 9)
    arm.hold(drives(5))
    assert arm.monitor.sentence == '' and arm.monitor.values(1.0)['residual'] == 'in the band'
    arm.hold(drives(12, 2), 0.1)
    assert arm.monitor.sentence == ''
    arm.hold(drives(1, 3), 0.1)
    assert 'the model lacks encoder_offset (offset ' in arm.monitor.sentence
    assert 'probability 0.97, by 12 holds' in arm.monitor.sentence
    assert '`hysteresis extend --add encoder_offset`' in arm.monitor.sentence
    values = arm.monitor.values(arm.time)
    assert values['missing effect'] == 'encoder_offset' and values['probability'] == 0.97
    assert values['encoder_offset offset [deg]'] == pytest.approx(5.7, abs=1.0)
    assert values['error band [rad]'] == 0.01 and values['residual'] == 'out of the band'
    assert values['cannot be told from'] == 'none' and values['diagnoses'] == 3


def test_the_template_is_what_the_arm_has():
    """The diagnosis of the samples themselves names what is wrong with them."""
    assert TEMPLATE.missing == ['encoder_offset']
    assert TEMPLATE.effects[0].offset == pytest.approx(np.degrees(0.1), rel=0.1)


def test_something_unknown_is_said_too():
    """Without the name of an effect."""
    arm = Arm(BAND, *[Outcome(found('unknown'), '', 1.0)] * 9)
    arm.hold(drives(14), 0.1)
    assert 'no effect of the catalogue explains it' in arm.monitor.sentence
    assert arm.monitor.values(0.0)['missing effect'] == 'unknown'


def test_a_diagnosis_that_fails_is_told_and_the_next_one_made():
    """The monitor goes on."""
    effect, = TEMPLATE.effects
    good = Outcome(found('missing', [effect]), '', 1.0)
    arm = Arm(BAND, Outcome(None, 'the process that computed has died', 1.0), *[good] * 9)
    arm.hold(drives(8), 0.1)
    assert arm.monitor.problem == 'no diagnosis: diagnosis: the process that computed has died'
    arm.hold(drives(12, 2), 0.1)
    assert arm.monitor.problem == '' and 'encoder_offset' in arm.monitor.sentence


def test_a_band_that_cannot_be_computed_is_told():
    """Whoever asks hears why there is no diagnosis."""
    arm = Arm(Outcome(None, 'the model has no arm', 1.0))
    arm.hold(drives(4), 0.1)
    assert arm.monitor.problem == 'no diagnosis: band: the model has no arm'
    answers = []
    arm.monitor.ask(lambda *answer: answers.append(answer))
    assert answers == [(False, arm.monitor.problem)]


def test_the_budget_is_kept():
    """A core is not taken for long; what is due comes later."""
    costly = Outcome(found('unknown'), '', 20.0)
    arm = Arm(BAND, *[costly] * 40, share=0.05)
    arm.hold(drives(40), 0.1)
    assert 1 < arm.monitor.diagnoses <= (0.05 * (300.0 + arm.time)) / 20.0 + 2
    assert arm.monitor.values(arm.time)['share of a core'] < 0.1


def test_who_asks_is_answered():
    """At once where there is nothing to diagnose, else with the verdict, out of the band or not."""
    answers = []
    arm = Arm(BAND, Outcome(found('adequate'), '', 1.0))
    arm.monitor.ask(lambda *answer: answers.append(answer))
    arm.hold(drives(4))
    arm.monitor.ask(lambda *answer: answers.append(answer))
    arm.monitor.look(arm.time)
    assert [success for success, _ in answers] == [False, False]
    assert 'no hold of the arm has ended yet' in answers[0][1]
    assert '4 holds of the arm have ended so far; a diagnosis needs 8' in answers[1][1]
    arm.hold(drives(8, 2))
    arm.monitor.ask(lambda *answer: answers.append(answer))
    arm.monitor.look(arm.time)
    arm.monitor.look(arm.time)
    assert answers[2][0] and answers[2][1].startswith('adequate: ')


def test_a_reset_outdates_what_is_being_diagnosed():
    """The muscle that the answer is about is no more."""
    arm = Arm(BAND)
    arm.hold(drives(9))
    answers = []
    arm.monitor.ask(lambda *answer: answers.append(answer))
    arm.monitor.look(arm.time)
    assert arm.here.busy
    arm.monitor.begin()
    arm.here.outcomes.append(Outcome(found('missing', TEMPLATE.effects), '', 1.0))
    arm.monitor.look(arm.time)
    assert answers == [(False, 'the prediction was started again meanwhile')]
    assert arm.monitor.diagnoses == 0 and arm.monitor.values(0.0)['settled holds'] == 0


@pytest.mark.slow
def test_the_recording_gives_the_same_answer(tmp_path):
    """Its history leads the model to where the arm was; what the monitor judges is judged."""
    arm = Arm(BAND, *[Outcome(found('unknown'), '', 1.0)] * 60)
    with pytest.raises(HysteresisError, match='no hold of the arm has ended yet'):
        arm.monitor.save(str(tmp_path), NOW)
    arm.hold(drives(12))
    # Of 24 rows a constant could be a drift, too (p = 0.06).
    arm.hold(drives(40, 2), 0.15)
    path = arm.monitor.save(str(tmp_path / 'new'), NOW)
    assert path == tmp_path / 'new' / 'arm_20260102T030405_000000.csv'
    measurement = read_measurement(path)
    assert measurement.settled and measurement.trials.tolist() == [0.0]
    history = measurement.columns['history']
    assert 0 < history.sum() < 12 and (history == 0.0).sum() == 39
    again = diagnose(arm.model, [measurement])
    assert again.missing == ['encoder_offset']
    assert again.rmse_before == pytest.approx(0.15, rel=1e-3)
    # Had the history been judged, the offset would be one that came in between.
    whole = {name: column for name, column in measurement.columns.items() if name != 'history'}
    assert diagnose(arm.model, [type(measurement).from_columns(whole)]).rmse_before < 0.145


def test_recording_is_saved_in_the_home_of_ros(tmp_path, monkeypatch):
    """Where nobody says otherwise; what cannot be written is an OSError."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    arm = Arm(BAND)
    arm.hold(drives(3))
    assert arm.monitor.save('', NOW).parent == tmp_path / 'hysteresis_ros'
    (tmp_path / 'file').write_text('')
    with pytest.raises(OSError):
        arm.monitor.save(str(tmp_path / 'file'), NOW)


def test_an_arm_that_was_driven_before_is_not_judged():
    """Its memory is not known; the first cold hold begins it."""
    arm = Arm(BAND)
    arm.hold(drives(10), 0.3, start=3.0)
    assert arm.monitor.values(0.0)['settled holds'] == 0 and arm.monitor.diagnoses == 0
    with pytest.raises(HysteresisError, match='not known what the muscle remembers'):
        arm.monitor.save('', NOW)
    arm.hold([0.0, 3.0, 4.0])
    assert arm.monitor.values(0.0)['settled holds'] == 2


def test_the_band_is_that_of_the_bench():
    """Of a model without errors it is the least that there is; it grows with them."""
    perfect, worse = small_model(), small_model()
    metrics = {'length': {'verification': {'rmse': 3e-4}}}
    worse = dataclasses.replace(worse, metrics=metrics)
    twice = dataclasses.replace(worse, metrics={'length': {'verification': {'rmse': 6e-4}}})
    bands = [error_band(model) for model in (perfect, worse, twice)]
    assert bands[0] < bands[1] < bands[2] < 0.2
