"""Cards of the gallery: notebooks with their first figure, programs with what they print."""

from __future__ import annotations

import base64
import json
import re
import subprocess
import tempfile
from html import escape
from pathlib import Path

# What the examples are called with; the sixth reads what the third has written.
ARGUMENTS = {"03_reduce": ["model.json"], "05_control": ["{root}/configs/paper-1khz.toml"], "06_embed": ["model.json"]}


def outputs(root: Path, build: Path) -> dict[str, str]:
    """What the C++ examples print."""
    printed = {}
    with tempfile.TemporaryDirectory() as folder:
        for source in sorted((root / "examples/cpp").glob("*.cpp")):
            arguments = [one.format(root=root) for one in ARGUMENTS.get(source.stem, [])]
            command = [str(build / "examples/cpp" / source.stem), *arguments]
            printed[source.stem] = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout
    return printed


def plain(text: str) -> str:
    """Without Markdown's marks."""
    return re.sub(r"\[([^]]*)\]\([^)]*\)|[`*]", lambda m: m[1] or "", text)


def first_sentence(text: str) -> str:
    return re.split(r"(?<=\.)\s", " ".join(text.split()))[0]


def notebook_words(source: str) -> tuple[str, str]:
    """Title and first sentence of a notebook."""
    title = re.search(r"^# # (.+)$", source, re.M)
    said = re.search(r"^# # .+\n#\n((?:# .+\n)+)", source, re.M)
    assert title and said, "a notebook begins with its title and what it shows"
    return plain(title[1]), plain(first_sentence(re.sub(r"^# ", "", said[1], flags=re.M)))


def program_words(source: str) -> str:
    """First sentence of a program's opening comment."""
    lines = [line.removeprefix("// ") for line in source.split("\n#include")[0].splitlines() if line.startswith("//")]
    return first_sentence(" ".join(lines))


def card(link: str, picture: str, title: str, said: str) -> str:
    return f'<a class="card" href="{link}">{picture}<strong>{escape(title)}</strong><span>{escape(said)}</span></a>'


def cards(root: Path, kind: str, printed: dict[str, str]) -> str:
    """A grid of all `kind`: notebooks or programs."""
    made = []
    if kind == "notebooks":
        for source in sorted((root / "examples/notebooks").glob("*.py")):
            title, said = notebook_words(source.read_text())
            picture = f'<img src="../../_static/gallery/{source.stem}.png" alt="" loading="lazy">'
            made.append(card(f"../../examples/notebooks/{source.stem}.html", picture, title, said))
    else:
        for name, text in printed.items():
            said = program_words((root / f"examples/cpp/{name}.cpp").read_text())
            title = name[3:].replace("_", " ").capitalize()
            anchor = title.lower().replace(" ", "-")
            made.append(card(f"examples.html#{anchor}", f"<pre>{escape(text)}</pre>", title, said))
    return "```{raw} html\n<div class='gallery'>\n" + "\n".join(made) + "\n</div>\n```"


def thumbnails(notebooks: Path, folder: Path) -> None:
    """The first figure of each executed notebook."""
    folder.mkdir(parents=True, exist_ok=True)
    for notebook in sorted(notebooks.glob("*.ipynb")):
        cells = json.loads(notebook.read_text())["cells"]
        pictures = [one["data"]["image/png"] for cell in cells for one in cell.get("outputs", []) if "image/png" in one.get("data", {})]
        if not pictures:
            raise RuntimeError(f"{notebook.stem} has no figure for the gallery")
        (folder / f"{notebook.stem}.png").write_bytes(base64.b64decode(pictures[0]))
