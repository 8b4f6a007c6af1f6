"""The README's examples and the notebook run; types are those of the stubs."""

from __future__ import annotations

import pathlib
import re
import shutil
import subprocess
import sys

import pytest

import imucal

HERE = pathlib.Path(__file__).parents[1]
EXAMPLES = re.findall(r"```python\n(.*?)```", (HERE / "README.md").read_text(), re.DOTALL)


def test_the_readme_has_examples() -> None:
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("example", EXAMPLES)
def test_each_example_of_the_readme_runs(
    example: str, folder: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in folder.iterdir():
        shutil.copy(path, tmp_path)
    log = "".join(f"{10 * k},{0.001 * (k % 3)},0,1,{k % 5},0,0\n" for k in range(500))
    (tmp_path / "log.csv").write_text("timestamp_ms,ax,ay,az,gx,gy,gz\n" + log)
    imucal.calibrate(imucal.read(tmp_path / "rig.csv.gz"), accept_suspect=True).write_toml(tmp_path / "cal.toml")
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})


def test_the_notebook_runs(tmp_path: pathlib.Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(HERE / "notebook.ipynb", as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert any("acc.lever_arm" in output.get("text", "") for output in outputs)


@pytest.mark.parametrize(
    "command",
    [["mypy", "imucal", "tests", "recipes"], ["mypy.stubtest", "imucal._native"], ["mypy.stubtest", "imucal"]],
)
def test_types_are_those_of_the_stubs(command: list[str], tmp_path: pathlib.Path) -> None:
    module, *arguments = command
    if module == "mypy":
        arguments += ["--cache-dir", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments], cwd=HERE, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_says_that_it_is_typed() -> None:
    assert (pathlib.Path(imucal.__file__).parent / "py.typed").is_file()
