# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which holds of a running arm are diagnosed, and when an effect counts as found."""

import dataclasses
import math

import numpy as np
import pytest

from hysteresis_ros.diagnosis.watch import left_the_band, remembered, Watch
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements.live_holds import Hold, HoldDetector
from hysteresis_ros.operators import Preisach


def hold(number, off=0.0, voltage=3.0, angle=2.0, **changed):
    """Return the end of a hold; the arm is `off` the prediction."""
    made = Hold(30.0 * number, voltage, angle, angle - off, 22.0, angle, angle, voltage, voltage)
    return made._replace(**changed)


@dataclasses.dataclass
class Found:
    """What the watch looks at of a diagnosis."""

    verdict: str = 'missing'
    missing: tuple = ('slack',)
    alternatives: tuple = ((),)
    event: float = None
    rmse_before: float = 0.1

    @property
    def sets(self):
        """All on what is missing."""
        return [{'effects': list(self.missing) or ['unknown'], 'probability': 0.9}]


def watched(offs, **options):
    """Return a watch with a band of 0.01 rad that has seen arms off by so much."""
    watch = Watch(0.01, **options)
    for number, off in enumerate(offs, 1):
        watch.add(hold(number, off))
    return watch


def test_a_hold_ends_when_the_drive_moves():
    """The mean of its last second; noise within the tolerance is no move."""
    detector = HoldDetector(0.006)
    samples = [(0.1 * n, 3.0 + 0.002 * (n % 2), 2.0 if n < 290 else 1.5) for n in range(300)]
    assert [detector.add(*sample) for sample in samples] == [None] * 300
    found = detector.add(30.0, 4.0, 1.4)
    assert found.time == pytest.approx(29.9) and found.voltage == pytest.approx(3.001, abs=1e-3)
    assert found.angle == pytest.approx((2.0 + 10 * 1.5) / 11)
    assert (found.lowest, found.highest) == (1.5, 2.0)


def test_a_short_hold_is_none_and_the_way_is_kept():
    """What happened between two holds is told with the second."""
    detector = HoldDetector(0.006)
    found = []
    for begin, voltage, angle in ((0, 3.0, 2.0), (25, 5.0, 1.5), (35, 3.5, 1.9), (60, 0.0, 2.3)):
        found += [detector.add(begin + t, voltage, angle) for t in range(25 if begin != 25 else 10)]
    first, second = filter(None, found)
    assert (first.time, second.time) == (24, 59)
    assert (second.least, second.most, second.lowest, second.highest) == (3.0, 5.0, 1.5, 2.0)


def test_the_change_of_size_is_found_behind_an_outlier():
    """One large error long before is no change, and neither is noise."""
    rng = np.random.default_rng(1)
    quiet = rng.standard_normal(40)
    assert left_the_band(quiet)[0] < math.log(100.0)
    quiet[30] = 5.0
    evidence, first = left_the_band(np.concatenate((quiet, 20.0 + rng.standard_normal(8))))
    assert evidence > math.log(100.0) and first == 40


def test_holds_since_the_residual_left_the_band_are_judged():
    """The others are history, of which what the muscle remembers is kept."""
    watch = Watch(0.01)
    drives = [2.0, 5.0, 3.0, 4.0, 3.5, 4.5]
    for number, voltage in enumerate(drives, 1):
        watch.add(hold(number, 0.001, voltage))
    for number in range(7, 15):
        assert not watch.due
        watch.add(hold(number, 0.1, 4.2))
    assert watch.due
    rows = watch.measurement().columns
    # 4.5 V has wiped 4 and 3.5 V; 2 V were passed on the way up.
    assert rows['voltage'][rows['history'] == 1.0].tolist() == [5.0, 3.0, 4.5]
    assert rows['time'][rows['history'] == 0.0].tolist() == [30.0 * n for n in range(7, 15)]
    np.testing.assert_array_equal(rows['before_onset'], rows['history'])


