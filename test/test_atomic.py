# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Files are replaced as a whole, and nothing else changes about them."""

import errno
import os
import stat
import threading

import pytest

from hysteresis_ros.atomic import check_writable, replacing, write_bytes, write_text
from hysteresis_ros.measurements import write_csv


def names(folder):
    """Return the names of all files in a folder, sorted."""
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture
def old(tmp_path):
    """Return a file with content in a folder of its own."""
    (tmp_path / 'folder').mkdir()
    path = tmp_path / 'folder' / 'old.txt'
    path.write_text('old', encoding='utf-8')
    return path


@pytest.mark.parametrize('failure', [ValueError, KeyboardInterrupt, OSError])
def test_a_failure_in_the_middle_leaves_the_old_file_and_no_other(old, failure):
    """As when the content cannot be rendered, or the user interrupts."""
    with pytest.raises(failure):
        with replacing(old) as file:
            file.write('new, but only h')
            file.flush()
            raise failure
    assert old.read_text(encoding='utf-8') == 'old' and names(old.parent) == ['old.txt']


@pytest.mark.skipif(not os.path.exists('/dev/full'), reason='Linux has a full disk to try')
def test_a_full_disk_leaves_the_old_file_and_is_named(old, monkeypatch):
    """The temporary file is put on a device that has no space."""
    opened = os.open
    monkeypatch.setattr(os, 'open', lambda path, flags, mode=0o777: (
        os.close(opened(path, flags, mode)) or opened('/dev/full', os.O_WRONLY)))
    with pytest.raises(OSError) as refused:
        write_text(old, 'new')
    monkeypatch.undo()
    assert (refused.value.errno, refused.value.filename) == (errno.ENOSPC, str(old))
    assert old.read_text(encoding='utf-8') == 'old' and names(old.parent) == ['old.txt']


def test_a_table_that_cannot_be_formatted_leaves_the_old_one(old):
    """The writer of tables fails after the header."""
    with pytest.raises((TypeError, ValueError)):
        write_csv({'a': [1.0, 2.0], 'b': ['x', 'y']}, old)
    assert old.read_text(encoding='utf-8') == 'old' and names(old.parent) == ['old.txt']


@pytest.mark.parametrize('umask', [0o022, 0o077])
def test_a_new_file_has_the_mode_of_a_plain_open(tmp_path, umask):
    """Others may read it where they may read other new files."""
    before = os.umask(umask)
    try:
        write_bytes(tmp_path / 'new', b'x')
        with open(tmp_path / 'plain', 'wb'):
            pass
    finally:
        os.umask(before)
    modes = [stat.S_IMODE(path.stat().st_mode) for path in
             (tmp_path / 'new', tmp_path / 'plain')]
    assert modes[0] == modes[1] == 0o666 & ~umask


def test_an_existing_file_keeps_its_mode(old):
    """A secret stays one."""
    old.chmod(0o640)
    write_text(old, 'new')
    assert stat.S_IMODE(old.stat().st_mode) == 0o640
    assert old.read_text(encoding='utf-8') == 'new' and names(old.parent) == ['old.txt']


@pytest.mark.skipif(os.geteuid() != 0, reason='only root may give files away')
def test_an_existing_file_keeps_its_owner(old):
    """A user can still change the file that an administrator wrote over."""
    os.chown(old, 1234, 1235)
    write_text(old, 'new')
    assert (old.stat().st_uid, old.stat().st_gid) == (1234, 1235)


def test_a_link_keeps_pointing_to_the_file_that_is_replaced(old, tmp_path):
    """Not the link itself is replaced."""
    link = tmp_path / 'link'
    link.symlink_to(old)
    write_text(link, 'new')
    assert link.is_symlink() and old.read_text(encoding='utf-8') == 'new'


def test_a_link_to_a_file_that_is_not_there_makes_it(old, tmp_path):
    """As a plain open does."""
    link = tmp_path / 'link'
    link.symlink_to(old.parent / 'new.txt')
    check_writable(link)
    write_text(link, 'new')
    assert link.is_symlink() and names(old.parent) == ['new.txt', 'old.txt']


def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path):
    """As for process substitution in a shell."""
    pipe = tmp_path / 'pipe'
    os.mkfifo(pipe)
    got = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_text(encoding='utf-8')))
    reader.start()
    check_writable(os.devnull)
    write_text(pipe, 'through')
    reader.join(10.0)
    assert got == ['through'] and stat.S_ISFIFO(pipe.stat().st_mode)


def test_the_longest_name_is_written(tmp_path):
    """The name of the temporary file is no longer than any may be."""
    path = tmp_path / ('ä' * 127)
    check_writable(path)
    write_text(path, 'x')
    assert names(tmp_path) == [path.name]


@pytest.mark.parametrize('name, number', [
    ('none/x', errno.ENOENT), ('old.txt/x', errno.ENOTDIR), ('x' * 256, errno.ENAMETOOLONG),
    ('.', errno.EISDIR)])
@pytest.mark.parametrize('write', [check_writable, lambda path: write_text(path, 'x')])
def test_a_path_that_cannot_be_written_is_an_error_that_names_it(old, name, number, write):
    """Not the temporary file, which a user has never heard of."""
    path = old.parent / name
    with pytest.raises(OSError) as refused:
        write(path)
    assert (refused.value.errno, refused.value.filename) == (number, str(path))
    assert names(old.parent) == ['old.txt']


@pytest.mark.parametrize('write', [check_writable, lambda path: write_text(path, 'x')])
def test_a_file_that_is_read_only_is_not_replaced(old, monkeypatch, write):
    """Though its folder would let it happen."""
    monkeypatch.setattr(os, 'access', lambda path, mode: os.fspath(path) != str(old))
    with pytest.raises(PermissionError) as refused:
        write(old)
    assert refused.value.filename == str(old)
    assert old.read_text(encoding='utf-8') == 'old'


def test_checking_changes_nothing(old):
    """Neither the content nor the folder."""
    check_writable(old)
    check_writable(old.parent / 'new.txt')
    assert old.read_text(encoding='utf-8') == 'old' and names(old.parent) == ['old.txt']
