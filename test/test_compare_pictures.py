# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures and the page of a comparison."""

import base64
import io
import re
from types import SimpleNamespace

from hypothesis import given, strategies
from hysteresis_ros.cli.compare import PICTURES
from hysteresis_ros.report import page
from hysteresis_ros.comparison.compare import compare
from hysteresis_ros.report.comparison_page import comparison_page, rendered, trials
from hysteresis_ros.report.drawing import new_figure, png, thinned
from hysteresis_ros.report.plots import along, figures
from hysteresis_ros.measurements import Measurement
import numpy as np
import pytest
from test_compare import FakeModel, METRES, run

matplotlib = pytest.importorskip('matplotlib')
pytest.importorskip('matplotlib.image')


@pytest.fixture(scope='module')
def comparison():
    """Return a comparison of a continuous run with ambient temperature."""
    rows = 20 * 60 * 5
    return compare(FakeModel(), [run(lambda t, v, up: 0.03 * (v > 4), extra={
        'ambient_temperature': np.linspace(20, 25, rows)})])


def test_every_picture_of_a_continuous_run(comparison):
    drawn = figures(comparison)
    assert set(drawn) == {'overlay', 'signals', 'loop', 'correlogram', 'coverage'}
    for name, data in rendered(drawn).items():
        image = matplotlib.image.imread(io.BytesIO(data), format='png')
        assert image.shape[1] > 300 and image[..., :3].std() > 0.02, name


def test_overlay_shows_measured_predicted_and_residual_in_degrees(comparison):
    axes = figures(comparison)['overlay'].axes
    labels = [line.get_label() for line in axes[0].lines]
    assert {'measured', 'two-stage', 'linear'} <= set(labels)
    assert axes[0].get_ylabel() == 'angle [deg]'
    line = axes[0].lines[labels.index('measured')]
    assert np.nanmax(line.get_ydata()) == pytest.approx(np.rad2deg(comparison.measured.max()))
    grey = sorted(np.dot(matplotlib.colors.to_rgb(line.get_color()), [0.3, 0.59, 0.11])
                  for line in axes[0].lines[:3])
    assert np.all(np.diff(grey) > 0.15)


def test_a_bench_table_has_its_plane(comparison):
    drive = np.tile(np.linspace(0, 6, 20), 3)
    table = Measurement.from_columns({
        'voltage': drive, 'length': 2 - 0.1 * drive, 'force': np.repeat([1.0, 2, 3], 20)},
        origin=METRES)
    drawn = figures(compare(FakeModel(linear=None), [table]))
    assert 'plane' in drawn and 'since_step' not in drawn
    assert drawn['plane'].axes[0].get_ylabel() == 'force [N]'
    assert png(drawn['overlay']).startswith(b'\x89PNG')


def stepped(trials=1):
    """Return a run of held voltages whose response lags, on the bicep."""
    time = np.arange(0, 600 * trials, 0.5)
    levels = np.random.default_rng(4).uniform(0, 6, 20 * trials)
    step = (time / 30).astype(int)
    lag = np.exp(-(time - 30 * step) / 4) * np.diff(levels, prepend=0)[step]
    trial = (time / 600).astype(int)
    return Measurement.from_columns({
        'time': time - 600 * trial, 'trial': trial, 'voltage': levels[step],
        'angle': 2 - 0.1 * (levels[step] - lag)})


def test_a_lag_shows_against_the_time_since_a_step(comparison):
    geometry = SimpleNamespace(force=lambda theta: 5 - theta, angle_range=(0.5, 2.5))
    model = FakeModel(geometry=geometry)
    drawn = figures(compare(model, [stepped()]))
    assert {'since_step', 'plane'} <= set(drawn) <= set(PICTURES)
    axis = drawn['since_step'].axes[0]
    assert axis.get_xscale() == 'log'
    rise, fall = (container.lines[0].get_ydata() for container in axis.containers)
    assert rise[0] > 1.0 and fall[0] < -1.0
    assert abs(rise[-1]) < 0.1 * rise[0]
    assert drawn['plane'].axes[0].get_ylabel() == 'force [N]'


