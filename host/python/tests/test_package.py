"""Stubs, docstrings and notebooks."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import rig_dynamics as rig
from rig_dynamics import _native

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))


def test_the_stub_matches_the_library():
    pytest.importorskip("mypy")
    run = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "rig_dynamics"], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr


def documented(path):
    """Return the docstrings of a stub by qualified name."""
    docs = {}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            docs[node.name] = ast.get_docstring(node)
        if isinstance(node, ast.ClassDef):
            for own in (own for own in node.body if isinstance(own, ast.FunctionDef)):
                docs[f"{node.name}.{own.name}"] = ast.get_docstring(own)
    return {name: text for name, text in docs.items() if text}


def test_docstrings_are_the_same_in_the_stub_and_at_run_time():
    stub = documented(Path(rig.__file__).parent / "_native.pyi")
    assert len(stub) > 80
    for name, text in stub.items():
        own = _native
        for part in name.split("."):
            own = inspect.getattr_static(own, part)
        own = getattr(own, "__func__", own)
        assert inspect.getdoc(own) == text, name


def test_every_public_name_is_exported():
    public = {name for name in vars(_native) if not name.startswith("_")}
    assert public == set(rig.__all__)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_the_notebooks_run_and_are_stored_without_output(path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    for cell in book.cells:
        assert cell.cell_type != "code" or (cell.outputs == [] and cell.execution_count is None)
    nbclient.NotebookClient(book, timeout=300, kernel_name="python3").execute()


def test_there_are_two_notebooks():
    assert len(NOTEBOOKS) == 2
