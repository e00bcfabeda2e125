"""The C++ reference of the installed headers as Markdown: declarations by Doxygen, words as they stand in the headers.

`build/release/installed_headers.txt` (written by CMake beside the install rules) says which folders each library installs.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from pathlib import Path

DOXYFILE = """
INPUT = "{headers}"
OUTPUT_DIRECTORY = "{out}"
RECURSIVE = YES
STRIP_FROM_PATH = "{headers}"
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
MARKDOWN_SUPPORT = NO
AUTOLINK_SUPPORT = NO
ENABLE_PREPROCESSING = YES
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = PHOTOCOAG_NONBLOCKING=
HIDE_FRIEND_COMPOUNDS = YES
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
WARN_AS_ERROR = FAIL_ON_WARNINGS
"""
COMMENT = re.compile(r"^(\s*(?:.*?[;,{)]\s*)?///<?)( ?)(.*)$")


def components(build: Path) -> dict[str, list[str]]:
    """Folders of src/photocoag by the library that installs their headers."""
    lines = (build / "installed_headers.txt").read_text().splitlines()
    return {name: folders for name, *folders in (line.split() for line in lines)}


def words(text: str) -> str:
    """A comment's text such that Doxygen hands it on unchanged."""
    return re.sub(r'([\\@<>&#%"])', r"\\\1", text)


def marked(text: str) -> str:
    """A header whose comments Doxygen takes word by word: formulas keep their lines, opening comments are the file's."""
    lines = text.split("\n")
    opening = next((i for i, line in enumerate(lines) if not re.match(r"//(?!/)", line)), 0)
    result = ["/// \\file", *(f"/// {words(line[2:].strip())}" for line in lines[:opening])]
    formula = False
    for line in lines[opening:]:
        found = COMMENT.match(line)
        indented = bool(found) and found[1].strip() == "///" and found[3].startswith(" ")
        if indented != formula:
            result.append("/// \\verbatim" if indented else "/// \\endverbatim")
            formula = indented
        if found and not indented:
            line = found[1] + found[2] + re.sub(r"^([-+*]|\d+\.)(?= )", r"\\\1", words(found[3]))
        result.append(line)
    return "\n".join(result)


def read(source: Path, folders: Iterable[str], work: Path) -> dict[str, ET.Element]:
    """Doxygen's description of each class, namespace and file of these folders, by its id."""
    shutil.rmtree(work, ignore_errors=True)
    for folder in folders:
        for header in sorted((source / folder).glob("*.hpp")):
            copy = work / "headers/photocoag" / folder / header.name
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(marked(header.read_text()))
    (work / "Doxyfile").write_text(DOXYFILE.format(headers=work / "headers", out=work))
    done = subprocess.run(["doxygen", str(work / "Doxyfile")], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"doxygen: {done.stderr[:2000]}")
    found = (ET.parse(file).getroot().find("compounddef") for file in sorted((work / "xml").glob("*.xml")))
    return {one.get("id", ""): one for one in found if one is not None}


def flat(element: ET.Element | None) -> str:
    return "" if element is None else re.sub(r"\s+", " ", "".join(element.itertext())).strip()


