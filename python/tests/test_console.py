"""A console seen from outside: examples/console/watch.py as documented, and who may start a device."""

import json
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

PROGRAM = Path(os.environ["PHOTOCOAG_PROGRAM"])
WATCH = Path(__file__).parents[2] / "examples" / "console" / "watch.py"
BENCH = Path(__file__).parents[2] / "examples" / "own-driver" / "fake_instrument.py"
TCP_DRIVER = PROGRAM.parents[1] / "examples" / "own-driver" / "libphotocoag_tcp_driver.so"
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


class Wiretap:
    """Between a driver and a bench: hands everything on, and keeps the powers that were commanded."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.watts: list[float] = []
        self.listening = socket.create_server(("127.0.0.1", 0))
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self) -> None:
        while True:
            driver, _ = self.listening.accept()
            bench = socket.create_connection(("127.0.0.1", self.port))
            threading.Thread(target=self.pump, args=(bench, driver, False), daemon=True).start()
            self.pump(driver, bench, True)

    def pump(self, source: socket.socket, sink: socket.socket, commands: bool) -> None:
        text = b""
        with suppress(OSError):  # the other side has gone
            while data := source.recv(4096):
                if commands:
                    *lines, text = (text + data).split(b"\n")
                    for line in lines:
                        if line.startswith(b"POWER"):
                            self.watts.append(float(line.split()[2]))
                        elif line == b"OFF":
                            self.watts.append(0.0)
                sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)


@pytest.mark.skipif(not TCP_DRIVER.exists(), reason="the tutorial's driver is not built")
def test_a_browsers_stop_reaches_a_bench_over_tcp(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, BENCH, "--port", "0"], stdout=subprocess.PIPE, text=True) as bench:
        assert bench.stdout
        tap = Wiretap(int(bench.stdout.readline().split()[-1]))
        period = ["--set", "control.period_ms=4"]
        stopped, reasons = 0, []
        with console(tmp_path, "--device", f"driver:{TCP_DRIVER},port={tap.listening.getsockname()[1]}", *period) as (
            process,
            address,
        ), connect(re.sub(r"http://([^/]+)/#", r"ws://\1/ws?", address), max_size=None) as client:
            # On a busy machine its supervisor may be faster than the browser: then the next spot.
            for _ in range(6):
                hear(client, type="live", state="standby")
                press_enter(process)
                while (message := json.loads(client.recv(timeout=60))).get("type") != "spot":
                    if message.get("emission") is True:
                        client.send(json.dumps({"command": "stop"}))
                        break
                spot = message if message["type"] == "spot" else hear(client, type="spot")
                reasons.append((spot["reason"], spot["cycles"], spot["failure"]))
                assert tap.watts[-1] == 0.0, "whatever ended it"
                if spot["reason"] == "none" and spot["stopped"]:
                    stopped += 1
                    lit = max(k for k, watts in enumerate(tap.watts) if watts > 0.0)
                    assert set(tap.watts[lit + 1 :]) == {0.0}
                    break
                press_enter(process)
        bench.terminate()
    if stopped == 0:
        pytest.skip(f"this machine is too busy for a bench in another process: {reasons}")
