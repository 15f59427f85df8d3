# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that belong to the bench model: found in its own tables, or named by the user."""

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.bench import choose_trials, measure


def _silent(iterable, total):
    return iterable


def add_effects(model, length, force=None, names=None, length_trials=None, force_trials=None,
                jobs: int = 1, progress=_silent):
    """
    Add effects to an identified model and refit H2's weights with them.

    Parameters
    ----------
    model : MuscleModel
        As identified on the same trials.
    length, force : Measurement
        The bench tables; `force` only for the metrics.
    names : sequence of str, optional
        Effects to add; by default those that the length table proves.
    length_trials, force_trials : sequence of numbers, optional
        Trials that are fitted; the others verify.
    jobs : int
        Processes.
    progress : callable
        ``progress(iterable, total)``, for a progress bar.

    Returns
    -------
    model : MuscleModel
        With effects and new metrics.
    added : list of Effect

    Raises
    ------
    IdentificationError
        If a trial is not in the table.
    """
    rows = choose_trials(length, length_trials, 'length')
    if not rows.any():
        raise IdentificationError('no trial is left to fit')
    fitted = length.select(sorted(set(length.column('trial')[rows].tolist())))
    if names is None:
        names = diagnose(model, [fitted], jobs=jobs, progress=progress).missing
    if not names:
        return model, []
    extension = extend(model, names, [fitted])
    extended = extension.model
    measure(extended, force, force_trials, length, length_trials)
    return extended, extension.added
