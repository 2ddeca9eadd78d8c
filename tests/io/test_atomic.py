"""Files are whole or not there, whatever happens to the process, the disk and the path."""

import json
import os
import platform
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from rotorjax.errors import InputError
from rotorjax.io.atomic import check_output, make_folder, write_bytes, write_json, write_text


def test_failed_write_leaves_the_old_file_and_no_other(tmp_path, monkeypatch):
    path = tmp_path / "a.txt"
    write_text(path, "old")

    def interrupted(self, content):
        self.touch()
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_text(path, "half")
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def part(name, process):
    """Name of the temporary file that a process on this machine writes."""
    key, machine = (f"{zlib.crc32(text.encode()):08x}" for text in (name, platform.node()))
    return f".{key}-{machine}-{process}.part"


def test_what_a_killed_run_left_is_removed_and_what_a_living_one_writes_is_not(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    theirs = tmp_path / part("a.txt", os.getppid())
    for left in (tmp_path / part("a.txt", ended.pid), theirs):
        left.write_text("half")
    write_text(tmp_path / "a.txt", "whole")
    assert {p.name for p in tmp_path.iterdir()} == {"a.txt", theirs.name}


KILLED = """
import os, signal, sys
from pathlib import Path
from rotorjax.io.atomic import write_bytes
write_bytes(sys.argv[1], b"old")
write = Path.write_bytes
def half(self, content):
    write(self, content[:3])
    os.kill(os.getpid(), signal.SIGKILL)
Path.write_bytes = half
write_bytes(sys.argv[1], b"new content")
"""


def test_a_kill_in_the_middle_of_a_write_costs_nothing(tmp_path):
    path = tmp_path / "a.txt"
    assert subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False).returncode == -9
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 2
    write_bytes(path, b"new content")
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


FULL = """
import resource, sys
import numpy as np, xarray as xr
from rotorjax.bench import plotting
from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_text
data = xr.Dataset({"a": ("x", np.random.default_rng(0).normal(size=4000))})
figure = plotting.new_figure()
figure.add_subplot().plot([0, 1])
resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048))
writers = [(netcdf.write, "a.nc", data), (write_text, "a.txt", "x" * 4000), (plotting.save_file, figure, "a.png")]
for write, *arguments in writers:
    try:
        write(*arguments)
    except InputError as error:
        print(error)
"""


def test_a_full_disk_is_one_line_for_each_format(tmp_path):
    run = subprocess.run([sys.executable, "-c", FULL], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert [line.split(":")[0] for line in run.stdout.splitlines()] == ["a.nc", "a.txt", "a.png"]
    assert run.stdout.count("must be writable, but is not: File too large") == 3
    assert not list(tmp_path.iterdir())


def test_what_is_no_regular_file_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_json(pipe, {"a": 1})
    assert json.loads(os.read(reader, 100)) == {"a": 1}
    os.close(reader)
    assert pipe.is_fifo()
    write_text("/dev/null", "gone")
    assert Path("/dev/null").is_char_device()


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "text"


def test_a_new_file_is_as_readable_as_any_other(tmp_path):
    (tmp_path / "other").touch()
    write_text(tmp_path / "a", "")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "other").stat().st_mode


@pytest.mark.parametrize("name", ["", "x" * 300, "a\0b", "file/b"])
def test_paths_that_cannot_be_written_are_refused_before_the_work(tmp_path, name):
    (tmp_path / "file").touch()
    path = f"{tmp_path}/{name}"
    for refuse in (check_output, lambda p: write_text(p, "")):
        with pytest.raises(InputError, match=r"must be") as caught:
            refuse(path)
        assert "\n" not in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_folders_are_made_for_what_can_be_written(tmp_path):
    check_output(None)
    check_output("/dev/null")
    check_output(tmp_path / "new" / "a.json")
    assert (tmp_path / "new").is_dir()


def test_json_is_strict(tmp_path):
    write_json(tmp_path / "a.json", {"a": float("nan"), "b": [1, float("inf")], "c": None, "d": True})
    text = (tmp_path / "a.json").read_text()
    assert json.loads(text, parse_constant=pytest.fail) == {"a": None, "b": [1, None], "c": None, "d": True}


def test_folder_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="the output folder must be writable") as caught:
        make_folder(tmp_path / "file" / "folder")
    assert "\n" not in str(caught.value)


def test_missing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="must be writable, but is not: No such file"):
        write_text(tmp_path / "no" / "a.txt", "")
