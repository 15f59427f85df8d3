# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The next command of the workflow, ready to be copied."""

from __future__ import annotations

from collections.abc import Sequence
import shlex
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.verdict import Diagnosis
    from hysteresis_ros.report.provenance import Origin

# A recording that is still to be made.
NEW = 'NEW.csv'


def after_comparison(model: str, data: Sequence[str], origin: Origin) -> str:
    """Return the command that asks what the model is missing."""
    return shlex.join(['hysteresis', 'diagnose', '--model', model, '--data', *data,
                       *origin.reading, '--report', 'diagnosis.html'])


def after_diagnosis(found: Diagnosis, model: str, data: Sequence[str], origin: Origin) -> str:
    """
    Return the command that follows from a verdict.

    Parameters
    ----------
    found : Diagnosis
    model : str
        The model's file.
    data : sequence of str
        Recordings.
    origin : Origin

    Returns
    -------
    str
        Adds what is missing, or else what the wire itself may do; where effects are tied or
        unknown, diagnoses again with the recording that the verdict asks for; else compares with
        another one.
    """
    missing = [] if any(found.alternatives) else found.missing
    if found.verdict == 'adequate':
        missing = [one['effect'] for one in (found.kept_strain, found.kinetics) if one]
    elif missing and found.kinetics and found.pooled_before is not None:
        missing = [*missing, found.kinetics['effect']]
    if missing:
        return shlex.join([
            'hysteresis', 'extend', '--model', model, '--add', ','.join(missing), '--data',
            *data, *origin.reading, '--test', NEW, '-o', 'extended.yaml', '--report',
            'extended.html'])
    if found.verdict == 'adequate':
        return after_extension(model, origin)
    return after_comparison(model, [*data, NEW], origin)


def after_extension(model: str, origin: Origin) -> str:
    """Return the command that tries a model on a recording that it has not seen."""
    return shlex.join(['hysteresis', 'compare', '--model', model, '--data', NEW,
                       *origin.reading, '--report', 'compare.html'])
