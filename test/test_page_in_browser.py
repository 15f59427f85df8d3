# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A page as a person meets it: in a headless Chromium, with pointer, keyboard, phone and paper."""

import base64
import dataclasses
import re

from browser_support import Browser, find_browser, MISSING
from model_support import bicep_model, effect_of
import numpy as np
import pytest
from test_compare import FakeModel
from test_report import diagnosis, row, run_of

from hysteresis_ros.comparison.compare import compare
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.report import charts, diagnosis_page
from hysteresis_ros.report.comparison_page import comparison_page

pytestmark = pytest.mark.skipif(find_browser() is None, reason=MISSING)

PIXEL = base64.b64decode('iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK'
                         '+kcQAAAABJRU5ErkJggg==')
LONG = 'a_recording_with_a_name_that_is_much_longer_than_a_phone_is_wide_' * 2 + '.csv'


@pytest.fixture(scope='module')
def recordings():
    """Return two settled recordings of an arm with a payload too heavy, and an end stop."""
    arm = bicep_model(['payload_error', 'end_stop'])
    return [Measurement.from_columns(run_of(arm, seed).columns, source=f'{seed}_{LONG}')
            for seed in (1, 2)]


@pytest.fixture(scope='module')
def path(recordings, tmp_path_factory):
    """Return the page of a diagnosis, whose pictures the charts replace."""
    model = bicep_model()
    many = [row(name, 0.01 * (n + 1)) for n, name in enumerate(
        ['stress_dependent_strain', 'heating_cooling_asymmetry', 'supply_sag'])]
    found = diagnosis(effects=[effect_of(model, 'payload_error')])
    found = dataclasses.replace(found, ranking=[*found.ranking, *many])
    path = tmp_path_factory.mktemp('page') / 'diagnosis.html'
    with pytest.MonkeyPatch.context() as patch:
        for module in (charts, diagnosis_page):
            patch.setattr(module, 'png', lambda figure: PIXEL)
        diagnosis_page.write_diagnosis(path, model, recordings, found, 'model.yaml')
    return path


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    """Start a browser."""
    browser = Browser(tmp_path_factory.mktemp('profile'))
    yield browser
    browser.close()


@pytest.fixture
def tab(browser, path):
    """Return the browser with the page in a window of 1200 px."""
    browser.media()
    browser.open(path, 1200, 2400)
    yield browser
    assert browser.complaints() == []


def place(tab, selector, right, down):
    """Return a place in the window: shares of the width and the height of an element."""
    left, top, width, height = tab.run(
        f'(({{left, top, width, height}}) => [left, top, width, height])'
        f'(document.querySelector({selector!r}).getBoundingClientRect())')
    return left + right * width, top + down * height


def count(tab, selector):
    """Return how many elements there are."""
    return tab.run(f'document.querySelectorAll({selector!r}).length')


def text(tab, selector):
    """Return the text of an element."""
    return tab.run(f'document.querySelector({selector!r}).textContent')


def drawn(tab):
    """Return the path of the measured response."""
    return tab.run("document.querySelector('.curve.measured').getAttribute('d')")


def choose(tab, number, option):
    """Take an option of one of the lists above the charts."""
    tab.run(f"(() => {{const list = document.querySelectorAll('.controls select')[{number}];"
            f"list.value = '{option}'; list.dispatchEvent(new Event('change'))}})()")


def test_charts_take_the_place_of_pictures_and_nothing_is_fetched(tab, path):
    assert count(tab, 'figure img') == 0 and count(tab, 'figure svg') > 5
    asked = [address for address in tab.requests() if not address.startswith('data:')]
    assert asked == [path.as_uri()]
    assert tab.run("[...document.querySelectorAll('svg')].every("
                   "(one) => /[0-9]/.test(one.getAttribute('aria-label')))")


