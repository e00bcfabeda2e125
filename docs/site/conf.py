"""The documentation site: the documents as they are, the notebooks executed, the Python reference from docstrings.

`./photocoag docs` calls it. No page asks another machine for anything.
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

project = "photocoag"
author = "The photocoag developers"
copyright = author
found = re.search(r"project\(photocoag VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())
release = version = found[1] if found else ""

root_doc = "docs/site/index"
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**", "benchmarks/README.md", "examples/notebooks/*.py"]
exclude_patterns = ["docs/site/conf.py", "docs/figures"]
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx-mathjax-offline"]

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = {"math"}
myst_heading_anchors = 6
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
# Links to files of the tree that are no documents (sources, configurations) lead nowhere on the site.
suppress_warnings = ["myst.xref_missing", "myst.header", "misc.highlighting_failure"]

napoleon_google_docstring = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
html_theme = "furo"
html_title = "photocoag"
html_show_sourcelink = False
html_copy_source = False
