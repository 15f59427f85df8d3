# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which rows are fitted and which are kept unseen: whole trials of one recording, or recordings."""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
import os
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement


@dataclasses.dataclass(frozen=True)
class Part:
    """
    A part of the data that is fitted or unseen as a whole.

    Attributes
    ----------
    name : str
        For people.
    recording : int
        Number of the recording that it lies in.
    trial : float or None
        Its trial; None for all of the recording.
    """

    name: str
    recording: int
    trial: float | None = None


def parts_of(recordings: Sequence[Measurement]) -> list[Part]:
    """Return the recordings as parts, or of a single one its trials."""
    if len(recordings) == 1:
        return [Part(f'trial {trial:g}', 0, float(trial)) for trial in recordings[0].trials]
    names = [os.path.basename(os.path.normpath(one.source)) for one in recordings]
    if len(set(names)) < len(names):
        names = [one.source for one in recordings]
    return [Part(name, number) for number, name in enumerate(names)]


def select(recordings: Sequence[Measurement], parts: Sequence[Part]) -> list[Measurement]:
    """Return what lies in some parts, as measurements of their own."""
    if not parts:
        return []
    if parts[0].trial is None:
        return [recordings[part.recording] for part in parts]
    if len(parts) == len(recordings[0].trials):
        return list(recordings)
    return [recordings[0].select(part.trial for part in parts if part.trial is not None)]


def rows_of(recordings: Sequence[Measurement], rows: Sequence[np.ndarray],
            part: Part) -> np.ndarray:
    """
    Return which of the rows that are looked at lie in a part, ndarray of bool (n,).

    Parameters
    ----------
    recordings : sequence of Measurement
    rows : sequence of ndarray of int
        Of each recording the rows that are looked at; n in all.
    part : Part
    """
    found = []
    for number, (recording, chosen) in enumerate(zip(recordings, rows)):
        inside = np.full(len(chosen), number == part.recording)
        if part.trial is not None:
            inside &= recording.column('trial')[chosen] == part.trial
        found.append(inside)
    return np.concatenate(found)
