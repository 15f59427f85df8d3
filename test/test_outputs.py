# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""No command writes over what it reads, and what cannot be written is said before any work."""

import argparse
import os

import pytest

from hysteresis_ros.cli import demo
from hysteresis_ros.cli.main import build_parser, COMMANDS, main
from hysteresis_ros.cli.outputs import InputPath, OutputFile, OutputFileOrStdout, OutputFolder

PATHS = (InputPath, OutputFile, OutputFileOrStdout, OutputFolder)
# Text that names no file, with a value that the parser takes.
WORDS = {'namespace': 'left', 'add': 'payload_error', 'effects': 'none', 'protocol': 'bench',
         'name': 'creep', 'hidden': 'creep', 'muscle': 'grains', 'port': 'avr://'}


def options(command):
    """Return the arguments that a command declares, without those that take no value."""
    parser = build_parser([command])
    chosen = next(action for action in parser._actions
                  if isinstance(action, argparse._SubParsersAction))
    return [action for action in chosen.choices[command]._actions if action.nargs != 0]


def of_kind(command, *kinds):
    """Return the names of a command's options of some kinds."""
    return [action.option_strings[-1] for action in options(command) if takes(action, kinds)]


def takes(action, kinds):
    """Whether an option's type is one of some kinds of path."""
    return isinstance(action.type, type) and issubclass(action.type, kinds)


def arguments(command, tmp_path, paths):
    """
    Return a command line with all inputs and all that is required.

    Inputs are files that no reader takes, so a line about an output shows that it came first.
    """
    words = [command]
    for action in options(command):
        name = (action.option_strings or [''])[-1]
        if name in paths:
            value = paths[name]
        elif takes(action, InputPath):
            value = tmp_path / f'{name[2:]}.input'
            value.write_bytes(b'precious')
        elif action.required and takes(action, PATHS):
            value = tmp_path / 'new'
        elif action.required:
            value = WORDS[action.dest]
        else:
            continue
        words += [name, str(value)] if name else [str(value)]
    return words


def refused(words, capsys):
    """Run a command that has to fail, and return its only line."""
    capsys.readouterr()
    assert main(words) == 1
    captured = capsys.readouterr()
    assert captured.out == '' and captured.err.count('\n') == 1
    return captured.err


def forbid(monkeypatch, folder):
    """Take the right to make files in a folder away, also from root."""
    opened = os.open

    def checked(path, *rest):
        if os.path.dirname(path) == str(folder):
            raise PermissionError(13, 'Permission denied', path)
        return opened(path, *rest)
    monkeypatch.setattr('hysteresis_ros.atomic.os.open', checked)


def test_every_option_that_takes_text_says_whether_it_is_read_or_written():
    """A new option without a mark fails here: give it a type of cli/outputs.py."""
    unmarked = [f'{command} {action.option_strings or action.dest}' for command in COMMANDS
                for action in options(command) if action.type in (None, str)
                and not action.choices and action.dest not in WORDS]
    assert unmarked == []


def test_the_outputs_of_all_commands_are_known():
    """The marks that the checks of this file walk over are there."""
    written = {command: set(of_kind(command, *PATHS[1:])) for command in COMMANDS}
    assert written['compare'] == {'--json', '--report', '--plots'}
    assert written['diagnose'] == {'--json', '--report'}
    assert written['extend'] == {'--output', '--json', '--report'}
    assert written['identify'] == {'--output', '--json'}
    assert written['invert'] == written['predict'] == written['simulate'] == {'--output'}
    assert written['demo'] == {'--output', '--json'}
    assert written['table1'] == written['effects'] == {'--json'}
    assert of_kind('identify', InputPath) == ['--force', '--length', '--geometry']


PAIRS = [(command, output, read) for command in COMMANDS
         for output in of_kind(command, *PATHS[1:]) for read in of_kind(command, InputPath)]


