"""The pages for Python: their code runs, block after block."""

import re
import shutil

import pytest
from conftest import REPOSITORY

PAGES = sorted((REPOSITORY / "docs" / "python").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page, frame, tmp_path, monkeypatch):
    shutil.copy(frame, tmp_path / "night.tif")
    (tmp_path / "nights").mkdir()
    for night in range(3):
        shutil.copy(frame, tmp_path / "nights" / f"{night}.tif")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)
    assert blocks
    code = "\n".join(blocks)
    exec(compile(code, str(page), "exec"), {})
