"""A console seen from outside: examples/console/watch.py as documented, and who may start a device."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

PROGRAM = Path(os.environ["PHOTOCOAG_PROGRAM"])
WATCH = Path(__file__).parents[2] / "examples" / "console" / "watch.py"
DRIVER = PROGRAM.parents[1] / "examples" / "driver" / "libphotocoag_example_driver.so"


@contextmanager
def console(folder: Path, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    spot = ["--set", "grid.min_cells=2000", "--set", "run.duration_ms=60000", "--out", str(folder / "spots")]
    with subprocess.Popen(
        [PROGRAM, "console", *spot, *arguments], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr
        address = next((m[0] for line in process.stderr if (m := re.search(r"http://\S+", line))), "")
        try:
            yield process, address
        finally:
            process.terminate()
            process.stderr.read()


def press_enter(process: subprocess.Popen[str]) -> None:
    assert process.stdin
    process.stdin.write("\n")
    process.stdin.flush()


def test_ten_lines_follow_a_spot(tmp_path: Path) -> None:
    with console(tmp_path) as (process, address):
        press_enter(process)
        with subprocess.Popen([sys.executable, str(WATCH), address], stdout=subprocess.PIPE, text=True) as watch:
            assert watch.stdout
            cycle, peak, kelvin, power, watt = watch.stdout.readline().split()
            watch.kill()
    assert (kelvin, watt) == ("K", "W")
    assert int(cycle) >= 0 and float(peak) >= 0.0 and 0.0 <= float(power) <= 0.1
    assert process.returncode == 1  # stopped by hand


def hear(client: ClientConnection, **wanted: Any) -> dict[str, Any]:
    while True:
        message: dict[str, Any] = json.loads(client.recv(timeout=60))
        if all(message.get(key) == value for key, value in wanted.items()):
            return message


@pytest.mark.skipif(not DRIVER.exists(), reason="the example driver is not built")
def test_a_browser_never_starts_a_device(tmp_path: Path) -> None:
    with console(tmp_path, "--device", f"driver:{DRIVER}") as (process, address):
        url = re.sub(r"http://([^/]+)/#", r"ws://\1/ws?", address)
        with connect(url) as client:
            hear(client, type="live", state="standby")
            for command in ("arm", "start", "reset"):
                client.send(json.dumps({"command": command}))
                answer = hear(client, type="answer")
                assert not answer["done"] and "at the terminal" in answer["why"]
            press_enter(process)
            hear(client, type="self_test")
            client.send(json.dumps({"command": "stop"}))
            spot = hear(client, type="spot")
            assert spot["stopped"] and not spot["failure"]
            assert (Path(spot["folder"]) / "report.html").exists()
            # No next one by itself.
            assert all(json.loads(client.recv(timeout=60)).get("spot", 1) == 1 for _ in range(30))
