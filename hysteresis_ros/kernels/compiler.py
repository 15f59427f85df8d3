# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Numba as the kernels use it: its compiler, and its cache made safe. Needs numba installed."""

from collections.abc import Callable, Iterator
import contextlib
import logging
import os
from pathlib import Path
import threading
from typing import Any, TypeVar

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.extending import typeof_impl
import numpy as np

from hysteresis_ros.kernels.cache_folder import cache_folder

try:
    import fcntl
except ImportError:     # no POSIX: processes that compile at once are on their own
    fcntl = None        # type: ignore[assignment]

Function = TypeVar('Function', bound=Callable)
Kind = TypeVar('Kind', bound=type)

_DECORATING = threading.Lock()
_REPORTED: set[str] = set()


def compile_and_keep(function: Function) -> Function:
    """Return the compiled function, whose machine code is kept in the cache's folder."""
    compiled = numba.njit(nogil=True, error_model='numpy')(function)
    # With NUMBA_DISABLE_JIT=1 numba gives the function itself back.
    folder = cache_folder() if isinstance(compiled, Dispatcher) else None
    if folder is not None:
        with _caching_in(folder):
            compiled._cache = KernelCache(function, folder)
    return compiled


def remember_types(kind: Kind) -> Kind:
    """
    Have numba remember how it types the tuples of a class; anew in each call takes it 0.2 ms.

    Parameters
    ----------
    kind : type
        A named tuple of arrays, numbers and such tuples.

    Returns
    -------
    type
        The class.
    """
    known: dict[tuple, Any] = {}
    usual = typeof_impl.dispatch(tuple)

    def remembered(value: tuple, context: Any) -> Any:
        key = _key(value)
        if key not in known:
            known[key] = usual(value, context)
        return known[key]

    typeof_impl.register(kind, remembered)
    return kind


def _key(value: tuple) -> tuple:
    """Return all that the type of a tuple depends on."""
    return tuple([
        (one.dtype, one.ndim, one.flags.num) if isinstance(one, np.ndarray)
        else _key(one) if isinstance(one, tuple) else type(one) for one in value])


class KernelCache(FunctionCache):
    """
    Numba's cache of one function, made safe for processes that compile at once.

    Numba writes the index of what is there before the machine code, and two processes that add to
    an index at once take the same file name for different code. And a file cut off by a power
    failure would end every later run with an error. Here a lock goes around each access, and what
    cannot be read is compiled anew.

    Numba keeps what it compiles by the place and the time of the source. The folder's name stands
    for what the sources of this package hold, so that each copy of them, such as a checkout and
    what was installed from it, takes what another one has compiled.

    Parameters
    ----------
    function : callable
        What is compiled.
    folder : Path
        That of `cache_folder`.
    """

    def __init__(self, function: Callable, folder: Path) -> None:
        super().__init__(function)
        if Path(function.__code__.co_filename).parent == Path(__file__).parent:
            self._cache_path = str(folder)
            self._cache_file = IndexDataCacheFile(
                self._cache_path, self._impl.filename_base, source_stamp=None)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function for a signature, or None if it is not there."""
        try:
            with self._locked(exclusive=False):
                # Numba's own imports all that it compiles with first, a quarter of a second for
                # nothing: what is compiled already needs the functions that count references.
                rtsys.initialize(target_context)
                return self._load_overload(sig, target_context)
        except Exception as error:      # whatever pickle makes of a damaged file
            self._report('read', error)
            self._forget()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the compiled function for a signature."""
        try:
            with self._locked(exclusive=True):
                super().save_overload(sig, data)
        except OSError as error:
            self._report('written', error)

    @contextlib.contextmanager
    def _locked(self, exclusive: bool) -> Iterator[None]:
        with contextlib.ExitStack() as stack:
            if fcntl is not None:
                with contextlib.suppress(OSError):      # a file system without locks, or a full one
                    os.makedirs(self.cache_path, exist_ok=True)
                    file = stack.enter_context(open(self._index_path() + '.lock', 'ab'))
                    fcntl.flock(file, fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH)
            yield

    def _index_path(self) -> str:
        return os.path.join(self.cache_path, self._impl.filename_base + '.nbi')

    def _forget(self) -> None:
        with contextlib.suppress(OSError), self._locked(exclusive=True):
            os.unlink(self._index_path())

    def _report(self, what: str, error: Exception) -> None:
        if what not in _REPORTED:       # a full disk is told once, not for each function
            _REPORTED.add(what)
            logging.getLogger(__name__).warning(
                '%s: a compiled function could not be %s (%s: %s)', self.cache_path, what,
                type(error).__name__, error)


@contextlib.contextmanager
def _caching_in(folder: os.PathLike) -> Iterator[None]:
    """Have numba's caches made meanwhile use a folder; those of other packages stay as they are."""
    ours = {'CACHE_DIR': str(folder), 'CACHE_LOCATOR_CLASSES': ''}
    with _DECORATING:
        before = {name: getattr(numba.config, name) for name in ours
                  if hasattr(numba.config, name)}
        try:
            for name in before:
                setattr(numba.config, name, ours[name])
            yield
        finally:
            for name, value in before.items():
                setattr(numba.config, name, value)
