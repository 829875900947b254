"""The examples and the page about Python, as they stand there."""

import importlib.util
import os
import re
import subprocess
import sys

import pytest
from conftest import ROOT

EXAMPLES = ROOT / "examples/python"


def losses_of(program, folder):
    """The losses that a short run of an example prints."""
    picture = folder / "fit.png"
    options = ["--iterations", "6", "--size", "16", "--spp", "8", "--picture", picture]
    done = subprocess.run(
        [sys.executable, EXAMPLES / program, *map(str, options)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert done.returncode == 0, done.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")
    return [float(loss) for loss in re.findall(r"loss (\S+)", done.stdout)]


def test_a_painting_and_a_vase_are_fitted(tmp_path):
    losses = losses_of("fit.py", tmp_path)
    assert losses[-1] < 0.5 * losses[0]


def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(EXAMPLES / "fit.ipynb", as_version=4)
    place = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=place).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 4


def test_the_code_of_the_page_runs(tmp_path, monkeypatch):
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/python.md").read_text()
    code = re.findall(r"```python\n(.*?)```", page, re.S)
    assert len(code) > 1
    names = {}
    for block in code:
        if "torch" not in block or importlib.util.find_spec("torch"):
            exec(compile(block, "docs/python.md", "exec"), names)
