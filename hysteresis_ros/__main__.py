# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs the command line: `python -m hysteresis_ros`."""

import sys

from hysteresis_ros.cli.main import main

if __name__ == '__main__':
    sys.exit(main())
