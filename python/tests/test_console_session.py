"""A session driven from the console, seen from outside; docs/console.md has the messages."""

import json
import os
import re
import subprocess
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

PROGRAM = Path(os.environ["PHOTOCOAG_PROGRAM"])
DRIVER = PROGRAM.parents[1] / "examples" / "driver" / "libphotocoag_example_driver.so"
SPOTS = "".join(f'[[spot]]\nname = "{name}"\n' for name in ("A1", "A2", "B1", "B2"))
PATIENCE = 60.0  # s: a busy machine, never a measure
Message = dict[str, Any]


class Page:
    """What a tab does: hears and says."""

    def __init__(self, client: ClientConnection) -> None:
        self.client = client
        self.session: Message = {}
        self.role: Message = {"choices": []}

    def hear(self, wanted: Callable[[Message], bool]) -> Message:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            message: Message = json.loads(self.client.recv(timeout=PATIENCE))
            if message["type"] == "session":
                self.session = message
            if message["type"] == "role":
                self.role = message
            if wanted(message):
                return message
        raise AssertionError(f"never heard; the session: {self.session}")

    def hear_of(self, kind: str, **wanted: Any) -> Message:
        return self.hear(lambda m: m["type"] == kind and all(m.get(key) == value for key, value in wanted.items()))

    def offered(self, choice: str) -> None:
        while choice not in self.role["choices"]:
            self.hear_of("role")

    def say(self, command: str) -> Message:
        self.client.send(json.dumps({"command": command}))
        return self.hear_of("answer", command=command)

    def start(self) -> None:
        self.hear_of("live", state="standby")
        assert self.say("arm")["done"] and self.say("start")["done"]

    def endings(self) -> dict[str, str]:
        return {spot["name"]: spot["ending"] for spot in self.session["spots"]}