@pytest.mark.parametrize('way', ['same', 'relative', 'link', 'hard link'])
@pytest.mark.parametrize('command, output, read', PAIRS)
def test_an_input_is_never_an_output(tmp_path, monkeypatch, capsys, command, output, read, way):
    """Whatever the name under which it is given."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f'{read[2:]}.input'
    path.write_bytes(b'precious')
    given = {'same': path, 'relative': os.path.join('..', tmp_path.name, path.name),
             'link': tmp_path / 'link', 'hard link': tmp_path / 'hard'}[way]
    if way == 'link':
        given.symlink_to(path)
    elif way == 'hard link':
        os.link(path, given)
    line = refused(arguments(command, tmp_path, {output: given}), capsys)
    assert f'error: {output} {given}: would overwrite the input {read} {path}' in line
    assert path.read_bytes() == b'precious'
    assert ('rename it' if read == '--model' else 'name another file') in line


@pytest.mark.parametrize('command, output, read', PAIRS)
def test_nothing_is_written_into_a_recording_that_is_read(
        tmp_path, capsys, command, output, read):
    """A file more or less would change the recording, or end its being one."""
    bag = tmp_path / 'bag'
    bag.mkdir()
    for name in ('metadata.yaml', 'bag_0.mcap'):
        (bag / name).write_bytes(b'precious')
    for given, target in ((bag, bag / 'metadata.yaml'), (bag, bag / 'new'),
                          (bag / 'bag_0.mcap', bag / 'metadata.yaml')):
        line = refused(arguments(command, tmp_path, {output: target, read: given}), capsys)
        assert f'{output} {target}: lies in the folder of the recording {read} {given}' in line
    assert sorted(path.name for path in bag.iterdir()) == ['bag_0.mcap', 'metadata.yaml']


def test_a_table_beside_the_output_is_no_recording(tmp_path, capsys):
    """Only a bag's storage file stands for its whole folder."""
    (tmp_path / 'metadata.yaml').write_text('of something else', encoding='utf-8')
    words = arguments('compare', tmp_path, {'--report': tmp_path / 'r.html'})
    assert 'model' in refused(words, capsys)


@pytest.mark.parametrize('command, one, other', [
    (command, one, other) for command in COMMANDS for one in of_kind(command, *PATHS[1:])
    for other in of_kind(command, *PATHS[1:]) if one < other])
def test_two_outputs_never_share_a_path(tmp_path, capsys, command, one, other):
    """The second would replace the first."""
    path = tmp_path / 'both'
    line = refused(arguments(command, tmp_path, {one: path, other: path}), capsys)
    assert 'is also written by' in line and one in line and other in line
    assert not path.exists()


@pytest.mark.parametrize('command, output', [
    (command, output) for command in COMMANDS
    for output in of_kind(command, OutputFile, OutputFileOrStdout)])
def test_a_file_that_cannot_be_written_is_said_before_any_work(
        tmp_path, monkeypatch, capsys, command, output):
    """No folder, a folder in its place, a file as folder, a full name, no permission."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'folder').mkdir()
    (tmp_path / 'file').write_bytes(b'precious')
    for given, words in (('none/new', 'the folder none does not exist; make it first'),
                         ('folder', 'is a folder; name a file'), ('.', 'is a folder'),
                         ('file/new', 'file is a file, not a folder'),
                         ('x' * 256, 'cannot be written (File name too long)'),
                         ('', 'the path is empty')):
        line = refused(arguments(command, tmp_path, {output: given}), capsys)
        assert f'error: {output}' in line and words in line

    forbid(monkeypatch, tmp_path / 'folder')
    line = refused(arguments(command, tmp_path, {output: 'folder/new'}), capsys)
    assert f'{output} folder/new: cannot be written (Permission denied)' in line
    assert (tmp_path / 'file').read_bytes() == b'precious'


@pytest.mark.parametrize('command, output', [
    (command, output) for command in COMMANDS for output in of_kind(command, OutputFolder)])
def test_a_folder_that_cannot_be_made_is_said_before_any_work(
        tmp_path, monkeypatch, capsys, command, output):
    """A file in its place, or no permission above it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'file').write_bytes(b'precious')
    for given in ('file', 'file/new/newer'):
        line = refused(arguments(command, tmp_path, {output: given}), capsys)
        assert f'{output} {given}: file is a file; name a folder' in line

    forbid(monkeypatch, tmp_path)
    line = refused(arguments(command, tmp_path, {output: 'new/newer'}), capsys)
    assert f'{output} new/newer: cannot be written (Permission denied)' in line
    assert not (tmp_path / 'new').exists()


