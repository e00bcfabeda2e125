"""The check of the pages finds what it is there for; the C++ reference keeps every word of the headers."""

import importlib.util
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest

from conftest import ROOT


def module(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f"docs/site/{name}.py")
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


check, cpp_reference, gallery = module("check"), module("cpp_reference"), module("gallery")


def faults(folder, **files):
    for name, text in files.items():
        (folder / name.replace("__", ".")).write_text(text)
    return list(check.faults(folder))


def test_good_pages_are_good(tmp_path):
    found = faults(
        tmp_path, a__html='<h1 id="x">A</h1><a href="b.html#y">b</a><a href="#x">x</a><a href="https://example.org">out</a>'
        '<link rel="stylesheet" href="s.css"><img src="data:image/png;base64,AA"><link rel="next" href="b.html">',
        b__html='<h1 id="y">B</h1>', s__css="a { background: url(data:image/png;base64,AA) }",
    )
    assert found == []


@pytest.mark.parametrize(("page", "said"), [
    ('<a href="none.html">x</a>', "not there"),
    ('<a href="#none">x</a>', "no such anchor"),
    ('<a href="b.html#none">x</a>', "no such anchor"),
    ('<script src="https://cdn.example.org/x.js"></script>', "outside"),
    ('<script src="//cdn.example.org/x.js"></script>', "outside"),
    ('<link rel="stylesheet" href="https://cdn.example.org/x.css">', "outside"),
    ('<link rel="shortcut icon" href="none.ico">', "not there"),
    ('<img src="none.png">', "not there"),
    ('<img src="http://example.org/x.png">', "outside"),
    ('<p style="background: url(https://example.org/x.png)">', "outside"),
    ("<style>@import 'https://example.org/x.css';</style>", "outside"),
    ('<picture><source srcset="https://example.org/x.png 2x"></picture>', "outside"),
])
def test_each_fault_of_a_page_is_found(tmp_path, page, said):
    found = faults(tmp_path, a__html=page, b__html='<p id="y">')
    assert len(found) == 1 and found[0].startswith("a.html") and said in found[0]


def test_faults_of_a_style_are_found_and_told(tmp_path):
    found = faults(tmp_path, s__css="@font-face { src: url('https://example.org/f.woff2') }")
    assert len(found) == 1 and "s.css" in found[0]
    done = subprocess.run([sys.executable, check.__file__, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "0 pages, 1 faults" in done.stdout
    assert subprocess.run([sys.executable, check.__file__], capture_output=True, check=False).returncode == 2


def test_comments_come_through_word_by_word():
    text = cpp_reference.marked(
        "// Role: online. Used by `a`.\n// Units: K.\n#pragma once\n/// Says x < y & \\z \"w\":\n///   x' = A x\n///     + B u\n/// - done.\nint f();\n"
    )
    assert text.startswith("/// \\file\n/// Role: online. Used by `a`.\n/// Units: K.\n#pragma once")
    assert '/// Says x \\< y \\& \\\\z \\"w\\":' in text and "/// \\- done." in text
    assert "/// \\verbatim\n///   x' = A x\n///     + B u\n/// \\endverbatim" in text


def test_openings_are_one_line_a_tag():
    prose = cpp_reference.Prose(ROOT)
    element = ET.fromstring("<d><para>Role: online; see docs/equations.md (E7). Used by a_b. Units: K. Real time: none.</para></d>")
    lines = cpp_reference.opening(prose, prose.text(element)).split("\n\n")
    assert [line.split("**")[1] for line in lines] == ["Role", "Units", "Real time"]
    assert "](../../equations.md#e7-" in lines[0] and r"a\_b" in lines[0]


def test_long_declarations_are_folded():
    short = "int f(int a, int b);"
    assert cpp_reference.folded(short) == short
    long = f"std::vector<std::pair<int, int>> name(const std::map<int, int>& {'a' * 60}, int {'b' * 40} = f(1, 2)) const;"
    assert cpp_reference.folded(long).split("\n") == [
        "std::vector<std::pair<int, int>> name(", f"    const std::map<int, int>& {'a' * 60},", f"    int {'b' * 40} = f(1, 2)) const;",
    ]


def test_every_notebook_and_program_has_its_words():
    for notebook in (ROOT / "examples/notebooks").glob("*.py"):
        title, said = gallery.notebook_words(notebook.read_text())
        assert title and said.endswith(".")
    for program in (ROOT / "examples/cpp").glob("*.cpp"):
        assert gallery.program_words(program.read_text()).endswith(".")
