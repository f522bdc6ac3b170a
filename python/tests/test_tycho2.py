"""The data package starpipe-tycho2: it is built, installed, and found by the program."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
SCRIPT = REPOSITORY / "scripts" / "build-tycho2-wheel"


def _build(program, directory):
    """Build the package from a small table that stands for Tycho-2."""
    table = REPOSITORY / "catalogs" / "sky2000-bright.csv"
    command = [sys.executable, SCRIPT, table, directory, "--starpipe", program]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = directory.glob("starpipe_tycho2-*-py3-none-any.whl")
    return wheel


def test_the_same_catalog_gives_the_same_bytes(program, tmp_path):
    first, again = (_build(program, tmp_path / name) for name in ["first", "again"])
    assert first.read_bytes() == again.read_bytes()


@pytest.mark.skipif(os.name == "nt", reason="links need permission there")
def test_the_program_finds_the_catalog_beside_it(program, tmp_path):
    wheel = _build(program, tmp_path)
    prefix = tmp_path.resolve() / "prefix"
    # pip compares the files with the hashes in the wheel.
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*pip, "--no-deps", "--no-index", "--prefix", prefix, wheel], check=True)
    catalogs = prefix / "share" / "starpipe" / "catalogs"
    assert (catalogs / "tycho2.cat").is_file()
    called = prefix / "bin" / "starpipe"
    called.parent.mkdir(exist_ok=True)
    called.symlink_to(Path(program).resolve())
    environment = {**os.environ, "XDG_DATA_HOME": str(tmp_path)}
    environment.pop("STARPIPE_CATALOGS", None)

    def info(command, **more):
        ran = subprocess.run(
            [command, "catalog", "info"],
            check=True,
            capture_output=True,
            text=True,
            env={**environment, **more},
        )
        return ran.stdout

    assert f"{catalogs}: " in info(called)
    # As a shell calls it.
    path = f"{called.parent}{os.pathsep}{environment.get('PATH', '')}"
    assert f"{catalogs}: " in info("starpipe", PATH=path)
    assert f"{catalogs}: " not in info(called, STARPIPE_CATALOGS="")
