"""The pages for Python: their code runs, block after block."""

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from astropy.io import fits
from conftest import REPOSITORY
from PIL import Image

PAGES = [
    *sorted((REPOSITORY / "docs" / "python").glob("*.md")),
    REPOSITORY / "docs/doors/tetra3.md",
    REPOSITORY / "python/README.md",
]


def code_of(page):
    """Return the code of all blocks of a page."""
    blocks = re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)
    assert blocks
    return "\n".join(blocks)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page, frame, tmp_path, monkeypatch):
    shutil.copy(frame, tmp_path / "night.tif")
    pixels = np.array(Image.open(frame))
    fits.PrimaryHDU(pixels[::-1].copy()).writeto(tmp_path / "night.fits")
    (tmp_path / "nights").mkdir()
    for night in range(3):
        shutil.copy(frame, tmp_path / "nights" / f"{night}.tif")
    monkeypatch.chdir(tmp_path)
    exec(compile(code_of(page), str(page), "exec"), {})


def test_the_code_of_the_pages_has_the_right_types(tmp_path):
    pytest.importorskip("mypy")
    for page in PAGES:
        (tmp_path / f"{page.stem.replace('-', '_')}.py").write_text(code_of(page))
    settings = ["--config-file", str(REPOSITORY / "python" / "pyproject.toml"), "--strict"]
    # The pages have frames that are identified, which a type does not say.
    settings += ["--no-strict-optional"]
    command = [sys.executable, "-m", "mypy", *settings, *map(str, tmp_path.glob("*.py"))]
    checked = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout + checked.stderr