def test_what_began_acts_in_those_of_its_holds_that_are_old_by_now():
    """They are history, but do not lie before the onset; of an arm in its band nothing does."""
    watch = Watch(0.01, 600.0)
    drives = [5.5, 1.5, *np.random.default_rng(3).uniform(2.0, 5.0, 58).tolist()]
    for number, voltage in enumerate(drives[:10], 1):
        watch.add(hold(number, 0.001, voltage))
    assert 'before_onset' not in watch.measurement().columns
    for number, voltage in enumerate(drives[10:], 11):
        watch.add(hold(number, 0.1, voltage))
    rows = watch.measurement().columns
    assert rows['time'][rows['history'] == 0.0].min() > 900.0
    np.testing.assert_array_equal(rows['before_onset'], rows['time'] <= 300.0)
    old = rows['history'] > rows['before_onset']
    assert old.any() and rows['before_onset'].any() and rows['time'][old].min() > 300.0


def test_what_is_remembered_leads_an_operator_to_the_same_state():
    """The shortened history and the whole give the same outputs afterwards."""
    rng = np.random.default_rng(2)
    operator = Preisach(np.linspace(0.0, 6.0, 13), rng.uniform(0.0, 1.0, 78), 0.0)
    for _ in range(20):
        drive = np.round(rng.uniform(0.0, 6.0, 40), 1)
        kept = [one.voltage for one in remembered(
            [hold(n, voltage=v) for n, v in enumerate(drive.tolist())])]
        assert len(kept) < 20
        after = rng.uniform(0.0, 6.0, 10)
        outputs = []
        for before in (drive, np.array(kept)):
            operator.reset()
            outputs.append(operator.simulate(np.concatenate((before, after)))[-10:])
        assert outputs[0] == pytest.approx(outputs[1], abs=1e-12)


def test_diagnoses_have_to_agree_while_holds_come():
    """One alone names nothing, nor do two on nearly the same holds; another name begins anew."""
    watch = watched([0.001] * 20 + [0.1] * 8)
    named = []
    for number, name in enumerate(['backlash', 'airflow', 'airflow', 'slack', 'airflow'], 29):
        assert watch.due
        watch.begun()
        assert not watch.due
        watch.answer(Found(missing=(name,), alternatives=(
            ('airflow', 'clamp_mass') if name == 'slack' else (),)))
        named.append(watch.finding and watch.finding.effects)
        watch.add(hold(2 * number - 29, 0.1))
        assert not watch.due
        watch.add(hold(2 * number - 28, 0.1))
    assert named == [None, None, None, None, ('airflow',)]
    assert watch.finding.holds == 16 and watch.finding.probability == pytest.approx(0.9)
    watch = watched([0.1] * 8)
    for count in (8, 10, 12):
        assert watch.finding is None
        watch.begun()
        watch.answer(Found(alternatives=(('backlash',),)))
        for number in (1, 2):
            watch.add(hold(count + number, 0.1))
    assert watch.finding.effects == ('slack',) and watch.finding.others == ('backlash',)
    assert watch.finding.holds == 12


def test_an_answer_that_agrees_delays_none():
    """It was on more holds, before the residual was seen to have left the band later."""
    named = {}
    for first in ('airflow', 'slack'):
        watch = watched([0.001] * 20 + [0.03] * 11)
        for count, numbers, name in ((11, (), first), (9, range(32, 41), 'airflow'),
                                     (15, range(41, 47), 'airflow')):
            for number in numbers:
                watch.add(hold(number, 0.5))
            assert watch.measurement().columns['history'].tolist().count(0.0) == count
            watch.begun()
            watch.answer(Found(missing=(name,)))
        named[first] = watch.finding.effects
    assert named == {'airflow': ('airflow',), 'slack': ('airflow',)}


