# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Injects every fault into a heated arm, and measures how long the muscle is heated after it.

    python -m tools.faults docs/safety.md

The arm lives behind the simulated board at real time, and behind the firmware's machine code in
simavr at half of it; the voltage is what the board applies, every 20 ms. Host, compensator and
geometry node are killed as processes. The table goes between the page's two marks.
"""

import argparse
from pathlib import Path
import sys

from hysteresis_ros.errors import HysteresisError
from tools.faults.fault import LIMIT
from tools.faults.table import BEGIN_MARK, END_MARK, measure, table


def main() -> int | str:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('page', type=Path, help='whose table is made anew')
    arguments = parser.parse_args()
    try:
        rows = measure()
    except HysteresisError as error:
        return str(error)
    page = arguments.page.read_text(encoding='utf-8')
    start, _, rest = page.partition(BEGIN_MARK)
    text = f'{start}{BEGIN_MARK}\n{table(rows)}{END_MARK}{rest.partition(END_MARK)[2]}'
    arguments.page.write_text(text, encoding='utf-8')
    print(table(rows))
    late = [row.name for row in rows if row.late]
    return f'later than {LIMIT} s: {late}' if late else 0


if __name__ == '__main__':
    sys.exit(main())
