#!/usr/bin/env python3
"""A simulated acquisition program: a laser and its measurement for photocoag, by datagrams.

    python3 examples/udp/acquisition.py --port 5020
    ./photocoag treat --device udp:5020

Nothing but Python is needed. docs/devices.md ("An acquisition program") has the protocol; what to replace is marked
HARDWARE. The tissue is five time constants, fitted within 0.4 % to the step response of the default tissue's volume
temperature at an absorption factor of 0.7363, from 1 ms on: no peak temperature, no pulses, no other eye. A power that
comes within a period counts for all of it, which no laser can do: with a real one set control.delay_cycles, or tell the
estimator the lag. Its watchdog is in this program: with a real laser it must be where a killed program leaves it alone.
"""

import argparse
import math
import os
import random
import select
import signal
import socket
import struct
import sys
import time

MAGIC, VERSION = 0x474F4350, 1
HELLO, SAMPLE, WELCOME, POWER, OFF = 1, 2, 3, 4, 5
HELLO_LAYOUT = struct.Struct("<IHHQqQ40s")
SAMPLE_LAYOUT = struct.Struct("<IHHQQqdddqQ")
ANSWER_LAYOUT = struct.Struct("<IHHQQQd")
INTERLOCK_CLOSED, SHUTTER_OPEN, FOOT_SWITCH = 4, 8, 16
SECOND = 1_000_000_000  # ns

POLES = ((0.0004, 24.4), (0.002, 33.6), (0.01, 121.1), (0.05, 254.0), (0.25, 170.9))  # s, K/W
NOISE_K = 0.288


class Tissue:
    """HARDWARE: the laser, its monitor, and what measures the volume temperature."""

    def __init__(self):
        self.parts = [0.0] * len(POLES)

    def step(self, power, seconds):
        for i, (tau, gain) in enumerate(POLES):
            keep = math.exp(-seconds / tau)
            self.parts[i] = keep * self.parts[i] + (1.0 - keep) * gain * power
        return sum(self.parts) + random.gauss(0.0, NOISE_K)


class Session:
    """From a welcome until nothing has come for a second."""

    def __init__(self, link, number, period):
        self.link, self.number, self.period = link, number, period
        self.start = self.heard = self.fed = time.monotonic_ns()
        self.token = self.power = 0
        self.ordered = None  # (from which period, W)
        self.interlock = True
        self.tissue = Tissue()

    def answer(self, data):
        if len(data) != ANSWER_LAYOUT.size:
            return
        magic, version, kind, session, period, token, power = ANSWER_LAYOUT.unpack(data)
        if (magic, version, session) != (MAGIC, VERSION, self.number):
            return
        self.heard = time.monotonic_ns()
        if kind == OFF:
            self.power, self.ordered, self.interlock = 0.0, None, False
        elif kind == POWER and token > self.token and 0.0 <= power <= 1.0:
            self.token, self.fed, self.ordered = token, self.heard, (period, power)

    def end_period(self, sequence, due):
        if self.ordered and self.ordered[0] <= sequence:
            self.power, self.ordered = self.ordered[1], None
        if due - self.fed > 2 * self.period:  # the watchdog
            if self.power > 0.0:
                dark = (due - self.period - self.fed) * 1e-6
                print(f"watchdog: {self.power:.4f} W until {dark:.1f} ms after the last token", flush=True)
            self.power, self.ordered = 0.0, None
        emitted = self.power if self.interlock else 0.0
        temperature = self.tissue.step(emitted, self.period * 1e-9)
        flags = INTERLOCK_CLOSED * self.interlock | SHUTTER_OPEN | FOOT_SWITCH  # HARDWARE: the switches
        send(self.link, SAMPLE_LAYOUT.pack(MAGIC, VERSION, SAMPLE, self.number, sequence, due, temperature, emitted,
                                           self.power, round(temperature * 1e6), flags))

    def run(self):
        """How many periods it took, and how many samples went out too late to count."""
        sequence, late = 1, 0
        while time.monotonic_ns() - self.heard < max(SECOND, 10 * self.period):
            due = self.start + sequence * self.period
            for data in received(self.link, due):
                self.answer(data)
            self.end_period(sequence, due)
            late += time.monotonic_ns() - due > self.period // 2
            sequence += 1
        return sequence - 1, late


def send(link, data):
    try:
        link.send(data)
    except OSError:  # nobody listens there, or nothing leads there: not yet, or not any more
        pass


def received(link, until):
    """Datagrams that come until then, CLOCK_MONOTONIC in ns."""
    while True:
        left = until - time.monotonic_ns()
        try:
            if not select.select([link], [], [], max(0, left) * 1e-9)[0]:
                return
            yield link.recv(256)
        except OSError:  # an earlier datagram did not arrive; waited for all the same
            pass


def welcome(link, period):
    hello = HELLO_LAYOUT.pack(MAGIC, VERSION, HELLO, 0, period, 1, b"acquisition.py: five time constants")
    while True:
        send(link, hello)
        for data in received(link, time.monotonic_ns() + SECOND // 10):
            if len(data) == ANSWER_LAYOUT.size:
                magic, version, kind, session, *_ = ANSWER_LAYOUT.unpack(data)
                if (magic, version, kind) == (MAGIC, VERSION, WELCOME):
                    return session


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--host", default="127.0.0.1", help="where photocoag listens")
    parser.add_argument("--port", type=int, default=5020)
    parser.add_argument("--period-ms", type=float, default=1.0, help="control.period_ms")
    options = parser.parse_args()
    period = round(options.period_ms * 1e6)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    except PermissionError:
        print("no real-time priority (./photocoag doctor): a busy machine will make samples late", flush=True)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect((options.host, options.port))  # the system drops what others send
        while True:
            print(f"hello to {options.host}:{options.port}, {options.period_ms:g} ms", flush=True)
            session = Session(link, welcome(link, period), period)
            print("welcome", flush=True)
            print("silence after {} periods, {} samples half a period late or more".format(*session.run()), flush=True)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
