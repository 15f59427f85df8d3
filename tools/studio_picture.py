# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Take a picture of the studio after a diagnosis and a fit: `studio_picture.py FOLDER studio.png`.

Needs the extra `studio` and Chromium, which is driven as in the tests, so that PYTHONPATH is to
name the checkout and `test`. FOLDER takes the example that the studio makes.
"""

from pathlib import Path
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

from browser_support import Browser, find_browser, MISSING

from hysteresis_ros.share import share_path

WIDTH, HEIGHT, PATIENCE = 1280, 780, 120.0


def until(browser, code):
    """Wait until an expression of JavaScript is true."""
    end = time.monotonic() + PATIENCE
    while not browser.run(code):
        if time.monotonic() > end:
            sys.exit(f'waited {PATIENCE:.0f} s for {code}')
        time.sleep(0.1)


def listening(port):
    """Wait until the studio listens."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            socket.create_connection(('127.0.0.1', int(port)), 1.0).close()
            return
        except OSError:
            time.sleep(0.1)
    sys.exit('the studio does not listen')


def click(browser, selector, words):
    """Click the first such element with these words."""
    browser.run(f'[...document.querySelectorAll({selector!r})].find('
                f'(one) => one.innerText.trim() === {words!r}).click()')


def take(address, path):
    """Diagnose, tick what was found, fit, and write the picture."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(profile)
        browser.open(address, WIDTH, HEIGHT)
        until(browser, "document.querySelectorAll('.effect').length > 5")
        click(browser, 'button', 'diagnose')
        until(browser, "document.querySelector('.verdict').innerText !== ''")
        click(browser, '.effect .q-checkbox', 'payload_error')
        until(browser, "document.querySelector('.slider') !== null")
        until(browser, "![...document.querySelectorAll('button')].find("
              "(one) => one.innerText.trim() === 'fit').disabled")
        click(browser, 'button', 'fit')
        until(browser, "document.querySelector('.right').innerText.includes('Fitted')")
        time.sleep(1.0)     # until the chart is drawn and nothing moves any more
        path.write_bytes(browser.picture())
        browser.close()


def main():
    """Start the studio on its example, and end it."""
    folder, path = (Path(name).resolve() for name in sys.argv[1:3])
    if find_browser() is None:
        sys.exit(MISSING)
    folder.mkdir(parents=True, exist_ok=True)
    # The commands in the picture are to name no folder of this machine.
    shutil.copy(share_path('config/bicep_model.yaml'), folder / 'model.yaml')
    studio = subprocess.Popen(
        [sys.executable, '-m', 'hysteresis_ros', 'studio', '--model', 'model.yaml',
         '--no-browser'], cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        address = re.search(r'http://127.0.0.1:(\d+)/', studio.stdout.readline())
        if address is None:
            sys.exit('the studio did not start')
        listening(address[1])
        take(address[0], path)
    finally:
        studio.terminate()
        studio.wait()


if __name__ == '__main__':
    main()
