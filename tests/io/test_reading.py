"""What a user names is read when it is a regular file of sensible size, and refused in one line otherwise."""

import os

import pytest

from rotorjax.errors import InputError
from rotorjax.io import reading
from rotorjax.io.reading import read_bytes, read_text


def test_text_is_utf_8_whatever_the_surroundings(tmp_path):
    (tmp_path / "a").write_bytes("\ufeffΩ = 27\r\nψ\n".encode())
    assert read_text(tmp_path / "a") == "Ω = 27\nψ\n"
    (tmp_path / "a").write_bytes(b"a\nb\n\xe4\n")
    with pytest.raises(InputError, match="must be text in UTF-8, but byte 0xe4 in line 3 is not"):
        read_text(tmp_path / "a")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("pipe", "a pipe"),
        ("", "a folder"),
        ("/dev/zero", "a device"),
        ("none", "No such file"),
        ("x" * 300, "too long"),
        ("a\0b", "null"),
    ],
)
def test_what_is_no_file(tmp_path, name, why):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=why) as caught:
        read_bytes(tmp_path / name)
    assert "\n" not in str(caught.value)


def test_a_file_beyond_sense_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "LARGEST_TEXT", 3)
    (tmp_path / "a").write_text("1234")
    with pytest.raises(InputError, match="at most 3 bytes, but has 4"):
        read_text(tmp_path / "a")
