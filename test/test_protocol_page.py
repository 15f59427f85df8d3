# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The page that explains the protocol tells the truth."""

import re

from hysteresis_ros.bridge.messages import FAULTS, Identity, Telemetry
from hysteresis_ros.bridge.protocol import Frame, MAX_LINE, parse_line, Remark, VERSION
from hysteresis_ros.laboratory.board.simulated_board import SimulatedBoard
from hysteresis_ros.laboratory.plant import Plant
import pytest


@pytest.fixture
def page(root):
    """Return the page's text."""
    return (root / 'docs' / 'protocol.md').read_text(encoding='utf-8')


def test_every_example_is_a_good_line(page):
    lines = re.findall(r'^    [<>] (.+)$', page, re.MULTILINE)
    lines += re.findall(r'^    (set \d.+)$', page, re.MULTILINE)
    assert len(lines) > 10
    for line in lines:
        assert isinstance(parse_line(line.encode('ascii')), (Frame, Remark)), line
        assert len(line) < MAX_LINE


def test_the_simulated_board_answers_as_the_example_says(page):
    board = SimulatedBoard(Plant(0).arm)
    said = board.transmit().decode('ascii').splitlines()
    for line in re.findall(r'^    > (.+)$', page, re.MULTILINE):
        board.receive(line.encode('ascii') + b'\n')
        said += board.transmit().decode('ascii').splitlines()
        if line.startswith('set 4'):
            board.advance(5)
            said += board.transmit().decode('ascii').splitlines()
    shown = re.findall(r'^    < (.+)$', page, re.MULTILINE)
    quiet = [line for line in shown if not line.startswith('tele')]
    assert [line for line in said if not line.startswith('tele')] == quiet


def test_every_key_and_fault_is_explained(page):
    telemetry = Telemetry(0, 0, 0.0, 0.0, False, latch=0, ambient=0.0, accepted=0,
                          obeyed=0)
    for key in [*telemetry.fields(), *Identity(1, 'a', 'b', 0, 0, 32, 1.0).fields(), *FAULTS]:
        assert f'`{key}`' in page or f'{key}=' in page, key
    assert f'version {VERSION}' in page and f'At most {MAX_LINE} bytes' in page
