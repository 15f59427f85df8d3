# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""All that is wrong with a table, in one message."""

from collections.abc import Sequence

from hysteresis_ros.errors import MeasurementError

MOST_SHOWN = 8


def refuse(source: str, problems: Sequence[str]) -> None:
    """
    Raise one error for all problems of a table; none, and nothing happens.

    Parameters
    ----------
    source : str
        File or folder, at the beginning of the message.
    problems : sequence of str
        One clause each, without a full stop.

    Raises
    ------
    MeasurementError
        If there is a problem. Several are numbered, on one line.

    """
    if not problems:
        return
    if len(problems) == 1:
        raise MeasurementError(f'{source}: {problems[0]}')
    shown = ' '.join(f'({n}) {problem}' for n, problem in enumerate(problems[:MOST_SHOWN], 1))
    rest = len(problems) - MOST_SHOWN
    raise MeasurementError(f'{source}: {len(problems)} problems: {shown}'
                           + (f' and {rest} more' if rest > 0 else ''))