def test_pointing_at_a_chart_shows_the_values_of_the_row(tab, recordings):
    tab.mouse('mouseMoved', *place(tab, '.plot svg', 0.3, 0.3))
    assert not tab.run("document.querySelector('.plot .tip').hidden")
    shown = text(tab, '.plot .tip')
    minutes = float(re.search(r'time ([\d.]+) ', shown)[1])
    time = recordings[0].time / 60.0
    nearest = int(np.argmin(np.abs(time - minutes)))
    measured = np.rad2deg(recordings[0].columns['angle'][nearest])
    assert float(re.search(r'measured ([\d.]+) deg', shown)[1]) == pytest.approx(measured, abs=0.06)
    assert re.search(r'two-stage [\d.]+ deg residual [+-][\d.]+ deg', shown)
    assert 'with payload_error' in shown and 'linear model' in shown
    # The other chart points at the same row.
    assert count(tab, '.cursor circle') > 3


def test_drawing_across_zooms_and_a_double_click_shows_all(tab):
    before = drawn(tab)
    points = [place(tab, '.plot svg', share, 0.3) for share in (0.4, 0.5, 0.6)]
    tab.mouse('mousePressed', *points[0], button='left', buttons=1, clickCount=1)
    tab.mouse('mouseMoved', *points[1], button='left', buttons=1)
    assert count(tab, '.selection') == 1
    tab.mouse('mouseReleased', *points[2], button='left', clickCount=1)
    assert count(tab, '.selection') == 0
    assert len(drawn(tab)) < 0.6 * len(before)
    for clicks in (1, 2):
        tab.mouse('mousePressed', *points[1], button='left', buttons=1, clickCount=clicks)
        tab.mouse('mouseReleased', *points[1], button='left', clickCount=clicks)
    assert drawn(tab) == before


def test_trials_are_chosen_and_not_joined(tab):
    assert drawn(tab).count('M') == 2
    choose(tab, 0, 2)
    assert drawn(tab).count('M') == 1
    tab.mouse('mouseMoved', *place(tab, '.plot svg', 0.5, 0.3))
    assert 'trial 0 of 2_a_rec' in text(tab, '.plot .tip')


def test_models_and_the_shaded_region_are_switched(tab):
    # In the response, in the residual, and on the loop.
    assert count(tab, 'path.linear') >= 3 and count(tab, 'rect.region') > 0
    tab.run("document.querySelector('.key.linear input').click()")
    assert count(tab, 'path.linear') == 0 and count(tab, 'path.after') >= 3
    choose(tab, 1, 0)
    assert count(tab, 'rect.region') == 0


def test_response_and_residual_share_their_axis(tab):
    tab.mouse('mouseMoved', *place(tab, '.plot svg', 0.5, 0.3))
    line = tab.run("(() => {const one = document.querySelector('.cursor line');"
                   "return ['x1', 'x2', 'y1', 'y2'].map((n) => +one.getAttribute(n))})()")
    assert line[0] == line[1]
    circles = tab.run("[...document.querySelector('.cursor').querySelectorAll('circle')].map("
                      "(one) => +one.getAttribute('cx'))")
    assert len(circles) == 7 and set(circles) == {line[0]}


def test_rows_on_the_loop_have_the_colour_of_their_residual(tab, recordings):
    found = dict(tab.run(
        "[...document.querySelectorAll('path[class*=colour]')].map((one) => "
        "[+/colour([0-9])/.exec(one.className.baseVal)[1], one.getAttribute('d').split('M').length"
        ' - 1])'))
    residual = compare(bicep_model(), recordings).residual
    shares = np.clip(residual / np.quantile(np.abs(residual), 0.99), -1.0, 1.0)
    expected = np.bincount(np.floor(4.0 * (shares + 1.0) + 0.5).astype(int), minlength=9)
    assert np.sum(expected > 0) > 4
    off = [abs(found.get(colour, 0) - rows) for colour, rows in enumerate(expected)]
    assert sum(off) <= 4 and sum(found.values()) == len(residual)


def test_the_keyboard_reads_row_after_row(tab):
    tab.run("document.querySelector('input[type=range]').focus()")
    heard = []
    for _ in range(2):
        tab.key('ArrowRight', 39)
        heard.append(tab.run(
            "document.querySelector('input[type=range]').getAttribute('aria-valuetext')"))
    assert all(re.search(r'measured [\d.]+ deg', one) for one in heard) and heard[0] != heard[1]
    assert text(tab, 'output') == heard[1]
    assert tab.run("[...document.querySelectorAll('button, select, input')].every((one) => "
                   'one.ariaLabel || one.labels?.length || one.textContent)')


