# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What counts as evidence for an effect, and which sets are reported beside the one found."""

from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis_ros.diagnosis.candidates import hopeful
from hysteresis_ros.diagnosis.diagnose import most_unexplained
from hysteresis_ros.diagnosis.evidence import Evidence
from hysteresis_ros.diagnosis.extrapolation import promising
from hysteresis_ros.diagnosis.fit import Fit
from hysteresis_ros.diagnosis.search import Search

ROWS = 120
FOLD = np.arange(ROWS) % 4
BLOCK = np.arange(ROWS) // 5
MEASURED = np.sin(np.arange(ROWS))
CHANCE = np.random.default_rng(1)


def evidence(size=0.1):
    """Return the evidence of an arm run whose base model errs by `size` at random."""
    made = object.__new__(Evidence)
    made.problem = SimpleNamespace(
        measured=MEASURED, fold=FOLD, block=BLOCK, refits=False, noise=0.0)
    made.rng = np.random.default_rng(2)
    made.structure = size
    made.decoys = size * np.random.default_rng(3).standard_normal((100, ROWS))
    return made


def fit(error, columns=None, names=()):
    """Return a fit with this error in every row, of random sign."""
    signs = np.random.default_rng(4).choice((-1.0, 1.0), ROWS)
    predicted = MEASURED - error * signs
    columns = np.zeros((ROWS, 0)) if columns is None else columns
    return Fit([SimpleNamespace(id=name) for name in names], np.zeros(columns.shape[1]), predicted,
               columns, held_out=predicted)


def test_a_gain_counts_only_against_the_best_of_the_family():
    """Forty columns explain more of a decoy by chance than the one that was fitted."""
    column = CHANCE.standard_normal((ROWS, 1))
    base, better = fit(0.3), fit(0.295, column)
    alone, = evidence(0.3).p_values([better], base)
    # On held-out rows columns of noise do not explain; those that are in the decoys do.
    made = evidence(0.3)
    family = [np.sin(np.outer(np.arange(ROWS), [0.1])) for _ in range(3)]
    made.decoys = made.decoys + 0.5 * CHANCE.standard_normal((100, 1)) * family[0].T
    among, = made.p_values([better], base, family)
    assert alone < 0.05 < 0.5 < among


def test_what_acts_in_four_blocks_only_is_no_chance():
    """All four have the same random sign too often; but by chance they stand elsewhere."""
    inside = np.isin(BLOCK, np.unique(BLOCK)[[2, 8, 13, 19]])
    assert len(np.unique(FOLD[inside])) > 1
    column = inside * np.linspace(1.0, 2.0, ROWS)
    base, better = fit(0.0), fit(0.0, column[:, None])
    base.held_out = MEASURED - 0.05 * column
    value, = evidence(0.001).p_values([better], base)
    assert value < 0.02


def test_of_two_tests_of_chance_the_better_counts_twice():
    """Nothing of 400 draws is as good, by sign or by place; decoys are too many to matter."""
    made = evidence(1e-6)
    made.decoys = np.tile(made.decoys, (10, 1))
    value, = made.p_values([fit(0.0, CHANCE.standard_normal((ROWS, 1)))], fit(0.3))
    assert value == pytest.approx(2.0 / 401.0)


def test_an_effect_has_to_help_enough_and_in_most_blocks():
    """Five per cent of the error, and not in one place only."""
    base = fit(1.0)
    assert evidence().helps(fit(0.94), base) and not evidence().helps(fit(0.96), base)
    once = fit(1.0)
    once.held_out = np.where(BLOCK < 8, MEASURED, once.held_out)
    assert not evidence().helps(once, base)


@pytest.mark.parametrize('error, possible', [(0.1, True), (0.104, True), (0.5, False)])
def test_a_rival_that_is_hardly_worse_could_be_the_truth(error, possible):
    """Also where both predict so much the same that chance could not tell them apart either."""
    column = CHANCE.standard_normal((ROWS, 1))
    assert evidence().could_be(fit(error, column), fit(0.1, column)) == possible


def test_a_rival_that_fits_all_rows_as_well_could_be_the_truth():
    """It may foretell a held-out trial badly; one with more parameters has to be better there."""
    column = CHANCE.standard_normal((ROWS, 1))
    chosen, rival = fit(0.1, column), fit(0.09, column)
    rival.held_out = fit(0.19, column).held_out
    # So exact is the base model that chance explains nothing.
    assert evidence(1e-6).could_be(rival, chosen)
    rival.vector = np.zeros(2)
    assert not evidence(1e-6).could_be(rival, chosen)
    rival.vector, rival.predicted = np.zeros(1), fit(0.11).predicted
    assert not evidence(1e-6).could_be(rival, chosen)


