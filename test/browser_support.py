# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium for tests, spoken to in its DevTools protocol over two pipes."""

import base64
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import time

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable', 'chrome')
MISSING = 'no Chromium; apt-get install chromium, or name one in CHROME'
MOST_BYTES = 10 << 20
# DevTools read from descriptor 3 and write to 4, which may be taken when a test starts.
START = """
import fcntl, os, sys
for number, pipe in enumerate([fcntl.fcntl(int(n), fcntl.F_DUPFD, 10) for n in sys.argv[1:3]], 3):
    os.dup2(pipe, number)
os.execv(sys.argv[3], sys.argv[3:])
"""


def find_browser():
    """Return the path of a Chromium, None if there is none."""
    return next(filter(None, map(shutil.which, [os.environ.get('CHROME', ''), *NAMES])), None)


class Browser:
    """
    One tab of a headless Chromium.

    Parameters
    ----------
    folder : Path
        For its profile.

    """

    def __init__(self, folder):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()
        self.process = subprocess.Popen(
            [sys.executable, '-IS', '-c', START, str(theirs_in), str(theirs_out), find_browser(),
             '--headless=new', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage',
             '--no-first-run', '--disable-extensions', '--disable-background-networking',
             '--disable-component-update', '--hide-scrollbars', f'--user-data-dir={folder}',
             '--remote-debugging-pipe', 'about:blank'],
            pass_fds=(theirs_in, theirs_out), stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True)
        os.close(theirs_in)
        os.close(theirs_out)
        self.reader, self.writer, self.buffer = ours_in, ours_out, b''
        self.count, self.session, self.events = 0, None, []
        target = next(one for one in self.call('Target.getTargets')['targetInfos']
                      if one['type'] == 'page')
        self.session = self.call('Target.attachToTarget', targetId=target['targetId'],
                                 flatten=True)['sessionId']
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')

    def call(self, method, **parameters):
        """Call a method of the protocol and return its result."""
        self.count += 1
        message = {'id': self.count, 'method': method, 'params': parameters}
        if self.session:
            message['sessionId'] = self.session
        os.write(self.writer, json.dumps(message).encode() + b'\0')
        while True:
            answer = self._next()
            if answer.get('id') == self.count:
                assert 'error' not in answer, answer
                return answer['result']
            self.events.append(answer)

    def _next(self, seconds=60):
        deadline = time.monotonic() + seconds
        while b'\0' not in self.buffer:
            ready = select.select([self.reader], [], [], max(deadline - time.monotonic(), 0))[0]
            read = os.read(self.reader, MOST_BYTES) if ready else b''
            assert read, f'Chromium says nothing (exit status {self.process.poll()})'
            self.buffer += read
        message, _, self.buffer = self.buffer.partition(b'\0')
        return json.loads(message)

    def open(self, path, width, height=900):
        """Show a file, or what an address (str) leads to, in a window of a size, px."""
        self.events.clear()
        self.size(width, height)
        self.call('Page.navigate', url=path if isinstance(path, str) else path.as_uri())
        while self.run('document.readyState') != 'complete' or self.run('location.href') in (
                'about:blank', ''):
            time.sleep(0.02)

    def size(self, width, height=900):
        """Set the size of the window, px; below 500 it is a phone."""
        self.call('Emulation.setDeviceMetricsOverride', width=width, height=height,
                  deviceScaleFactor=1, mobile=width < 500)

    def run(self, code):
        """Return the value of an expression of JavaScript."""
        found = self.call('Runtime.evaluate', expression=code, returnByValue=True,
                          awaitPromise=True, userGesture=True)
        assert 'exceptionDetails' not in found, found
        return found['result'].get('value')

    def complaints(self):
        """Return what the page has said on the console, and its errors."""
        self.run('1')
        wrong = ('Runtime.exceptionThrown', 'Runtime.consoleAPICalled', 'Log.entryAdded')
        return [event for event in self.events if event['method'] in wrong]

    def requests(self):
        """Return the addresses of all that the page has asked for."""
        return [event['params']['request']['url'] for event in self.events
                if event['method'] == 'Network.requestWillBeSent']

    def mouse(self, kind, x, y, **more):
        """Move or press the mouse at a place of the window, px."""
        self.call('Input.dispatchMouseEvent', type=kind, x=x, y=y, **more)

    def key(self, name, code):
        """Press a key, by its name and its code in Windows."""
        for kind in ('keyDown', 'keyUp'):
            self.call('Input.dispatchKeyEvent', type=kind, key=name, code=name,
                      windowsVirtualKeyCode=code)

    def media(self, kind='', dark=False):
        """Show the page on `screen` or in `print`, in light or dark."""
        self.call('Emulation.setEmulatedMedia', media=kind, features=[
            {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}])

    def picture(self, path=None):
        """Return what is seen of the page, all its height, as PNG; written to a path, too."""
        data = base64.b64decode(self.call(
            'Page.captureScreenshot', format='png', captureBeyondViewport=path is not None)['data'])
        if path:
            path.write_bytes(data)
        return data

    def close(self):
        """End the browser and all that it started."""
        os.close(self.writer)
        os.close(self.reader)
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
