# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Work in the background that tells how far it is and can be stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
import logging
import threading
from typing import TYPE_CHECKING, TypeVar

from hysteresis_ros.errors import HysteresisError

if TYPE_CHECKING:
    from hysteresis_ros.api import Progress

Item = TypeVar('Item')


class Stopped(Exception):
    """The work was asked to stop, and did."""


class Job:
    """
    A piece of work in a thread of its own.

    Parameters
    ----------
    name : str
        What is done, for people.
    work : callable
        Called with a progress as `diagnose` takes it: ``progress(items, total)``.

    Attributes
    ----------
    error : str
        Why it could not be done, in one line; '' if it could, or was stopped.
    """

    def __init__(self, name: str, work: Callable[[Progress], object]) -> None:
        self.name = name
        self.error = ''
        self._work = work
        self._done = self._total = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether it goes on."""
        return self._thread.is_alive()

    @property
    def share(self) -> float | None:
        """What is done of all that is known to be done, 0 to 1; None before that is known."""
        return self._done / self._total if self._total else None

    def stop(self) -> None:
        """Have it end at its next step."""
        self._stop.set()

    def wait(self, seconds: float | None = None) -> None:
        """Return when it has ended, or after a time."""
        self._thread.join(seconds)

    def _progress(self, items: Iterable[Item], total: int) -> Iterator[Item]:
        self._total += total
        for item in items:
            if self._stop.is_set():
                raise Stopped
            yield item
            self._done += 1

    def _run(self) -> None:
        try:
            self._work(self._progress)
        except Stopped:
            pass
        except (HysteresisError, OSError) as error:
            self.error = ' '.join(str(error).split())
        except Exception as error:
            logging.getLogger(__name__).exception('%s failed', self.name)
            self.error = f'{self.name} failed: {type(error).__name__}: {error}'
