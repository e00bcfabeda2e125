"""Campaigns: the program's spots, in memory."""

import subprocess
import sys
import time

import numpy as np
import pytest

import photocoag as pc

SPOTS = {
    "spots": 12,
    "seed": 3,
    "set": ["run.duration_ms=100"],
    "input": [
        {"key": "plant.absorption_factor", "distribution": "uniform", "low": 0.5, "high": 1.5},
        {"key": "plant.tissue.spot_radius_um", "distribution": "normal", "mean": 100, "sigma": 3, "low": 90, "high": 110},
    ],
}


def test_spots_do_not_depend_on_threads():
    one, two = pc.campaign(SPOTS, threads=1), pc.campaign(SPOTS, threads=2)
    assert len(one) == one.summary["spots"] == 12
    for name in one.spots.dtype.names:
        assert np.array_equal(one.spots[name], two.spots[name], equal_nan=one.spots[name].dtype.kind == "f")
    frame = one.to_pandas()
    assert frame["plant.absorption_factor"].between(0.5, 1.5).all()
    assert frame.attrs["units"]["peak_max_K"] == "K"
    assert one.summary["peak_max_K"] == frame["peak_max_K"].max()
    assert one.summary["over_limit_spots"] == (frame["over_limit_K"] > 0).sum()


def test_files_and_their_errors(tmp_path):
    file = tmp_path / "campaign.toml"
    file.write_text('spots = 2\nset = ["run.duration_ms=20"]\n[[input]]\nkey = "plant.absorption_factor"\n'
                    'distribution = "uniform"\nlow = 0.5\nhigh = 1.5\n')
    assert len(pc.campaign(file)) == 2
    for content, key in (("seed = 1", "spots"), ("spots = 0", "spots"), ("spots = 1\nspot = 2", "spot")):
        file.write_text(content)
        with pytest.raises(pc.ConfigError) as caught:
            pc.campaign(file)
        assert caught.value.key == key
    with pytest.raises(pc.ConfigError) as caught:
        pc.campaign({**SPOTS, "spots": 10_000_001})
    assert caught.value.key == "spots"
    for bad in (None, 3, [], {"spots": object()}):
        with pytest.raises(pc.ConfigError):
            pc.campaign(bad)


def test_ctrl_c_stops_a_campaign():
    code = (
        "import photocoag as pc, sys\n"
        "print('ready', flush=True)\n"
        "try:\n"
        "    pc.campaign({'spots': 2_000_000, 'input': [{'key': 'plant.absorption_factor',\n"
        "        'distribution': 'uniform', 'low': 0.5, 'high': 1.5}]}, threads=2)\n"
        "except KeyboardInterrupt:\n"
        "    print('stopped')\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(2.0)
    child.send_signal(2)
    assert child.communicate(timeout=60)[0] == "stopped\n"
    assert child.returncode == 0


def test_an_exception_of_the_progress_ends_the_work(config):
    def fail(done, total):
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        pc.simulate_many(config, range(2000), progress=fail)