class Prose:
    """Words of a comment as Markdown, with links to equations and documents."""

    def __init__(self, root: Path) -> None:
        headings = re.findall(r"^### (\(E(\d+)\).*)$", (root / "docs/equations.md").read_text(), re.M)
        self._equations = {number: re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title, number in headings}
        self._documents = {file.stem for file in (root / "docs").glob("*.md")}

    def line(self, text: str) -> str:
        parts = text.split("`")
        if len(parts) % 2 == 0:  # a backtick without another
            parts = [text.replace("`", "'")]
        return "`".join(part if i % 2 else self._plain(part) for i, part in enumerate(parts))

    def _plain(self, text: str) -> str:
        text = re.sub(r"([\\*_<>\[\]{}$~|^#])", r"\\\1", text)
        text = re.sub(r"\(E(\d+)\)", self._equation, text)
        return re.sub(r"\bdocs/((?:[a-z]|-)+)\.md", self._document, text)

    def _equation(self, found: re.Match[str]) -> str:
        anchor = self._equations[found[1]]
        return f"[(E{found[1]})](../../equations.md#{anchor})"

    def _document(self, found: re.Match[str]) -> str:
        return f"[docs/{found[1]}.md](../../{found[1]}.md)" if found[1] in self._documents else found[0]

    def text(self, *descriptions: ET.Element | None) -> str:
        return "\n\n".join(block for one in descriptions if one is not None for block in self._blocks(one))

    def _blocks(self, element: ET.Element) -> Iterator[str]:
        """Paragraphs, and formulas as they stand."""
        pending: list[str] = [element.text or ""]
        for child in element:
            if child.tag in ("para", "verbatim", "simplesect"):
                yield from self._paragraph(pending)
                if child.tag == "verbatim":
                    lines = [re.sub(r"^\s*/// ?", "", line) for line in (child.text or "").split("\n")]
                    yield "```text\n" + "\n".join(lines).strip("\n").rstrip() + "\n```"
                else:
                    yield from self._blocks(child)
                pending = []
            else:
                pending.append("".join(child.itertext()))
            pending.append(child.tail or "")
        yield from self._paragraph(pending)

    def _paragraph(self, parts: list[str]) -> Iterator[str]:
        text = re.sub(r"\s+", " ", "".join(parts)).strip()
        if text:
            yield self.line(text)


def opening(prose: Prose, description: str) -> str:
    """The opening comment, one line for each of its tags."""
    tags = r"(?:^|(?<=\. ))((?:Role|Source|Units|Real time|Threads|Boundary|Settings|Differences)[^:.]*): "
    parts = re.split(tags, description)
    lines = [f"{parts[0].strip()}"] if parts[0].strip() else []
    lines += [f"**{tag}** {text.strip()}" for tag, text in zip(parts[1::2], parts[2::2])]
    return "\n\n".join(lines)


def template(element: ET.Element) -> str:
    parameters = element.find("templateparamlist")
    if parameters is None:
        return ""
    listed = []
    for one in parameters.findall("param"):
        name, value = flat(one.find("declname")), flat(one.find("defval"))
        text = flat(one.find("type"))
        text += f" {name}" if name and not text.endswith(name) else ""
        listed.append(text + (f" = {value}" if value else ""))
    return f"template <{', '.join(listed)}>\n"


def declaration(member: ET.Element) -> str:
    kind, name, type_ = member.get("kind"), flat(member.find("name")), flat(member.find("type"))
    type_ = re.sub(r"\s*([*&])$", r"\1", re.sub(r"< | >", lambda m: m[0].strip(), type_))
    value, arguments = flat(member.find("initializer")), flat(member.find("argsstring"))
    value = f" {value}" if value and not value.startswith("{") else value
    if kind == "define":
        listed = member.findall("param")
        given = f"({', '.join(flat(p.find('defname')) for p in listed)})" if listed else ""
        return f"#define {name}{given}"
    if kind == "enum":
        scoped = " class" if member.get("strong") == "yes" else ""
        return f"enum{scoped} {name}".rstrip()
    if kind == "typedef":
        definition = flat(member.find("definition"))
        if definition.startswith("using"):
            return template(member) + re.sub(r"^using \S+ =", f"using {name} =", definition) + ";"
        return f"typedef {type_} {name}{arguments};"
    static = "static " if member.get("static") == "yes" and "static" not in type_ else ""
    if member.get("constexpr") == "yes" and "constexpr" not in type_:
        static += "constexpr "
    text = f"{static}{type_} {name}".strip()
    return folded(f"{template(member)}{text}{arguments}{value};")


