#!/usr/bin/env python3
"""Checks the pages that `./photocoag docs` has written: every link and anchor leads somewhere, nothing comes from outside.

    docs/site/check.py FOLDER             links, anchors, assets
    docs/site/check.py FOLDER --browser   also in headless Chromium: the search finds, the pages ask no machine for anything
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes that make a browser load something, by element; a link with one of these relations as well.
LOADED = {"img": "src", "script": "src", "source": "srcset", "iframe": "src", "video": "src", "audio": "src", "object": "data", "embed": "src"}
RELATIONS = {"stylesheet", "icon", "preload", "modulepreload", "prefetch", "manifest"}
STYLE = re.compile(r"""(?:url\(\s*|@import\s+)["']?([^"')\s;]+)""")


class Page(HTMLParser):
    """What a page links to and loads, and what of it can be linked to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.assets: list[str] = []
        self._in_style = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag == "link":
            loaded = RELATIONS & set(given.get("rel", "").split())
            (self.assets if loaded else self.links).append(given.get("href", ""))
        elif tag in LOADED and LOADED[tag] in given:
            self.assets += [one.split()[0] for one in given[LOADED[tag]].split(",") if one.strip()] \
                if LOADED[tag] == "srcset" else [given[LOADED[tag]]]
        self.assets += STYLE.findall(given.get("style", ""))
        self._in_style = tag == "style"

    def handle_endtag(self, tag: str) -> None:
        self._in_style = False

    def handle_data(self, data: str) -> None:
        if self._in_style:
            self.assets += STYLE.findall(data)


def faults(folder: Path) -> Iterator[str]:
    """What is wrong with the pages of a folder, one line each."""
    pages = {file.resolve(): Page(file.read_text(encoding="utf-8")) for file in sorted(folder.rglob("*.html"))}
    for file, page in pages.items():
        name = file.relative_to(folder.resolve())
        for asset in page.assets:
            yield from (f"{name}: {fault}" for fault in asset_faults(file, asset))
        for link in page.links:
            address = urlsplit(link)
            if address.scheme or address.netloc or link.startswith("data:"):
                continue
            target = (file.parent / unquote(address.path)).resolve() if address.path else file
            if not target.is_file():
                yield f"{name}: a link to {link}, which is not there"
            elif address.fragment and target in pages and unquote(address.fragment) not in pages[target].anchors:
                yield f"{name}: a link to {link}, which has no such anchor"
    for file in sorted(folder.rglob("*.css")):
        for asset in STYLE.findall(file.read_text(encoding="utf-8")):
            yield from (f"{file.relative_to(folder)}: {fault}" for fault in asset_faults(file, asset))


def asset_faults(file: Path, asset: str) -> Iterator[str]:
    address = urlsplit(asset)
    if address.scheme == "data" or asset.startswith("#"):
        return
    if address.scheme or address.netloc:
        yield f"{asset} comes from outside"
    elif not (file.parent / unquote(address.path)).is_file():
        yield f"{asset} is loaded and not there"


def browsed(address: str) -> tuple[str, list[str]]:
    """A page as Chromium has it after its scripts, and the addresses that were asked for."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        log = Path(folder) / "net.json"
        command = [
            "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            f"--user-data-dir={folder}/profile", f"--log-net-log={log}", "--virtual-time-budget=20000", "--dump-dom",
        ]
        done = subprocess.run([*command, address], capture_output=True, text=True, timeout=120, check=False)
        # One line an event; what the browser asks for by itself has no origin.
        asked = re.findall(r'"initiator":"(?!not an origin").*?"url":"((?:https?|wss?)://[^"]*)"', log.read_text(encoding="utf-8"))
        return done.stdout, asked


def browser_faults(folder: Path) -> Iterator[str]:
    searches = {"ModalStepper": "docs/site/cpp/", "simulate_many": "python-reference.html", "certificate": "notebooks/3_reduction.html"}
    pages = [f"search.html?q={word}" for word in searches]
    pages += ["docs/site/index.html", "docs/equations.html", "examples/notebooks/1_first_treatment.html"]
    for page in pages:
        text, asked = browsed(f"{folder.resolve().as_uri()}/{page}")
        yield from (f"{page}: asks for {address}" for address in asked)
        word = page.partition("?q=")[2]
        if word and not re.search(rf'<a href="[^"]*{re.escape(searches[word])}[^"]*"', text.partition('id="search-results"')[2]):
            yield f"{page}: does not find {searches[word]}"
        if page.endswith("equations.html") and ("<mjx-container" not in text or "data-mjx-error" in text):
            yield f"{page}: its equations are not rendered"


def main(arguments: list[str]) -> int:
    if not arguments or arguments[1:] not in ([], ["--browser"]) or not Path(arguments[0]).is_dir():
        print(__doc__, file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    found = list(faults(folder))
    if arguments[1:]:
        found += browser_faults(folder)
    for fault in found[:50]:
        print(fault)
    print(f"{sum(1 for _ in folder.rglob('*.html'))} pages, {len(found)} faults")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