def test_what_shows_in_some_holds_only_has_left_the_band_since_the_first():
    """As an end stop does; two that are a little off may be chance."""
    offs = [0.0] * 20 + [0.05, 0.08, 0.05, *[0.0] * 7, 0.08, 0.08, 0.08, 0.05, 0.0, 0.0]
    watch = watched(offs)
    assert watch.due
    assert list(watch.measurement().columns['history']).count(0.0) == 16
    assert not watched([*[0.0] * 20, 0.02, *[0.0] * 7, 0.02]).out_of_band


def test_wires_of_another_batch_are_not_diagnosed():
    """One and a half bands off is out of the band, but not clearly."""
    watch = watched([0.015] * 60)
    assert watch.out_of_band and not watch.due
    assert watched([0.021] * 60).due


def test_a_clean_arm_is_never_due():
    """Nothing to do within the band, however long."""
    rng = np.random.default_rng(3)
    watch = Watch(0.01)
    for number in range(1, 800):
        watch.add(hold(number, 0.007 * rng.standard_normal()))
        assert not watch.due and not watch.out_of_band
    assert watch.count <= 400


def answered(watch, found, holds):
    """Let a watch see more holds that are off, and answer each diagnosis so."""
    for number in range(holds):
        watch.add(hold(number + 1, 0.1))
        if watch.due:
            watch.begun()
            watch.answer(found)


def test_an_arm_that_was_mended_is_in_the_band_again():
    """The finding goes after fifteen good holds."""
    watch = Watch(0.01)
    answered(watch, Found(), 12)
    assert watch.finding is not None
    for number in range(13, 28):
        watch.add(hold(number, 0.001))
    assert watch.finding is None and not watch.out_of_band and not watch.due


def test_a_moment_that_the_diagnosis_finds_begins_the_window():
    """What happened once is judged from then on."""
    watch = watched([0.1] * 20)
    watch.begun()
    watch.answer(Found('unknown', (), (), event=300.0))
    assert watch.measurement().columns['time'].tolist()[-11:] == [30.0 * n for n in range(10, 21)]
    assert watch.due


def test_what_no_effect_explains_is_found_too():
    """Without a name; a diagnosis that finds nothing takes it back."""
    watch = Watch(0.01)
    answered(watch, Found('unknown', (), ()), 12)
    assert watch.finding.effects == () and watch.finding.probability == pytest.approx(0.9)


def test_an_excursion_that_nobody_measured_is_not_judged():
    """Until a settled state lies beyond it; a spike that moved no arm counts for nothing."""
    watch = Watch(0.01)
    watch.add(hold(1, voltage=3.0, angle=2.0))
    watch.add(hold(2, voltage=3.5, angle=1.9, lowest=1.9, highest=2.0, least=3.0, most=6.0))
    assert watch.measurement().columns['history'].tolist() == [0.0, 0.0]
    watch.add(hold(3, voltage=3.5, angle=1.9, lowest=1.5, highest=1.9, least=3.5, most=6.0))
    watch.add(hold(4, voltage=4.0, angle=1.8, lowest=1.8, highest=1.9, least=3.5, most=4.0))
    watch.add(hold(5, voltage=5.0, angle=1.5, lowest=1.5, highest=1.8, least=4.0, most=5.0))
    assert watch.measurement().columns['history'].tolist() == [0.0, 0.0, 1.0, 1.0, 0.0]


def test_an_arm_that_was_driven_before_is_watched_from_the_first_cold_hold():
    """Nobody knows what it remembers until then."""
    watch = Watch(0.01)
    watch.begin(known=False)
    watch.add(hold(1, 0.3, 4.0))
    with pytest.raises(MeasurementError, match='not known what the muscle remembers'):
        watch.measurement()
    watch.add(hold(2, 0.0, 0.0))
    watch.add(hold(3, 0.0, 4.0))
    assert watch.measurement().columns['time'].tolist() == [60.0, 90.0]


def test_the_window_is_limited_in_time():
    """What is older is history; twenty holds stay, however long they last."""
    assert watched([0.0] * 100, window=1500.0).count == 51
    assert watched([0.0] * 100, window=60.0).count == 20