def test_a_file_in_a_folder_of_outputs_is_protected_under_its_name(tmp_path, capsys):
    """A picture's name may be a link to an input, or that of another output."""
    folder = tmp_path / 'pictures'
    folder.mkdir()
    paths = {'--plots': folder, '--report': folder / 'loop.png'}
    line = refused(arguments('compare', tmp_path, paths), capsys)
    assert 'is also written by' in line and '--plots' in line and '--report' in line
    del paths['--report']
    (folder / 'loop.png').symlink_to(tmp_path / 'model.input')
    line = refused(arguments('compare', tmp_path, paths), capsys)
    assert f'--plots {folder / "loop.png"}: would overwrite the input --model' in line
    assert (tmp_path / 'model.input').read_bytes() == b'precious'
    line = refused(arguments('demo', tmp_path, {
        '--output': tmp_path / 'demo', '--json': tmp_path / 'demo' / 'model.yaml'}), capsys)
    assert 'is also written by' in line and not (tmp_path / 'demo').exists()


def test_an_older_output_is_written_over(tmp_path):
    """What a command has written before, it may write again; a device takes anything."""
    path = tmp_path / 'e.json'
    for _ in range(2):
        assert main(['effects', '--json', str(path)]) == 0
    assert path.read_text(encoding='utf-8').startswith('{')
    assert main(['effects', '--json', os.devnull]) == 0
    assert [entry.name for entry in tmp_path.iterdir()] == ['e.json']


def test_standard_output_is_no_file(tmp_path, monkeypatch, capsys):
    """`--json -` neither needs a folder nor makes a file."""
    monkeypatch.chdir(tmp_path)
    assert main(['effects', 'creep', '--json', '-']) == 0
    assert capsys.readouterr().out.startswith('{') and list(tmp_path.iterdir()) == []


@pytest.fixture
def laboratory(monkeypatch):
    """Let the demo end where it would begin to identify."""
    class Enough(Exception):
        """Raised instead of the work."""

    def end(args, folder):
        raise Enough
    monkeypatch.setattr(demo, 'bench_model', end)
    return Enough


def test_the_demo_replaces_its_own_files_and_no_others(tmp_path, laboratory):
    """Notes that a user has put beside its results stay."""
    folder = tmp_path / 'demo'
    with pytest.raises(laboratory):
        main(['demo', '-o', str(folder), '--json', str(folder / 'result.json')])
    (folder / 'model.yaml').write_text('old', encoding='utf-8')
    (folder / 'run').mkdir()
    (folder / 'run' / 'run.mcap').write_bytes(b'old')
    (folder / 'notes.txt').write_text('precious', encoding='utf-8')
    with pytest.raises(laboratory):
        main(['demo', '-o', str(folder)])
    assert sorted(path.name for path in folder.iterdir()) == [demo.MARK, 'notes.txt']


def test_the_demo_leaves_a_folder_with_a_model_alone(tmp_path, laboratory, capsys):
    """Such as the one in which the README's commands were typed."""
    for name in ('model.yaml', 'train.csv'):
        (tmp_path / name).write_text('precious', encoding='utf-8')
    assert 'not empty and not a demo' in refused(['demo', '-o', str(tmp_path)], capsys)
    assert {path.name: path.read_text(encoding='utf-8') for path in tmp_path.iterdir()} == {
        'model.yaml': 'precious', 'train.csv': 'precious'}
