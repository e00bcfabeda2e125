"""The console's Foxglove stream: both names of the protocol, what is told, who is let in, and that it agrees with the run."""

import csv
import json
import os
import re
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

PROGRAM = Path(os.environ["PHOTOCOAG_PROGRAM"])
EXAMPLE = Path(__file__).parents[2] / "examples" / "console" / "foxglove.py"
PROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"]
PATIENCE = 60.0  # s: a busy machine, never a measure
ELSEWHERE = "https://app.example.org"


@contextmanager
def console(folder: Path, *arguments: str, spot_ms: int = 300) -> Iterator[tuple[subprocess.Popen[str], str, str]]:
    spot = ["--set", "grid.min_cells=2000", "--set", f"run.duration_ms={spot_ms}", "--out", str(folder / "spots")]
    with subprocess.Popen(
        [PROGRAM, "console", *spot, *arguments], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr
        page = next((m[0] for line in process.stderr if (m := re.search(r"http://\S+", line))), "")
        stream = re.sub(r"http://([^/]+)/#", r"ws://\1/?", page)
        try:
            yield process, page, stream
        finally:
            process.terminate()
            process.stderr.read()


def protocols(*names: str) -> list[Subprotocol]:
    return [Subprotocol(name) for name in names]


def told(client: ClientConnection, kind: str) -> dict[str, Any]:
    message: dict[str, Any] = json.loads(client.recv(timeout=PATIENCE))
    assert message["op"] == kind
    return message


def subscribe(client: ClientConnection) -> dict[int, dict[str, Any]]:
    """All channels; what belongs to each subscription."""
    told(client, "serverInfo")
    channels = {300 + c["id"]: c for c in told(client, "advertise")["channels"]}
    wanted = [{"id": id, "channelId": c["id"]} for id, c in channels.items()]
    client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    return channels


def start(process: subprocess.Popen[str]) -> None:
    assert process.stdin
    process.stdin.write("\n")
    process.stdin.flush()


@pytest.mark.parametrize("offered", [PROTOCOLS, PROTOCOLS[:1], PROTOCOLS[1:], PROTOCOLS[::-1]])
def test_every_cycle_comes_as_the_run_has_it(tmp_path: Path, offered: list[str]) -> None:
    with console(tmp_path, "--foxglove") as (process, _, stream):
        with connect(stream, subprotocols=protocols(*offered)) as client:
            assert client.subprotocol == offered[0]
            channels = subscribe(client)
            assert {"/temperature", "/power", "/absorption", "/state"} <= {c["topic"] for c in channels.values()}
            time.sleep(0.3)
            start(process)
            rows: dict[str, list[dict[str, Any]]] = {c["topic"]: [] for c in channels.values()}
            while any(len(seen) < 300 for seen in rows.values()):
                message = client.recv(timeout=PATIENCE)
                assert isinstance(message, bytes)
                opcode, subscription, unix_ns = struct.unpack_from("<BIQ", message)
                channel = channels[subscription]
                assert opcode == 1 and abs(unix_ns * 1e-9 - time.time()) < PATIENCE
                value = json.loads(message[13:])
                if not rows[channel["topic"]]:
                    schema = json.loads(channel["schema"])
                    jsonschema.validate(value, schema)
                    assert set(value) <= set(schema["properties"])
                    assert all(p["description"].startswith("unit ") for p in schema["properties"].values())
                rows[channel["topic"]].append(value)
        folder = tmp_path / "spots/spot-001"
        end = time.monotonic() + PATIENCE
        while not (folder / "report.html").exists() and time.monotonic() < end:
            time.sleep(0.1)
    run = list(csv.DictReader((folder / "run.csv").read_text().splitlines()))
    compared = 0
    for topic in ("/temperature", "/power", "/absorption"):
        for row, value in zip(run, rows[topic], strict=True):
            for name in set(row) & set(value):
                assert value[name] == float(row[name]), (topic, name)
                compared += 1
    assert compared > 300 * 8


def test_only_who_may(tmp_path: Path) -> None:
    with console(tmp_path) as (_, _, stream):
        with pytest.raises(InvalidHandshake):  # not asked for
            connect(stream, subprotocols=protocols(*PROTOCOLS))
    with console(tmp_path / "b", "--foxglove", "--foxglove-origin", ELSEWHERE) as (process, _, stream):
        def opens(address: str, origin: str | None, *names: str) -> bool:
            try:
                kept = Origin(origin) if origin else None
                with connect(address, origin=kept, subprotocols=protocols(*names) or None):
                    return True
            except (InvalidHandshake, ConnectionClosed, ConnectionError, EOFError):
                return False

        assert opens(stream, None, *PROTOCOLS)
        assert opens(stream, ELSEWHERE, *PROTOCOLS)
        assert not opens(stream, "https://other.example.org", *PROTOCOLS)
        assert not opens(stream, ELSEWHERE), "the console's own WebSocket is for its own page alone"
        assert not opens(stream[:-1] + ("0" if stream[-1] != "0" else "1"), None, *PROTOCOLS), "a wrong token"
        assert not opens(stream, None, "foxglove.websocket.v9")


def test_it_takes_subscriptions_and_nothing_else(tmp_path: Path) -> None:
    with console(tmp_path, "--foxglove", spot_ms=60000) as (process, _, stream):
        with connect(stream, subprotocols=protocols(*PROTOCOLS)) as client:
            told(client, "serverInfo")
            told(client, "advertise")
            for wrong in (
                {"op": "advertise", "channels": []},
                {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]},
                {"op": "setParameters", "parameters": []},
                {"op": "start"},
            ):
                client.send(json.dumps(wrong))
                assert told(client, "status")["level"] == 2
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 1}]}))
            start(process)
            assert isinstance(client.recv(timeout=PATIENCE), bytes)
            client.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [7]}))
        for wrong_frame in ("no JSON", "x" * 5000, b"\x01\x00\x00\x00\x00"):
            with connect(stream, subprotocols=protocols(*PROTOCOLS)) as client:
                client.send(wrong_frame)
                with pytest.raises(ConnectionClosed):
                    while True:
                        client.recv(timeout=PATIENCE)
        # The spot has gone on meanwhile.
        assert not (tmp_path / "spots/spot-001/report.html").exists() and process.poll() is None


def test_the_example_follows_a_spot(tmp_path: Path) -> None:
    with console(tmp_path, "--foxglove", spot_ms=60000) as (process, _, stream):
        start(process)
        with subprocess.Popen([sys.executable, str(EXAMPLE), stream], stdout=subprocess.PIPE, text=True) as example:
            assert example.stdout
            assert example.stdout.readline().endswith("speaks foxglove.sdk.v1\n")
            assert "/" in example.stdout.readline()
            example.kill()
