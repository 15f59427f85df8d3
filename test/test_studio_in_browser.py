# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The page `hysteresis studio` as a person meets it: the command, a browser, a hand on a slider."""

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import time

from browser_support import Browser, find_browser, MISSING
from model_support import heavier_arm
import pytest

from hysteresis_ros.diagnosis.extend import rmse
from hysteresis_ros.measurements import read_measurement
from hysteresis_ros.model import MuscleModel

pytest.importorskip('nicegui', reason="no NiceGUI; pip install 'hysteresis_ros[studio]'")
pytestmark = pytest.mark.skipif(find_browser() is None, reason=MISSING)

TRUTH, DEADLINE = 15.0, 60.0


class Tab:
    """The page in a browser, by what a person sees and does."""

    def __init__(self, browser, address):
        self.browser, self.address = browser, address

    def open(self, width=1300, height=900):
        """Load the page and wait until it shows its errors and the server hears it."""
        self.browser.open(self.address, width, height)
        # What is done before is sent after, in any order: a click before the words typed.
        self.until(lambda: self.browser.run('window.did_handshake'))
        self.until(lambda: self.text('.number .now') and self.count('.effect') > 5)

    def until(self, condition):
        """Wait for something to come true."""
        end = time.monotonic() + DEADLINE
        while not (found := condition()):
            assert time.monotonic() < end, self.text('body')
            time.sleep(0.05)
        return found

    def count(self, selector):
        """Return how many elements there are."""
        return self.browser.run(f'document.querySelectorAll({selector!r}).length')

    def text(self, selector):
        """Return the text of the first such element, '' without one."""
        return self.browser.run(f"(document.querySelector({selector!r}) || {{}}).innerText || ''")

    def error(self, place=0):
        """Return an RMSE now, deg: of fitted rows, or of unseen ones."""
        said = self.browser.run(f"document.querySelectorAll('.number .now')[{place}].innerText")
        return float(said.split()[0])

    def click(self, selector, words):
        """Click the first such element with these words."""
        assert self.browser.run(
            f'(() => {{const one = [...document.querySelectorAll({selector!r})].find('
            f'(each) => each.innerText.includes({words!r})); one?.click(); return !!one}})()')

    def ticked(self, effect):
        """Return whether an effect is."""
        return self.browser.run(
            "[...document.querySelectorAll('.effect .q-checkbox')].find((one) => "
            f"one.innerText === {effect!r}).getAttribute('aria-checked')") == 'true'

    def drag(self, share):
        """Take the first slider by its knob and pull it to a share of its length, step by step."""
        left, top, width, height = self.browser.run(
            '(({left, top, width, height}) => [left, top, width, height])'
            "(document.querySelector('.slider .q-slider__track').getBoundingClientRect())")
        knob = self.browser.run(
            '(({left, width}) => left + width / 2)'
            "(document.querySelector('.slider .q-slider__thumb').getBoundingClientRect())")
        end, middle, errors = left + share * width, top + 0.5 * height, []
        self.browser.mouse('mousePressed', knob, middle, button='left', buttons=1, clickCount=1)
        for step in range(1, 6):
            self.browser.mouse('mouseMoved', knob + 0.2 * step * (end - knob), middle,
                               button='left', buttons=1)
            time.sleep(0.15)
            errors.append(self.error())
        self.browser.mouse('mouseReleased', end, middle, button='left', clickCount=1)
        return errors

    def drawn(self):
        """Return the values of the chart's line of the model now."""
        return self.browser.run(
            "(() => {const id = document.querySelector('.chart').id.slice(1);"
            'const all = getElement(+id).chart.getOption().series;'
            "return all.find((one) => one.id === 'now').data.map(([x, y]) => y)})()")


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a folder with a model and a recording of an arm with 15 g too much."""
    return heavier_arm(tmp_path_factory.mktemp('studio'), TRUTH, {'train.csv': 1})


@pytest.fixture(scope='module')
def port(folder, root):
    """Start the command, and return the port that it says."""
    # NiceGUI starts another server where it sees that pytest runs.
    environment = {name: value for name, value in os.environ.items()
                   if not name.startswith(('PYTEST_', 'NICEGUI_'))}
    environment['PYTHONPATH'] = f'{root}{os.pathsep}{environment.get("PYTHONPATH", "")}'
    server = subprocess.Popen(
        [sys.executable, '-m', 'hysteresis_ros', 'studio', '--model', 'model.yaml', '--data',
         'train.csv', '--no-browser'], cwd=folder, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, env=environment)
    try:
        said = server.stdout.readline()
        found = re.search(r'http://127\.0\.0\.1:(\d+)/', said)
        assert found, said + server.communicate()[0]
        port, end = int(found[1]), time.monotonic() + DEADLINE
        while True:
            try:
                socket.create_connection(('127.0.0.1', port), 1.0).close()
                break
            except OSError:
                assert server.poll() is None, server.communicate()[0]
                assert time.monotonic() < end
                time.sleep(0.1)
        yield port
        server.send_signal(signal.SIGINT)
        said = server.communicate(timeout=DEADLINE)[0]
        assert server.returncode == 0 and said == '', said
        assert '.nicegui' not in os.listdir(folder)
    finally:
        server.kill()


@pytest.fixture(scope='module')
def tab(port, tmp_path_factory):
    """Return the page in a browser."""
    browser = Browser(tmp_path_factory.mktemp('profile'))
    yield Tab(browser, f'http://127.0.0.1:{port}/')
    browser.close()


def test_the_error_falls_under_the_hand_and_what_is_seen_is_saved(tab, folder):
    tab.open()
    first = tab.error(), tab.error(1)
    assert tab.browser.run("document.querySelectorAll('.number').length") == 2
    tab.click('.effect .q-checkbox', 'payload_error')
    tab.until(lambda: tab.count('.slider') == 1 and tab.error() < 0.7 * first[0])
    assert tab.error(1) < 0.7 * first[1]
    before = tab.drawn()
    # 15 g lie at 0.575 of -100 to 100 g.
    errors = tab.drag(0.575)
    assert len({tab.error(), *errors}) > 3, 'the error does not follow the slider'
    tab.until(lambda: tab.error() < 0.05 * first[0])
    assert abs(float(tab.text('.slider .value').split()[0]) - TRUTH) < 1.0
    tab.until(lambda: tab.drawn() != before)
    assert tab.drawn().count(None) == 3     # trials are not joined
    tab.click('button', 'save model')
    tab.until((folder / 'extended.yaml').exists)
    model = MuscleModel.load(folder / 'extended.yaml')
    fitted = read_measurement(folder / 'train.csv').select([0, 1, 2])
    assert 57.2958 * rmse(model, [fitted]) == pytest.approx(tab.error(), rel=0.01)
    said = tab.text('.command .code')
    assert said.startswith('hysteresis extend --model model.yaml --add payload_error --data '
                           'train.csv --trials 0,1,2 --values payload_error.dm=')
    error = tab.error()
    tab.open()
    assert tab.error() == error and tab.ticked('payload_error') and not tab.ticked('slack')
    assert tab.text('.command .code') == said and tab.browser.complaints() == []


def test_the_diagnosis_runs_behind_the_page(tab, folder):
    tab.open()
    tab.click('button', 'diagnose')
    tab.until(lambda: tab.text('.verdict').startswith('Missing: '))
    # So few rows leave others that are as probable; what cannot be is at 0.
    assert re.search(r'probable\s.*payload_error\s+\d\d+ %.*clamp_mass\s+0 %',
                     tab.text('.catalogue'), re.DOTALL)
    if not tab.ticked('payload_error'):
        tab.click('.effect .q-checkbox', 'payload_error')
    tab.until(lambda: tab.browser.run(
        "![...document.querySelectorAll('button')].find((one) => one.innerText.trim() === 'fit')"
        '.disabled'))
    tab.click('button', 'fit')
    tab.until(lambda: 'Fitted' in tab.text('.right'))
    value, low, high = map(float, re.findall(r'[\d.]+', tab.text('.slider .value')))
    assert low < value < high and low < TRUTH < high
    assert '--values' not in tab.text('.commands')
    tab.click('button', 'report')
    tab.until(lambda: tab.text('.right a') == 'report.html')
    tab.browser.open(tab.browser.run("document.querySelector('.right a').href"), 1000)
    assert 'The extended model' in tab.text('h1')
    assert (folder / 'report.html').exists()


def test_an_input_is_not_overwritten(tab, folder):
    model = (folder / 'model.yaml').read_bytes()
    tab.open()
    if not tab.ticked('payload_error'):
        tab.click('.effect .q-checkbox', 'payload_error')
        tab.until(lambda: tab.count('.slider') == 1)
    tab.browser.run("document.querySelector('.file input').select()")
    tab.browser.call('Input.insertText', text='model.yaml')
    tab.until(lambda: tab.browser.run("document.querySelector('.file input').value") == (
        'model.yaml'))
    tab.click('button', 'save model')
    tab.until(lambda: 'would overwrite the input' in tab.text('.q-notifications'))
    assert (folder / 'model.yaml').read_bytes() == model


@pytest.mark.parametrize('dark', [False, True])
def test_nothing_comes_from_elsewhere_and_800_px_are_enough(tab, dark):
    tab.browser.media('', dark)
    tab.open(800)
    assert tab.browser.run('document.scrollingElement.scrollWidth') == 800
    asked = [one for one in tab.browser.requests() if not one.startswith(('data:', 'blob:'))]
    assert asked and all(one.startswith(tab.address) for one in asked)
    light = sum(map(int, re.findall(r'\d+', tab.browser.run(
        'getComputedStyle(document.body).backgroundColor'))[:3])) / 765
    assert (light < 0.2) if dark else (light > 0.9)
    assert tab.browser.complaints() == []


def test_only_this_machine_is_served_under_its_own_name(port):
    with pytest.raises(OSError):
        socket.create_connection(('127.0.0.2', port), 2.0)
    for name, status in ((f'127.0.0.1:{port}', 200), (f'localhost:{port}', 200),
                         ('page.example', 400)):
        connection = http.client.HTTPConnection('127.0.0.1', port, timeout=30)
        connection.request('GET', '/', headers={'Host': name})
        answer = connection.getresponse()
        assert answer.status == status, name
        if status == 200:
            policy = answer.headers['Content-Security-Policy']
            assert policy.startswith("default-src 'self'") and 'https:' not in policy
        connection.close()
