"""No file is lost to an output: a reader finds the old file, or the whole new one."""

import os
import re
import threading

import pytest

from asympk.errors import InputError
from asympk.storage.files import named_file, read_bytes, write_bytes, write_text


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt("disk full")])
def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path, monkeypatch, failure):
    target = write_text(tmp_path / "table.tex", "old")
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(failure))
    with pytest.raises(type(failure), match="disk full"):
        write_text(target, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["table.tex"]
    assert target.read_text() == "old"


def test_an_output_replaces_a_file_and_what_a_link_leads_to(tmp_path):
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    real.write_text("old")
    link.symlink_to(real)
    write_text(link, "new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.txt", "real.txt"]


def test_an_output_into_a_pipe_goes_to_its_reader_and_leaves_the_pipe(tmp_path):
    pipe, content, got = tmp_path / "pipe", bytes(range(256)) * 4096, []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    handle = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    reader.start()
    write_bytes(pipe, content)
    os.close(handle)
    reader.join(10)
    assert got == [content]
    assert pipe.is_fifo()


def test_an_output_into_a_pipe_that_nobody_reads_is_an_error_and_no_wait(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="No such device"):
        write_bytes(tmp_path / "pipe", b"a")
    with pytest.raises(InputError, match="it is a directory"):
        write_bytes(tmp_path, b"a")


def test_a_device_stays_a_device():
    write_text("/dev/null", "text")
    assert not os.path.isfile("/dev/null")
    with pytest.raises(OSError, match="No space"):
        write_text("/dev/full", "text")


def test_writing_a_file_asks_nothing_of_the_process_mask(tmp_path, monkeypatch):
    before = os.umask(0o027)
    try:
        monkeypatch.setattr(os, "umask", None)
        assert write_text(tmp_path / "a.txt", "a").stat().st_mode & 0o777 == 0o640
    finally:
        monkeypatch.undo()
        os.umask(before)


def test_no_more_of_a_file_is_read_than_is_asked_for(tmp_path):
    path = write_bytes(tmp_path / "long.bin", b"0123456789")
    assert (read_bytes(path, 4), read_bytes(path, 99)) == (b"0123", b"0123456789")
    with pytest.raises(FileNotFoundError) as raised:
        read_bytes(tmp_path / "none.bin", 1)
    assert raised.value.filename == str(tmp_path / "none.bin")


@pytest.mark.parametrize("file", [3, None, "a\0b", "\ud800.csv"])
def test_what_is_no_name_of_a_file_is_refused(file):
    """A zero in a name was a ValueError of Python, and half of a pair of surrogates a UnicodeEncodeError."""
    with pytest.raises(InputError, match=re.escape(f"file = {file!r}: it must be the name of a file")):
        named_file(file)
