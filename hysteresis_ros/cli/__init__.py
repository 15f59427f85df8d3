# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: one file a command, each with `add_parser(subparsers)` and `run(args)`."""
