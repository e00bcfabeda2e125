"""The package as a whole: types, examples, documents, exports."""

import ast
import doctest
import inspect
import os
import pathlib
import re
import runpy
import subprocess
import sys

import pytest

import photocoag as pc

from conftest import ROOT

EXAMPLES = sorted((ROOT / "python/examples").glob("*.py"))
PACKAGE = pathlib.Path(pc.__file__).parent


def test_examples_and_package_pass_strict_typing(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--disable-error-code=import-untyped", "--cache-dir", str(tmp_path),
         *map(str, EXAMPLES), str(PACKAGE)],
        capture_output=True, text=True, check=False, cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(PACKAGE.parent)},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stub_names_what_is_compiled():
    """Functions, classes and their members, in both directions."""
    core = sys.modules["photocoag._core"]
    stub = ast.parse((PACKAGE / "_core.pyi").read_text()).body

    def names(body):
        for node in body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                yield node.name
            elif isinstance(node, ast.AnnAssign):
                yield node.target.id

    def public(thing):
        return {name for name in vars(thing) if not name.startswith("_")}

    assert set(names(stub)) == public(core)
    for node in stub:
        if isinstance(node, ast.ClassDef):
            assert {n for n in names(node.body) if n != "__init__"} == public(getattr(core, node.name)), node.name


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda file: file.stem)
def test_examples_run(example, capsys):
    runpy.run_path(str(example), run_name="__main__")
    assert "K" in capsys.readouterr().out


@pytest.mark.parametrize("module", ["photocoag", "photocoag.envs", *(f"photocoag.{f.stem}" for f in PACKAGE.glob("_[a-z]*.py"))])
def test_docstrings_are_true(module):
    __import__(module)
    failed, _ = doctest.testmod(sys.modules[module], optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0


def test_what_is_public_is_documented():
    for name in pc.__all__:
        if name.startswith("__"):
            continue
        thing = getattr(pc, name)
        assert inspect.getdoc(thing), name
        if inspect.isfunction(thing):
            assert ">>>" in thing.__doc__ or name in ("treat", "campaign", "reproduce", "reduce"), name


@pytest.mark.parametrize(("document", "blocks"), [("README.md", 1), ("docs/python.md", 3)])
def test_the_documents_python_runs(document, blocks):
    found = re.findall(r"```python\n(.*?)```", (ROOT / document).read_text(), re.S)
    assert len(found) == blocks
    names = {}
    for block in found:
        exec(compile(block, document, "exec"), names)


def test_one_version_everywhere():
    found = re.search(r"project\(photocoag VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())
    assert found and found[1] == pc.__version__