def test_many_trials_are_listed_worst_first():
    found = compare(FakeModel(), [stepped(trials=3)])
    html = comparison_page(found, {}, 'm.yaml')
    assert 'The 2 worst of 3 trials.' in ''.join(trials(found, most=2))
    assert len(re.findall('<td data-label="file">memory</td>', html)) == 3
    assert len(figures(found)['overlay'].axes[0].lines) == 5


def test_the_waterfall_shows_every_step_of_an_extension(comparison):
    model = FakeModel(effects=[SimpleNamespace(id='payload_error', offset=0.01)])
    drawn = figures(compare(model, [run(lambda t, v, up: 0.03)]))['waterfall']
    axis = drawn.axes[0]
    assert [text.get_text() for text in axis.get_yticklabels()] == ['two-stage', '+ payload_error']
    widths = [bar.get_width() for bar in axis.patches]
    np.testing.assert_allclose(widths, np.rad2deg([0.03, 0.02]), rtol=1e-3)
    assert axis.get_xlabel() == 'RMSE of the angle [deg]'


def test_a_single_row_is_drawn():
    table = Measurement.from_columns({'time': [0.0], 'voltage': [1.0], 'angle': [1.8]})
    assert all(data.startswith(b'\x89PNG')
               for data in rendered(figures(compare(FakeModel(), [table]))).values())


@given(strategies.integers(5000, 30000), strategies.integers(0, 4000))
def test_thinning_keeps_the_extremes(rows, seed):
    y = np.random.default_rng(seed).standard_normal(rows)
    x = np.arange(rows, dtype=float)
    few_x, few = thinned(x, y, 1000)
    assert len(few) <= 1010
    assert few.max() == y.max() and few.min() == y.min()
    assert few_x[0] == 0 and few_x[-1] == rows - 1
    assert np.all(np.diff(few_x) > 0)
    np.testing.assert_array_equal(few, y[few_x.astype(int)])


def test_time_is_shown_in_a_fitting_unit(comparison):
    assert along(comparison)[1] == 'time [min]'


def test_the_page_says_the_verdict_and_holds_the_pictures(comparison):
    drawn = rendered(figures(comparison))
    html = comparison_page(comparison, drawn, '<b>model</b>.yaml')
    assert '&lt;b&gt;model&lt;/b&gt;.yaml' in html and '<b>' not in html
    pictures = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    assert {base64.b64decode(p) for p in pictures} == set(drawn.values())
    assert html.startswith('<!DOCTYPE html>') and html.count('<h1>') == 1
    words = re.sub('<[^>]*>', '', html)
    off = np.rad2deg(comparison.model.mean_abs)
    assert re.search(r'Off by ([\d.]+) deg on average over 6000 rows', words)
    assert float(re.search(r'Off by ([\d.]+) deg', words)[1]) == pytest.approx(off, rel=0.01)
    assert '° ' not in words and 'RMSE of the linear model' in words
    assert 'hysteresis diagnose --model' in words


@given(strategies.text())
def test_every_part_of_a_page_escapes_its_text(text):
    nasty = text + '<script>alert("x")</script>\'&'
    html = page.page(
        nasty, page.section(nasty, page.paragraph(nasty), page.facts([(nasty, nasty)])),
        page.warning(nasty), page.listing([nasty]), page.listing([nasty], ordered=False),
        page.table([nasty], [[nasty]], strong=[0]), page.picture(b'png', nasty),
        page.details(nasty, page.paragraph(nasty)), page.bars([page.Bar(nasty, 1.0)], 'deg'),
        footer=nasty)
    # The page's own script is the only one.
    assert html.count('<script') == 1
    assert html.count('&lt;script&gt;') == 18
    assert not re.search(r'alt="[^"]*"x"', html)


def test_a_new_figure_needs_no_window():
    figure, axes = new_figure(4, 3, 2, 2)
    assert axes.shape == (2, 2)
    assert png(figure, dpi=50).startswith(b'\x89PNG')
