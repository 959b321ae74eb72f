"""Any bytes are TOML, or refused as such, with a word on quotes."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asympk.errors import InputError
from asympk.storage.tomlfile import parse_table


@settings(max_examples=300)
@given(raw=st.one_of(st.binary(max_size=200), st.text(max_size=200).map(lambda s: s.encode("utf-8", "replace"))))
@pytest.mark.slow
def test_any_bytes_are_read_or_refused(raw):
    try:
        table = parse_table(raw, "file")
    except InputError as refusal:
        assert str(refusal).startswith("file: not TOML")  # noqa: PT017
    else:
        assert isinstance(table, dict)


@pytest.mark.parametrize("line", ["alpha = 30 deg", "x' = 1", "\"x' = 1", "friction = mu"])
def test_of_text_or_a_prime_without_quotes_is_told_that_they_stand_in_quotes(line):
    with pytest.raises(InputError, match=r"""at line 1, .*stand in quotes, such as "75 deg" and "x'"$"""):
        parse_table(f"{line}\n".encode(), "file")


def test_of_a_key_given_twice_nothing_is_told_of_quotes():
    with pytest.raises(InputError, match=r"Cannot overwrite a value \(at line 2, column \d\)$"):
        parse_table(b"m = 1\nm = 2\n", "file")
