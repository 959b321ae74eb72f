import os
from pathlib import Path

import pytest

from asympk.storage.files import csv_text, named_file, read_bytes, write_bytes, write_text


def test_rows_of_cells_are_lines_that_end_alike_on_every_system():
    assert csv_text([["x", "a, b"], [1, 'said "no"']]) == 'x,"a, b"\n1,"said ""no"""\n'


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_write_that_fails_keeps_the_file_as_it_was_and_leaves_no_other(tmp_path, monkeypatch, failure):
    kept = write_text(tmp_path / "rows.csv", "before")

    def fails(*paths):
        raise failure

    monkeypatch.setattr(os, "replace", fails)
    with pytest.raises(type(failure)) as raised:
        write_text(kept, "after")
    assert [*tmp_path.iterdir()] == [kept]
    assert kept.read_text() == "before"
    if isinstance(failure, OSError):
        assert raised.value.filename == str(kept)


def test_a_file_behind_a_link_is_replaced_and_the_link_stays(tmp_path):
    target, link = tmp_path / "rows.csv", tmp_path / "link.csv"
    target.write_text("before")
    link.symlink_to(target)
    assert write_text(link, "after") == link
    assert link.is_symlink()
    assert target.read_text() == "after"


def test_a_file_is_written_into_folders_that_are_made_for_it(tmp_path):
    assert write_bytes(str(tmp_path / "a" / "b" / "c.bin"), b"\x00").read_bytes() == b"\x00"


def test_no_more_of_a_file_is_read_than_is_asked_for(tmp_path):
    path = write_bytes(tmp_path / "long.bin", b"0123456789")
    assert (read_bytes(path, 4), read_bytes(path, 99)) == (b"0123", b"0123456789")
    with pytest.raises(FileNotFoundError) as raised:
        read_bytes(tmp_path / "none.bin", 1)
    assert raised.value.filename == str(tmp_path / "none.bin")


@pytest.mark.parametrize(("file", "said"), [(3, "file = 3: it must be the name of a file"), (None, "file = None")])
def test_what_is_no_name_of_a_file_is_refused(file, said):
    with pytest.raises(ValueError, match=said):
        named_file(file)
    assert named_file("a.csv") == Path("a.csv")