def test_what_was_fitted_beside_the_others_is_not_fitted_again(monkeypatch):
    """Alternatives are among those, and among the most promising of the rest."""
    asked = []

    def consider_sets(fitter, sets, jobs, progress):
        asked.append([one[-1].id for one in sets])
        return []
    monkeypatch.setattr('hysteresis_ros.diagnosis.search.consider_sets', consider_sets)
    monkeypatch.setattr(Fit, 'implausible', lambda self: [])
    search = searching(fit(1.0))
    search.found = fit(0.1, names=('sag', 'rub'))
    search.rivals, search.jobs, search.progress = [], 1, None
    search.problem = SimpleNamespace(refits=True, settled=True)
    search.first = [SimpleNamespace(id=name, effect=SimpleNamespace(id=name))
                    for name in ('sag', 'rub', 'air', 'room', 'tilt')]
    search.extrapolation = SimpleNamespace(in_order=list)
    search._beside = {frozenset({'sag'}): [
        fit(0.102, names=('sag', 'air')), fit(0.5, names=('sag', 'room')),
        fit(0.1, names=('sag', 'rub'))]}
    assert search.alternatives() == [[], ['air']]
    assert asked == [['air', 'room', 'tilt'], ['tilt']]


def test_only_what_may_yet_be_among_the_best_is_fitted_to_the_end(monkeypatch):
    """Half as much again as the best is too much, and less than the floor is never too much."""
    search = searching(fit(1.0))
    errors = [0.5, 0.7, 0.8]
    begun = [fit(error) for error in errors]
    assert hopeful(search.fitter, begun, floor=0.1) == begun[:2]
    assert hopeful(search.fitter, begun, floor=0.6) == begun
    assert hopeful(search.fitter, [], floor=0.1) == []
    finished = []
    module = 'hysteresis_ros.diagnosis.search.'
    monkeypatch.setattr(module + 'try_sets', lambda fitter, sets, jobs, progress: begun)
    monkeypatch.setattr(module + 'finish_sets', lambda fitter, fits, *_: finished.extend(fits))
    search.problem, search.jobs, search.progress = SimpleNamespace(refits=False), 1, None
    search.found = fit(0.4)
    search._fitted([[], [], []])
    assert finished == begun[:1]


def test_what_has_nothing_to_say_about_what_is_left_is_not_looked_at():
    """An effect counts at its best start, beside the derivatives of what is known."""
    left, known = CHANCE.standard_normal((2, ROWS))
    changes = [[('none', CHANCE.standard_normal(ROWS)), ('zero', 0.0 * left)],
               [('bad', CHANCE.standard_normal(ROWS)), ('known', left + 0.5 * known),
                ('some', left + 0.5 * CHANCE.standard_normal(ROWS)), ('zero', 0.0 * left)],
               [('seen', known)]]
    limit = 0.9 * np.mean(left ** 2)
    looks = promising(changes, known[:, None], left, limit)
    assert len(looks) == 1 and looks[0][:2] == ['known', 'some'] and len(looks[0]) == 3
    assert len(promising(changes, known[:, None], left, 1.1 * np.mean(left ** 2))) == 3


def test_a_whole_set_that_could_be_the_truth_is_named_place_by_place():
    """An effect of it that is known already stays where it is; nothing is named twice."""
    search = object.__new__(Search)
    search.found = fit(0.1, names=('stress_dependence', 'coulomb_friction'))
    search.rivals = [
        fit(0.12, names=('supply_sag', 'pwm_dead_zone')), fit(9.0, names=('slack', 'creep')),
        fit(0.11, names=('airflow', 'coulomb_friction')), fit(0.13, names=('airflow', 'backlash'))]
    search.fitter = SimpleNamespace(error=lambda held: np.sqrt(np.mean((held - MEASURED) ** 2)))
    search.evidence = SimpleNamespace(could_be=lambda rival, found: search.error(rival) < 1.0)
    alternatives = [['latency'], []]
    search._add_rivals(alternatives)
    assert alternatives == [['latency', 'airflow', 'supply_sag'], ['pwm_dead_zone', 'backlash']]


def searching(base):
    """Return a search that has fitted nothing but `base`, an arm run's."""
    search = object.__new__(Search)
    search.base = base
    search.evidence = evidence()
    search.fitter = SimpleNamespace(error=lambda held: np.sqrt(np.mean((held - MEASURED) ** 2)))
    return search


def test_what_is_added_has_to_take_off_a_share_of_the_first_error():
    """Half of what the first effect has left is not much where that was little."""
    search = searching(fit(10.0))
    assert not search._matters(fit(0.20), fit(0.34))
    assert search._matters(fit(0.20), fit(0.36))


@pytest.mark.parametrize('base, left, goes_on', [
    (1.0, 0.15, False), (1.0, 0.17, True), (10.0, 0.24, False), (10.0, 0.26, True)])
