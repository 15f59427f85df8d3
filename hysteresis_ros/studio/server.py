# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The local server of the page: one machine, one port, nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
import errno
import importlib
import os
import socket
from typing import Any, TYPE_CHECKING

from hysteresis_ros.errors import ParameterError

if TYPE_CHECKING:
    from hysteresis_ros.studio.feed import Feed
    from hysteresis_ros.studio.session import Session

HOST = '127.0.0.1'
FIRST_PORT, PORTS = 8080, 100
# The page may load what this server has, and talk to it alone.
POLICY = ("default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
          "connect-src 'self' ws://127.0.0.1:{port} ws://localhost:{port}; frame-ancestors 'none'")
MISSING = ('the page needs the package {name}, which is not installed: '
           "pip install 'hysteresis_ros[studio]'")


def require_framework() -> None:
    """
    Import the web framework.

    Raises
    ------
    ParameterError
        If it is not installed; it says how to install it.
    """
    try:
        importlib.import_module('nicegui')
    except ImportError as error:
        raise ParameterError(MISSING.format(name=error.name or 'nicegui')) from None


def free_port(wanted: int | None = None) -> int:
    """
    Return a port of this machine that nothing listens on.

    Parameters
    ----------
    wanted : int, optional
        This one and no other; by default the next free one from 8080 on.

    Raises
    ------
    ParameterError
        If it is taken or not allowed.
    """
    if wanted is not None and not 1 <= wanted <= 65535:
        raise ParameterError(f'--port {wanted}: a port is a number from 1 to 65535')
    ports = range(FIRST_PORT, FIRST_PORT + PORTS) if wanted is None else (wanted,)
    for port in ports:
        with socket.socket() as trial:
            # As the server itself does: a port just left is free.
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                trial.bind((HOST, port))
                return port
            except OSError as error:
                if wanted is not None:
                    taken = error.errno == errno.EADDRINUSE
                    why = 'is taken' if taken else os.strerror(error.errno or 0)
                    raise ParameterError(f'--port {wanted}: {why}; name another one, or none for '
                                         'the next that is free') from None
    raise ParameterError(f'no port from {ports[0]} to {ports[-1]} is free; name one with --port')


def serve(session: Session, port: int, *, show: bool = True, feed: Feed | None = None) -> None:
    """
    Serve the page of a session until Ctrl-C.

    Parameters
    ----------
    session : Session
    port : int
    show : bool
        Whether to open a browser.
    feed : Feed, optional
        The recording of a live arm.
    """
    from nicegui import app, ui
    from starlette.middleware.trustedhost import TrustedHostMiddleware

    from hysteresis_ros.studio.page import Page

    policy = POLICY.format(port=port)

    @app.middleware('http')
    async def keep_to_itself(request: Any, call_next: Callable[[Any], Awaitable[Any]]) -> Any:
        response = await call_next(request)
        response.headers['Content-Security-Policy'] = policy
        response.headers['Referrer-Policy'] = 'no-referrer'
        return response

    # A name elsewhere that was made to point here could else read the page.
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=[HOST, 'localhost'])
    ui.run(lambda: Page(session, feed).build(), host=HOST, port=port, show=show, reload=False,
           title='hysteresis studio', favicon='∫', dark=None, tailwind=False,
           show_welcome_message=False, access_log=False)
