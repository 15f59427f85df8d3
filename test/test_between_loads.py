# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What every loaded muscle has, where loads beyond the others speak against it."""

import dataclasses

import numpy as np
import pytest

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis import bench_effects, bench_problem
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.between_loads import best_between_loads
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.effects import catalogue
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.measurements.table import Measurement

SPECIMEN = 1
PRACTICAL = 0.05


@pytest.fixture(scope='module')
def tables():
    """Return the tables of a bench of four loads."""
    found = bench_tables({}, SPECIMEN, 'grains')
    return [Measurement.from_columns(found[f'{name}.csv']) for name in ('length', 'force')]


@pytest.fixture(scope='module')
def model(tables):
    """Return its model without effects."""
    return identify(*tables, length_trials=range(4), force_trials=[0],
                    geometry=BicepGeometry.from_mapping(GEOMETRY)).model


@pytest.fixture(scope='module')
def fitter(model, tables):
    """Return a fitter of its lengths."""
    return BenchFitter(problem_for(model, [tables[0].select(range(4))]).finer())


@pytest.fixture(scope='module')
def effects(model):
    """Return what every loaded muscle has."""
    return usual([kind(model.surroundings) for kind in catalogue().values() if kind.universal],
                 'bench')


class Blind(BenchFitter):
    """One that predicts the lightest and the heaviest load as badly as can be."""

    def apart(self):
        """Return the same."""
        return Blind(self.problem.apart())

    def cross_validate(self, fit):
        """Return a fit that says nothing of the loads at the ends."""
        found = super().cross_validate(fit)
        load = self.problem.signals['load']
        ends = (load == load.min()) | (load == load.max())
        return dataclasses.replace(found, held_out=np.where(ends, 1.0, found.held_out))


def test_loads_at_the_ends_are_not_extrapolated_to(fitter, effects):
    """What is found is the same however badly they are predicted from the others."""
    found = best_between_loads(fitter, effects, PRACTICAL)
    assert {'stress_dependence', 'stress_dependent_strain'} <= {one.id for one in found}
    blind = best_between_loads(Blind(fitter.problem), effects, PRACTICAL)
    assert [one.to_dict() for one in blind] == [one.to_dict() for one in found]


def test_what_is_found_has_to_matter(fitter, effects, monkeypatch):
    assert best_between_loads(fitter, effects, 0.95) == []
    monkeypatch.setattr(bench_problem, 'SMALL_ERROR', 1.0)
    assert best_between_loads(fitter, effects, PRACTICAL) == []


def test_the_rows_fitted_must_not_be_worse():
    """A load shifts a polymer's length a little between loads, and is far off under each."""
    found = bench_tables({}, SPECIMEN, 'scp')
    length, force = (Measurement.from_columns(found[f'{name}.csv']) for name in (
        'length', 'force'))
    polymer = identify(length, force, length_trials=range(4), force_trials=[0]).model
    fitter = BenchFitter(problem_for(polymer, [length.select(range(4))]).finer())
    effects = usual([catalogue()['stress_dependence'](polymer.surroundings)], 'bench')
    assert best_between_loads(fitter, effects, PRACTICAL) == []


def test_sets_have_the_simplest_forms(fitter, effects, monkeypatch):
    """A form that fitted rows prefer may predict a load that they do not have far worse."""
    seen = []
    fit = BenchFitter.fit
    monkeypatch.setattr(BenchFitter, 'fit', lambda self, some, *args, **options: (
        seen.append(list(some)), fit(self, some, *args, **options))[1])
    assert any(one.values.get('follows', 0.0) > 0.0 for one in effects)
    best_between_loads(fitter, effects, PRACTICAL)
    assert len(seen) == 2 ** len(effects)
    assert all(one.values.get('follows', 0.0) == 0.0 for some in seen for one in some)


@pytest.mark.long
def test_a_bench_that_proves_nothing_has_them(model, tables, monkeypatch):
    """And with them predicts the trials that were not fitted better."""
    nothing = dataclasses.make_dataclass('Nothing', [('effects', list)])([])
    monkeypatch.setattr(bench_effects, 'diagnose', lambda *args, **options: nothing)
    length, force = tables
    extended, added = bench_effects.add_effects(model, length, force, length_trials=range(4),
                                                force_trials=[0])
    assert {'stress_dependence', 'stress_dependent_strain'} <= {one.id for one in added}
    before, after = (one.metrics['length']['verification']['rmse'] for one in (model, extended))
    assert after < 0.5 * before