def test_the_search_ends_where_what_is_left_could_not_matter(base, left, goes_on):
    """Above 1.6 times a floor of 0.1, and by 1.5 % of the first error above the floor."""
    search = searching(fit(base))
    search.evidence = SimpleNamespace(floor=0.1, enough=0.16)
    assert bool(search._leaves(fit(left))) == goes_on


@pytest.mark.parametrize('left, names, settled, pairs', [
    (0.99, ('sag',), False, False), (1.01, ('sag',), False, True),
    (0.99, ('sag', 'rub'), False, True), (0.99, ('sag',), True, True)])
def test_pairs_are_not_tried_beside_one_effect_that_explains_nine_tenths(
        monkeypatch, left, names, settled, pairs):
    """In a continuous run it does not stand in for two others; two that leave as little may."""
    monkeypatch.setattr(Fit, 'implausible', lambda self: [])
    search = searching(fit(10.0))
    found = fit(left, names=names)
    search.problem = SimpleNamespace(settled=settled)
    search._seeds = lambda: [SimpleNamespace(fit=found)]
    search._grow = lambda seed: seed
    search._pairs = lambda sets: ['a pair']
    assert search._on_arm() == [found, *(['a pair'] if pairs else [])]


@pytest.mark.parametrize('contained, first', [('wide', 'narrow'), ('other', 'wide')])
def test_an_effect_gives_way_to_one_that_it_contains_while_the_rest_may_be_chance(contained, first):
    """Not to one that has nothing to do with it, which is clearly worse."""
    def candidate(name, error, count, replaces=()):
        made = fit(error, CHANCE.standard_normal((ROWS, count)))
        return SimpleNamespace(id=name, fit=made, rmse=error,
                               effect=SimpleNamespace(replaces=replaces))
    search = searching(fit(1.0))
    # So large is what the base model errs by itself that a gain like this one is chance.
    search.evidence = evidence(5.0)
    replaces = ('narrow',) if contained == 'wide' else ()
    wide, narrow = candidate('wide', 0.10, 2, replaces), candidate('narrow', 0.11, 1)
    chosen, = search._simplest([wide, narrow])
    assert chosen.id == first
    search.evidence = evidence(1e-6)
    chosen, = search._simplest([wide, narrow])
    assert chosen.id == 'wide'


def test_more_effects_have_to_explain_more():
    """Two may leave half as much as one; with none found there is one cause to find."""
    assert most_unexplained('arm', 2) == 0.5 * most_unexplained('arm', 1)
    assert most_unexplained('arm', 0) == most_unexplained('arm', 1)


@pytest.mark.parametrize('left, names, better', [
    (0.5, ('stop',), True), (0.7, ('stop',), False), (0.5, ('stop', 'sag', 'air'), False)])
def test_values_that_are_not_physical_but_explain_far_more_show_an_unknown(
        monkeypatch, left, names, better):
    """As long as it takes no more effects than were found, and what was found leaves much."""
    monkeypatch.setattr(Fit, 'implausible', lambda self: ['stop.stiffness'])
    search = searching(fit(10.0))
    search.found, search.strange = fit(1.0, names=('sag', 'rub')), []
    one = fit(left, names=names)
    search.first = [SimpleNamespace(fit=one), SimpleNamespace(fit=fit(0.9, names=('air',)))]
    assert (search.stand_in() is one) == better
    search.first, search.strange = [], [one]
    assert (search.stand_in() is one) == better
    search.evidence = SimpleNamespace(enough=1.1)
    assert search.stand_in() is None


@pytest.mark.parametrize('left, expected', [(0.5, 'two'), (0.12, 'sound')])
def test_what_stood_in_for_the_newest_effect_gives_way_to_it(monkeypatch, left, expected):
    """With three effects one is not physical but all is explained: two of them are the cause."""
    monkeypatch.setattr(Fit, 'implausible', lambda self: self.effects[0].id == 'odd')
    search = searching(fit(1.0))
    search.evidence = SimpleNamespace(floor=0.1, enough=0.16)
    odd, sound = fit(0.11, names=('odd', 'rub', 'tilt')), fit(left, names=('sag', 'rub', 'air'))
    two = fit(0.11, names=('rub', 'tilt'))
    search.consider = lambda *_: [SimpleNamespace(fit=odd), SimpleNamespace(fit=sound)]
    search._worth_another_look = search._significant = search._matters = lambda *_: True
    search._simplest = lambda rivals: rivals[:1]
    search.refit = lambda effects: sound
    search._without_needless = lambda found: two if found is odd else found
    assert search._grow(fit(0.8, names=('sag', 'rub'))) is {'two': two, 'sound': sound}[expected]
