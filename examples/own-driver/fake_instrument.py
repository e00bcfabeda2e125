#!/usr/bin/env python3
"""A bench in a process of its own, over TCP: a laser, a lump of tissue, a thermometer.

It stands for the instrument of docs/own-driver.md. Its own clock triggers one sample per period;
the sample is sent a latency later, and some are dropped. Nothing but Python is needed.

    python3 fake_instrument.py --port 5025 --latency-ms 1 --drop 0.02

One client at a time; lines of text. From the client:
    PERIOD ns                begin to sample
    POWER token watts        a power, for the coming period; without a new token for two periods: 0 W
    OFF                      0 W and interlock open, until the client has gone
To the client, one line per period:
    SAMPLE number time_ns volts emitted_W command_W interlock
"""

import argparse
import heapq
import math
import random
import select
import socket
import time

GAIN_K_PER_W, TAU_S, NOISE_K = 600.0, 0.02, 0.288
VOLTS_PER_K = 0.1


def serve(connection, latency_ns, drop, draws):
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    period = due = number = token = last_word = 0
    power = temperature = 0.0
    interlock = 1
    pending, text = [], b""
    while True:
        now = time.monotonic_ns()
        events = [due] * (period > 0) + [when for when, _, _ in pending[:1]]
        wait = max(0.0, (min(events) - now) * 1e-9) if events else 1.0
        if select.select([connection], [], [], wait)[0]:
            data = connection.recv(4096)
            if not data:
                return  # the client has gone: so has the light
            text += data
            *lines, text = text.split(b"\n")
            for word, *values in (line.split() for line in lines if line.strip()):
                if word == b"PERIOD":
                    period = int(values[0])
                    due = time.monotonic_ns() + period
                elif word == b"POWER" and int(values[0]) > token:
                    token, power, last_word = int(values[0]), float(values[1]), time.monotonic_ns()
                elif word == b"OFF":
                    power, interlock = 0.0, 0
        now = time.monotonic_ns()
        while period and now >= due:  # the trigger
            if due - last_word > 2 * period:
                power = 0.0  # the watchdog
            emitted = power if interlock else 0.0
            keep = math.exp(-period * 1e-9 / TAU_S)
            temperature = keep * temperature + (1.0 - keep) * GAIN_K_PER_W * emitted
            number += 1
            volts = VOLTS_PER_K * (temperature + draws.gauss(0.0, NOISE_K))
            line = f"SAMPLE {number} {due} {volts:.6f} {emitted:.6g} {power:.6g} {interlock}\n"
            if draws.random() >= drop:
                heapq.heappush(pending, (due + latency_ns, number, line))
            due += period
        while pending and pending[0][0] <= time.monotonic_ns():
            connection.sendall(heapq.heappop(pending)[2].encode())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--port", type=int, default=5025, help="0: any; it is printed")
    parser.add_argument("--latency-ms", type=float, default=0.0)
    parser.add_argument("--drop", type=float, default=0.0, help="share of samples that are not sent")
    options = parser.parse_args()
    draws = random.Random(1)
    with socket.create_server(("127.0.0.1", options.port)) as server:
        print("listening on port", server.getsockname()[1], flush=True)
        while True:
            connection, _ = server.accept()
            with connection:
                try:
                    serve(connection, int(options.latency_ms * 1e6), options.drop, draws)
                except OSError:
                    pass


if __name__ == "__main__":
    main()