@contextmanager
def console(folder: Path, session: str = "", spot_ms: int = 150) -> Iterator[tuple[subprocess.Popen[str], str]]:
    file = folder / "session.toml"
    if not file.exists():
        settings = f'set = ["grid.min_cells=2000", "run.duration_ms={spot_ms}"]\n'
        file.write_text("[session]\n" + settings + session + SPOTS)
    with subprocess.Popen(
        [PROGRAM, "console", "--session", file, "--out", folder / "out"],
        stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:
        assert process.stderr
        address = next((m[0] for line in process.stderr if (m := re.search(r"http://\S+", line))), "")
        try:
            yield process, address
        finally:
            process.terminate()
            process.stderr.read()


@contextmanager
def page(address: str) -> Iterator[Page]:
    with connect(re.sub(r"http://([^/]+)/#", r"ws://\1/ws?", address), max_size=None) as client:
        yield Page(client)


def record(folder: Path) -> dict[str, str]:
    return {spot["spot"]: spot["ending"] for spot in json.loads((folder / "out/session.json").read_text())["plan"]}


def test_accept_repeat_skip_stop_and_continue(tmp_path: Path) -> None:
    with console(tmp_path) as (process, address), page(address) as tab:
        tab.start()
        assert tab.hear_of("spot")["folder"].endswith("spots/001-A1")
        tab.offered("accept")
        assert tab.say("accept")["done"]
        tab.offered("skip")
        assert tab.say("skip")["done"]
        tab.hear_of("session", phase="before", spot="B1")
        tab.offered("repeat")
        assert not tab.say("repeat B2")["done"], "not yet begun"
        assert tab.say("repeat A1")["done"]
        tab.hear_of("session", phase="before", spot="A1")
        tab.start()
        assert tab.hear_of("spot")["folder"].endswith("spots/001-A1-2")
        tab.offered("accept")
        assert tab.say("accept")["done"]
        tab.hear_of("session", phase="before", spot="B1")
        tab.start()
        tab.hear_of("live", emission=True)
        assert tab.say("stop")["done"]
        tab.hear_of("session", phase="ended")
        tab.offered("continue")
        assert not tab.say("arm")["done"], "an ended session arms nothing"
        assert tab.say("continue")["done"]
        tab.hear_of("session", phase="before", spot="B2")
        tab.offered("skip")
        assert tab.say("run_on")["done"]
        tab.hear_of("session", phase="ended")
        assert tab.endings() == {"A1": "treated", "A2": "skipped", "B1": "interrupted", "B2": "treated"}
        tab.offered("continue")
    assert process.returncode == 1  # a spot was stopped by hand
    assert record(tmp_path) == tab.endings()


def test_killed_it_goes_on_with_the_next_spot(tmp_path: Path) -> None:
    with console(tmp_path, spot_ms=5000) as (process, address), page(address) as tab:
        tab.start()
        tab.hear_of("live", emission=True)
        process.kill()
        process.wait()
    with console(tmp_path) as (process, address), page(address) as tab:
        tab.hear_of("session", phase="before", spot="A2")
        assert tab.endings()["A1"] == "may-have-emitted", "and nothing repeats it by itself"
        assert tab.session["limits"][0]["used"] > 0
        host, token = re.findall(r"//([^/]+)/#token=(\w+)", address)[0]
        with urllib.request.urlopen(f"http://{host}/runs/1/report.html?token={token}") as report:
            assert b"<html" in report.read(), "what its log held is a run folder"
        process.terminate()


def test_without_its_operator_a_spot_ends_and_no_next_one_starts(tmp_path: Path) -> None:
    with console(tmp_path, spot_ms=600) as (process, address), page(address) as watcher:
        watcher.hear_of("session", phase="before")
        assert watcher.say("release")["done"]
        with page(address) as tab:
            assert tab.say("operate")["done"]
            tab.hear_of("live", state="standby")
            assert tab.say("run_on")["done"]
            tab.hear_of("live", emission=True)
        assert not watcher.hear_of("spot")["stopped"], "to its planned end"
        watcher.hear_of("session", phase="after")
        watcher.offered("accept")
        assert watcher.endings()["A1"] == "treated"
        assert not watcher.say("accept")["done"], "who watches decides nothing"
        assert watcher.say("operate")["done"] and watcher.say("accept")["done"]
        watcher.hear_of("session", phase="before", spot="A2")
        for _ in range(30):
            watcher.hear_of("live", state="standby")
        process.terminate()
    assert record(tmp_path)["A2"] == "planned"


@pytest.mark.skipif(not DRIVER.exists(), reason="the example driver is not built")
def test_a_device_is_started_at_the_terminal_alone(tmp_path: Path) -> None:
    with console(tmp_path, f'device = "driver:{DRIVER}"\n') as (process, address), page(address) as tab:
        tab.hear_of("session", phase="before", spot="A1")
        for command in ("arm", "start", "run_on"):
            assert "at the terminal" in tab.say(command)["why"]
        assert process.stdin
        process.stdin.write("\n")
        process.stdin.flush()
        tab.hear_of("spot")
        # On a busy machine its supervisor may have stopped it, and with it the session.
        tab.hear(lambda m: m["type"] == "session" and m["phase"] in ("after", "ended"))
        decision = "accept" if tab.session["phase"] == "after" else "continue"
        tab.offered(decision)
        assert tab.say(decision)["done"], "it starts nothing"
        tab.hear_of("session", phase="before", spot="A2")
        for _ in range(20):
            tab.hear_of("live", state="standby")
        process.terminate()


def test_on_an_eye_in_a_process_of_its_own(tmp_path: Path) -> None:
    with console(tmp_path, 'device = "eye"\n') as (process, address), page(address) as tab:
        assert tab.hear_of("before")["browser_starts"]
        tab.offered("skip")
        assert tab.say("run_on")["done"]
        tab.hear_of("session", phase="ended")
        assert set(tab.endings().values()) == {"treated"}, tab.session
        process.terminate()
    assert process.returncode == 0