def folded(text: str) -> str:
    """A declaration of more than 100 characters with its parameters one below the other."""
    *before, last = text.split("\n")
    name, _, rest = last.partition("(")
    if len(last) <= 100 or not rest or ")" not in rest:
        return text
    inside, after = rest[: rest.rindex(")")], rest[rest.rindex(")") :]
    depth, parts = 0, [""]
    for letter in inside:
        depth += (letter in "(<[{") - (letter in ")>]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    lines = ",\n".join("    " + part.strip() for part in parts)
    return "\n".join([*before, f"{name}(\n{lines}{after}"])


class Reference:
    """Pages from Doxygen's descriptions."""

    def __init__(self, root: Path, build: Path, work: Path) -> None:
        self._root = root
        self._prose = Prose(root)
        self._components = components(build)
        folders = [folder for names in self._components.values() for folder in names]
        self._compounds = read(root / "src/photocoag", folders, work)
        self._files = {
            location.get("file", ""): one
            for one in self._compounds.values()
            if one.get("kind") == "file" and (location := one.find("location")) is not None
        }

    def component(self, name: str) -> str:
        """The sections of one library's headers; an optional one may be absent."""
        if name not in self._components:
            return "This build has no such library."
        return "\n\n".join(part for folder in self._components[name] for part in self._folder(folder))

    def _folder(self, folder: str) -> Iterator[str]:
        yield f"## {folder}"
        headers = (self._root / "src/photocoag" / folder).glob("*.h*")
        for header in sorted(headers, key=lambda one: one.name):
            yield f"### photocoag/{folder}/{header.name}"
            if header.suffix == ".h":
                yield f"```c\n{header.read_text()}```"
            else:
                yield from self._header(f"photocoag/{folder}/{header.name}")

    def _header(self, name: str) -> Iterator[str]:
        file = self._files[name]
        yield opening(self._prose, self._prose.text(file.find("briefdescription"), file.find("detaileddescription")))
        for inner in file.findall("innerclass"):
            found = self._compounds.get(inner.get("refid", ""))
            if found is not None and found.get("prot", "public") == "public":
                yield from self._class(found)
        free = [m for m in self._members(name) if m.get("kind") != "friend"]
        if free:
            yield "#### Functions and constants" if file.findall("innerclass") else ""
            yield from self._list(free)

    def _members(self, name: str) -> Iterator[ET.Element]:
        """What a header declares outside of classes."""
        for compound in self._compounds.values():
            if compound.get("kind") not in ("namespace", "file") or (
                compound.get("kind") == "file" and compound is not self._files[name]
            ):
                continue
            for member in compound.iter("memberdef"):
                location = member.find("location")
                if location is not None and location.get("file") == name and not flat(member.find("name")).startswith("@"):
                    yield member

    def _class(self, compound: ET.Element) -> Iterator[str]:
        name = flat(compound.find("compoundname")).removeprefix("photocoag::")
        yield f"#### {self._prose.line(name)}"
        bases = ", ".join(flat(base).removeprefix("photocoag::") for base in compound.findall("basecompoundref"))
        yield f"```cpp\n{template(compound)}{compound.get('kind')} {name}{' : ' + bases if bases else ''};\n```"
        yield self._prose.text(compound.find("briefdescription"), compound.find("detaileddescription"))
        members = [
            member for member in compound.iter("memberdef")
            if member.get("prot") == "public" and member.get("kind") != "friend"
        ]
        if members:
            yield from self._list(members)

    def _list(self, members: list[ET.Element]) -> Iterator[str]:
        """Declarations, each followed by its words; those without stand together."""
        line = lambda m: int(m.find("location").get("line"))  # type: ignore[union-attr,arg-type]  # noqa: E731
        yield ":::{container} members"
        declared: list[str] = []
        for member in sorted({m.get("id"): m for m in members}.values(), key=line):
            said = self._prose.text(member.find("briefdescription"), member.find("detaileddescription"))
            values = list(self._values(member)) if member.get("kind") == "enum" else []
            declared.append(declaration(member) + (" { " + ", ".join(v for v, _ in values) + " };" if values else ""))
            said = "\n\n".join([said, *(f"`{value}`: {text}" for value, text in values if text)]).strip()
            short = flat(member.find("briefdescription")) or flat(member.find("detaileddescription"))
            if member.get("kind") == "variable" and said and "\n" not in said and len(declared[-1] + short) < 110:
                declared[-1] += f"  // {short}"
            elif said:
                for block in (declared[:-1], declared[-1:]):
                    if block:
                        yield "```cpp\n" + "\n".join(block) + "\n```"
                yield said
                declared = []
        if declared:
            yield "```cpp\n" + "\n".join(declared) + "\n```"
        yield ":::"

    def _values(self, member: ET.Element) -> Iterator[tuple[str, str]]:
        for value in member.findall("enumvalue"):
            said = self._prose.text(value.find("briefdescription"), value.find("detaileddescription"))
            yield flat(value.find("name")), said
