# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A recording that grows while it is looked at."""

from __future__ import annotations

from collections.abc import Callable
import logging
import threading
from typing import TYPE_CHECKING

from hysteresis_ros.errors import HysteresisError

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement
    from hysteresis_ros.studio.session import Session

# Time between two looks at the recording [s].
PERIOD = 1.0


class Feed:
    """
    Hands a session what a live arm has done so far, from a thread of its own.

    Parameters
    ----------
    session : Session
    source : callable
        Returns the recording so far, None before there is one.
    path : str
        Where the recording is saved.
    period : float
        Time between two looks [s].

    Attributes
    ----------
    listening : bool
        Whether the session gets what is new.
    trouble : str
        Why it does not, in one line; '' if it does.
    saved : bool
        Whether all that the session has got is in the file.
    """

    def __init__(self, session: Session, source: Callable[[], Measurement | None], path: str,
                 period: float = PERIOD) -> None:
        self.session, self.path = session, path
        self.listening = True
        self.trouble = ''
        self.saved = False
        self._source, self._period = source, period
        self._rows = 0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join()

    def look(self) -> None:
        """Hand over what is new."""
        try:
            recording = self._source()
            if recording is None or recording.rows == self._rows:
                return
            self.session.update([recording])
            self._rows, self.trouble, self.saved = recording.rows, '', False
        except HysteresisError as error:
            self.trouble = ' '.join(str(error).split())
            self.session.touch()

    def save(self) -> str:
        """
        Write the recording that the session looks at as a table and return its path.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        from hysteresis_ros.measurements import write_csv

        if self.session.ready:
            write_csv(self.session.recordings[0], self.path)
            self.saved = True
        return self.path

    def _run(self) -> None:
        while not self._end.wait(self._period):
            if self.listening:
                try:
                    self.look()
                except Exception:
                    logging.getLogger(__name__).exception('the recording cannot be looked at')
