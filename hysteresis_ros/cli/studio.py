# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""`hysteresis studio`: a local page on which the error falls under the user's hand."""

from __future__ import annotations

import argparse
import contextlib
import os
from typing import TYPE_CHECKING

from hysteresis_ros.cli.common import (
    add_columns, add_settled, origin, read_all, Subparsers)
from hysteresis_ros.cli.outputs import InputPath, OutputFile, OutputFolder
from hysteresis_ros.errors import ParameterError

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel
    from hysteresis_ros.studio.session import Session

MODEL = 'config/bicep_model.yaml'
# What is looked at where nothing is given: an arm of the virtual laboratory, whose payload nobody
# told the model of.
EXAMPLE, EXAMPLE_FOLDER, SEED = {'payload_error': 1.0}, 'studio_example', 1


def add_parser(subparsers: Subparsers) -> argparse.ArgumentParser:
    """Declare the command."""
    parser = subparsers.add_parser(
        'studio', help='a local page: tick effects, move sliders, watch the error fall',
        description='Serves a page to this machine alone: measurement, prediction and residual, '
        'the catalogue of effects, and a slider for each parameter of those that are ticked. '
        'Every change simulates the recording anew. It diagnoses, fits and saves as the other '
        'commands do, and shows the commands that repeat it. Without --data and --live it makes '
        f'recordings in the virtual laboratory, in {EXAMPLE_FOLDER}/.')
    parser.add_argument('--model', type=InputPath, metavar='M.yaml',
                        help='an identified model (default: the one that comes with the package)')
    parser.add_argument('--data', nargs='+', type=InputPath, default=[], metavar='FILE',
                        help='CSV files or rosbag2 folders')
    parser.add_argument('--test', nargs='+', type=InputPath, default=[], metavar='TEST',
                        help='recordings that are not fitted (default: a quarter of the trials, '
                        'or of the recordings, of --data)')
    parser.add_argument('--live', action='store_true',
                        help='listen to the topics of a running bridge')
    parser.add_argument('--record', type=OutputFile, metavar='R.csv',
                        help='where a live recording is saved (default: live.csv, or the next of '
                        'live_2.csv, live_3.csv, ... that is free)')
    parser.add_argument('--namespace', metavar='NS',
                        help='which arm to take from a bag, or to listen to')
    add_columns(parser)
    add_settled(parser)
    parser.add_argument('-o', '--output', type=OutputFolder, metavar='DIR',
                        help='folder for models and reports (default: this one)')
    parser.add_argument('--port', type=int, metavar='N',
                        help='of the page (default: the next free one from 8080 on)')
    parser.add_argument('--no-browser', action='store_true', help='open no browser')
    return parser


def run(args: argparse.Namespace) -> None:
    """Do it."""
    from hysteresis_ros.api import load_model
    from hysteresis_ros.share import share_path
    from hysteresis_ros.studio import server

    if args.live and (args.data or args.test):
        raise ParameterError('--live makes a recording of its own; leave --data and --test away')
    if args.test and not args.data:
        raise ParameterError('--test: there is nothing to fit; give --data, too')
    args.output = args.output or '.'
    server.require_framework()
    port = server.free_port(args.port)
    path = args.model or str(share_path(MODEL))
    model = load_model(path)
    if args.live:
        live(args, model, path, port)
        return
    session = opened(args, model, path)
    announce(port)
    with contextlib.suppress(KeyboardInterrupt):
        server.serve(session, port, show=not args.no_browser)


def opened(args: argparse.Namespace, model: MuscleModel, path: str) -> Session:
    """Return the session on the recordings that were named, or on an example."""
    from hysteresis_ros.studio.session import Session

    data, test = args.data, args.test
    if not data:
        data, test = example(args.output)
    recordings = read_all([*data, *test], args)
    os.makedirs(args.output, exist_ok=True)
    return Session(model, recordings, model_path=path, unseen=len(test) or None,
                   reading=origin(args).reading, folder=args.output)


def example(output: str) -> tuple[list[str], list[str]]:
    """Make recordings in the virtual laboratory and return those to fit and those not."""
    from hysteresis_ros.laboratory.experiments import write_experiment

    folder = EXAMPLE_FOLDER if output == '.' else os.path.join(output, EXAMPLE_FOLDER)
    train, test = (os.path.join(folder, name) for name in ('train.csv', 'test.csv'))
    if not (os.path.exists(train) and os.path.exists(test)):
        write_experiment('arm-steps', folder, EXAMPLE, SEED)
    return [train], [test]


def live(args: argparse.Namespace, model: MuscleModel, path: str, port: int) -> None:
    """Serve the page of an arm that is running."""
    from hysteresis_ros.studio import server
    from hysteresis_ros.studio.feed import Feed
    from hysteresis_ros.studio.session import Session

    try:
        from hysteresis_ros.nodes.live import Listener
    except ImportError as error:
        raise ParameterError(f'--live needs ROS 2: {error}; source it first') from None
    os.makedirs(args.output, exist_ok=True)
    session = Session(model, [], model_path=path, folder=args.output)
    record = args.record or free_name('live', '.csv')
    with Listener(record, args.namespace) as listener:
        feed = Feed(session, listener.recording, record)
        feed.start()
        announce(port)
        try:
            server.serve(session, port, show=not args.no_browser, feed=feed)
        except KeyboardInterrupt:
            pass
        finally:
            feed.stop()
            if session.ready and not feed.saved:
                print(f'The recording: {feed.save()}')


def free_name(name: str, suffix: str) -> str:
    """Return the first of `name`, `name_2`, ... that is no file yet, with a suffix."""
    number, path = 1, name + suffix
    while os.path.lexists(path):
        number += 1
        path = f'{name}_{number}{suffix}'
    return path


def announce(port: int) -> None:
    """Say where the page is."""
    from hysteresis_ros.studio.server import HOST

    print(f'The page: http://{HOST}:{port}/ (Ctrl-C ends it)', flush=True)
