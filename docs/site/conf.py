"""The documentation site: the documents as they are, the notebooks executed, the Python reference from docstrings, the C++
reference from the installed headers, the examples with what they print.

`./photocoag docs` calls it. No page asks another machine for anything.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = Path(os.environ["PHOTOCOAG_BUILD"])
sys.path.insert(0, str(HERE))

import gallery  # noqa: E402
from cpp_reference import Reference  # noqa: E402

project = "photocoag"
author = "The photocoag developers"
copyright = author
found = re.search(r"project\(photocoag VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())
release = version = found[1] if found else ""

root_doc = "docs/site/index"
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**", "benchmarks/README.md", "examples/notebooks/*.py"]
exclude_patterns = ["docs/site/*.py", "docs/site/static", "docs/figures"]
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx-mathjax-offline"]

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_fence_as_directive = {"math"}
myst_heading_anchors = 6
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
# Documents begin a part with the heading that suits them, not always with the next one.
suppress_warnings = ["myst.header"]

napoleon_google_docstring = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
html_theme = "furo"
html_title = "photocoag"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False


class Inserted:
    """What stands in a document for text that is made here: ```{headers} LIBRARY```, ```{output} EXAMPLE```, ```{gallery}```."""

    def __init__(self) -> None:
        self._reference: Reference | None = None
        self._outputs: dict[str, str] | None = None

    def headers(self, library: str) -> str:
        if self._reference is None:
            self._reference = Reference(ROOT, BUILD, BUILD.parent / "python/cpp-reference")
        return self._reference.component(library)

    def output(self, example: str) -> str:
        if self._outputs is None:
            self._outputs = gallery.outputs(ROOT, BUILD)
        return f"```text\n{self._outputs[example]}```"

    def gallery(self, kind: str) -> str:
        if self._outputs is None:
            self._outputs = gallery.outputs(ROOT, BUILD)
        return gallery.cards(ROOT, kind, self._outputs)

    def _made_from(self, name: str, source: str) -> list[Path]:
        """Files beside the document whose change makes its page anew."""
        kinds = set(re.findall(r"^```\{(headers|output|gallery)\}", source, re.M))
        made = sorted((BUILD / "python/photocoag").glob("_core*.so")) if name.startswith("examples/notebooks/") else []
        if "headers" in kinds:
            made += [HERE / "cpp_reference.py", *(ROOT / "src/photocoag").glob("*/*.h*")]
        if kinds & {"output", "gallery"}:
            made += [HERE / "gallery.py", *(BUILD / "examples/cpp").glob("0?_*[a-z]"), *(ROOT / "examples/notebooks").glob("*.py")]
        return made

    def replace(self, app: Any, name: str, source: list[str]) -> None:
        for file in self._made_from(name, source[0]):
            app.env.note_dependency(str(file))
        source[0] = re.sub(
            r"^```\{(headers|output|gallery)\} (\w+)\n```$", lambda m: getattr(self, m[1])(m[2]), source[0], flags=re.M
        )


def links_of_the_tree(app: Any, name: str, source: list[str]) -> None:
    """What a link to a folder or a script of the tree says, without the link: the site has no page for it. Anchors as MyST has them."""
    folder = Path(app.env.doc2path(name)).parent

    def replaced(found: re.Match[str]) -> str:
        target = folder / found[2]
        script = target.suffix == ".py" and target.parent.name != "notebooks"
        return found[1] if target.is_dir() or script else found[0]

    source[0] = re.sub(r"\[([^][]*)\]\(([^)#:\s]+)\)", replaced, source[0])
    source[0] = re.sub(r'^<a id="([\w-]+)"></a>\n?', r"(\1)=\n\n", source[0], flags=re.M)


def write_thumbnails(app: Any, error: Exception | None) -> None:
    if error is None:
        gallery.thumbnails(Path(app.outdir).parent / "jupyter_execute/examples/notebooks", Path(app.outdir) / "_static/gallery")


def setup(app: Any) -> None:
    app.connect("source-read", Inserted().replace)
    app.connect("source-read", links_of_the_tree)
    app.connect("build-finished", write_thumbnails)
