"""Compiled programs are kept where only their owner writes, and used only if they are what they were."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rotorjax.io import program_cache
from rotorjax.io.program_cache import clean, opened, seal, trim


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = opened()
    assert found is not None
    for name in ("a", "b", "c"):
        (found / f"jit_{name}-0-cache").write_bytes(name.encode() * 100)
    seal(found, settled=0.0)
    return found


def kept(folder):
    return sorted(p.name[4] for p in folder.glob("*-cache"))


def test_sealed_programs_are_kept(folder):
    assert opened() == folder
    assert kept(folder) == ["a", "b", "c"]


def exchange(folder):
    a, b = folder / "jit_a-0-cache", folder / "jit_b-0-cache"
    both = a.read_bytes(), b.read_bytes()
    b.write_bytes(both[0]), a.write_bytes(both[1])


def exchange_with_seals(folder):
    for ending in ("-cache", "-cache.sha256"):
        a, b, c = (folder / f"jit_{name}-0{ending}" for name in "abx")
        a.rename(c), b.rename(a), c.rename(b)


DAMAGE = {
    "truncated": (lambda f: (f / "jit_a-0-cache").write_bytes(b"a"), ["b", "c"]),
    "garbled": (lambda f: (f / "jit_a-0-cache").write_bytes(b"x" * 100), ["b", "c"]),
    "exchanged": (exchange, ["c"]),
    "exchanged with their seals": (exchange_with_seals, ["c"]),
    "left by a killed run": (lambda f: (f / "jit_d-0-cache").write_bytes(b"d"), ["a", "b", "c"]),
    "removed": (lambda f: (f / "jit_a-0-cache").unlink(), ["b", "c"]),
    "without its seal": (lambda f: (f / "jit_a-0-cache.sha256").unlink(), ["b", "c"]),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_what_is_not_as_it_was_is_removed_before_it_is_used(folder, what):
    damage, left = DAMAGE[what]
    damage(folder)
    clean(folder)
    assert kept(folder) == left
    assert len(list(folder.iterdir())) == 2 * len(left)


def test_a_program_that_is_still_being_written_is_not_sealed(folder):
    (folder / "jit_d-0-cache").write_bytes(b"d")
    seal(folder)
    assert not (folder / "jit_d-0-cache.sha256").exists()
    os.utime(folder / "jit_d-0-cache", (time.time() - 9, time.time() - 9))
    seal(folder)
    assert (folder / "jit_d-0-cache.sha256").exists()


def test_the_oldest_go_first(folder):
    for age, name in enumerate("bca"):
        os.utime(folder / f"jit_{name}-0-cache", (1e9 - age, 1e9 - age))
    trim(folder.parent, 250)
    assert kept(folder) == ["b", "c"]
    assert len(list(folder.iterdir())) == 4


def test_only_the_owner_can_write(folder):
    assert folder.stat().st_mode & 0o777 == 0o700
    assert folder.parent.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("parent", [False, True])
def test_a_folder_that_others_can_write_is_refused_in_one_line(folder, capsys, parent):
    (folder.parent if parent else folder).chmod(0o777)
    assert opened() is None
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "must be writable by its owner alone" in told
    assert kept(folder) == ["a", "b", "c"]


def test_a_link_in_its_place_is_refused(folder, tmp_path, capsys):
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    assert opened() is None
    assert "no link" in capsys.readouterr().err


def test_without_a_home_or_where_nothing_can_be_written_there_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)

    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert opened() is None
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert opened() is None
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 2
    assert all("compiled programs are not kept" in line for line in told)
    assert "home directory" in told[0]
    assert "Not a directory" in told[1]


def test_the_key_tells_processor_versions_and_flags(monkeypatch):
    keys = {program_cache.key()}
    monkeypatch.setenv("XLA_FLAGS", "--other")
    keys.add(program_cache.key())
    monkeypatch.setattr(program_cache, "_processor", lambda: "another")
    keys.add(program_cache.key())
    monkeypatch.setattr(program_cache, "version", lambda name: "9.9")
    keys.add(program_cache.key())
    assert len(keys) == 4


WORK = """
import jax, sys
from rotorjax import cli
folder = cli._set_up_jax()
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
print(float(jax.jit(lambda x: x * {factor})(2.0)))
from rotorjax.io import program_cache
program_cache.seal(folder, settled=0.0)
"""


def test_exchanged_programs_give_no_wrong_numbers(tmp_path):
    """Jax alone takes the one for the other and prints 6 for 10 and 10 for 6."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("JAX_")} | {"XDG_CACHE_HOME": str(tmp_path)}

    def printed(factor):
        code = WORK.format(factor=factor)
        return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout

    assert [printed(3), printed(5)] == ["6.0\n", "10.0\n"]
    a, b = sorted(p for p in tmp_path.glob("rotorjax/programs/*/*-cache") if "lambda" in p.name)
    both = a.read_bytes(), b.read_bytes()
    b.write_bytes(both[0]), a.write_bytes(both[1])
    assert [printed(3), printed(5)] == ["6.0\n", "10.0\n"]
