"""What the tests share. The program under test: PHOTOCOAG_PROGRAM."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

import photocoag as pc

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def config() -> pc.Config:
    return pc.Config()


@pytest.fixture(scope="session")
def model(config: pc.Config) -> pc.ReducedModel:
    return pc.reduce(config)


@pytest.fixture(scope="session")
def run(config: pc.Config) -> pc.Run:
    return pc.simulate(config)


@pytest.fixture(scope="session")
def program():
    """Calls the program that this tree has built."""
    path = os.environ.get("PHOTOCOAG_PROGRAM")
    if not path:
        pytest.skip("no program: PHOTOCOAG_PROGRAM is not set")

    def call(*arguments: str) -> str:
        done = subprocess.run([path, *arguments], capture_output=True, text=True, check=False)
        assert done.returncode in (0, 1), done.stderr
        return done.stdout

    return call
