# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects stay in the model of a bench whose rows do not determine all of them."""

import dataclasses

from model_support import bicep_model, effect_of
import pytest

from hysteresis_ros.diagnosis import bench_effects

FOUND = {'stress_dependence': {'C': 0.8}, 'series_compliance': {'compliance': 0.1},
         'phase_modulus': {'m': 0.5}}


@pytest.mark.parametrize('m, named', [
    # More than martensite is softer by, whatever else goes: it stands for something else.
    (0.5, {'stress_dependence', 'series_compliance'}),
    # Two stand for each other.
    (0.2, {'stress_dependence', 'phase_modulus'})])
def test_what_makes_another_effect_determined_goes_in_its_place(monkeypatch, m, named):
    model = bicep_model()
    asked = []

    def without(excluded, *_):
        asked.append(set(excluded))
        values = dict(FOUND)
        if 'series_compliance' in excluded:
            values['phase_modulus'] = {'m': m}
        effects = [effect_of(model, name, **one) for name, one in values.items()
                   if name not in excluded]
        error = {'phase_modulus': 2e-4, 'series_compliance': 1e-4}.get(
            next(iter(excluded), ''), 3e-4)
        return dataclasses.replace(
            model, metrics={'length': {'left_out': {'rmse': error}}}), effects

    monkeypatch.setattr(bench_effects, '_extended_without', without)
    monkeypatch.setattr(bench_effects, '_determined_without', lambda *_: True)
    added = bench_effects._determined(model, [], None)[1]
    assert {effect.id for effect in added} == named
    assert max(map(len, asked)) == 1