def test_a_command_is_copied(tab):
    tab.call('Browser.grantPermissions', permissions=['clipboardReadWrite',
                                                      'clipboardSanitizedWrite'])
    tab.run("document.querySelector('.command button').click()")
    assert tab.run('new Promise((done) => setTimeout(() => done('
                   "document.querySelector('.command button').textContent), 100))") == 'Copied'
    copied = tab.run('navigator.clipboard.readText()')
    assert copied.startswith('hysteresis diagnose --model model.yaml --data 1_a_recording')


@pytest.mark.parametrize('dark', [False, True])
def test_a_phone_shows_the_page_without_moving_it_sideways(tab, path, dark):
    tab.media('', dark)
    tab.open(path, 400)
    tab.run("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    assert tab.run('document.scrollingElement.scrollWidth') == 400
    wide = tab.run("[...document.querySelectorAll('main *')].filter((one) => "
                   "one.getBoundingClientRect().right > 401 && !one.closest('svg, thead'))"
                   '.map((one) => one.outerHTML.slice(0, 80))')
    assert wide == []
    # The number stands before, which here is above, its bar.
    tops = tab.run("['.value', '.bar'].map((name) => document.querySelector(`.bars ${name}`)"
                   '.getBoundingClientRect().top)')
    assert tops[0] < tops[1]
    lightness = sum(map(int, re.findall(r'\d+', tab.run(
        'getComputedStyle(document.body).backgroundColor'))[:3])) / 765
    assert (lightness < 0.2) if dark else (lightness > 0.9)


def test_paper_has_no_buttons_and_nothing_folded(tab):
    tab.media('print', dark=True)
    tab.run("dispatchEvent(new Event('beforeprint'))")
    assert tab.run("[...document.querySelectorAll('details')].every((one) => one.open)")
    assert tab.run("[...document.querySelectorAll('button, select, input')].every("
                   '(one) => !one.checkVisibility())')
    assert tab.run('getComputedStyle(document.body).color') == 'rgb(26, 31, 38)'
    assert tab.run("document.querySelector('.plot svg').checkVisibility()")


def test_without_the_script_the_pictures_stay(browser, path):
    browser.call('Emulation.setScriptExecutionDisabled', value=True)
    try:
        browser.media()
        browser.open(path, 400)
        assert count(browser, 'figure img') == 3 and count(browser, '.controls') == 0
        assert browser.run('document.scrollingElement.scrollWidth') == 400
    finally:
        browser.call('Emulation.setScriptExecutionDisabled', value=False)


@pytest.mark.parametrize('columns', [
    {'time': [0.0], 'voltage': [1.0], 'angle': [1.8]},
    {'time': [0.0, 1.0, 2.0], 'voltage': [0.0, 0.0, 0.0], 'angle': [2.0, 2.0, 2.0]}])
def test_a_recording_in_which_nothing_happens_is_drawn(browser, tmp_path, columns):
    found = compare(FakeModel(linear=None), [Measurement.from_columns(columns)])
    page = tmp_path / 'page.html'
    page.write_text(comparison_page(found, dict.fromkeys(['overlay', 'loop', 'signals'], PIXEL),
                                    'model.yaml'), encoding='utf-8')
    browser.open(page, 1200)
    browser.mouse('mouseMoved', *place(browser, '.plot svg', 0.5, 0.3))
    assert 'measured' in text(browser, '.plot .tip')
    assert 'NaN' not in browser.run("document.querySelector('.explore').innerHTML")
    assert browser.complaints() == []


def test_no_other_script_runs(browser, path):
    browser.open(path, 1200)
    assert browser.run("(() => {const one = document.createElement('script');"
                       "one.textContent = 'window.ran = 1'; document.body.append(one);"
                       'return window.ran === undefined})()')
