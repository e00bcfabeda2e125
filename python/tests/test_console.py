"""examples/console/watch.py against a console: the documented WebSocket as a client of one's own sees it."""

import os
import re
import subprocess
import sys
from pathlib import Path

WATCH = Path(__file__).parents[2] / "examples" / "console" / "watch.py"


def test_ten_lines_follow_a_spot(tmp_path: Path) -> None:
    spot = ["--set", "grid.min_cells=2000", "--set", "run.duration_ms=60000", "--out", str(tmp_path / "spots")]
    with subprocess.Popen(
        [os.environ["PHOTOCOAG_PROGRAM"], "console", *spot], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as console:
        assert console.stdin and console.stderr
        address = next(m[0] for line in console.stderr if (m := re.search(r"http://\S+", line)))
        console.stdin.write("\n")  # the terminal starts
        console.stdin.flush()
        with subprocess.Popen([sys.executable, str(WATCH), address], stdout=subprocess.PIPE, text=True) as watch:
            assert watch.stdout
            cycle, peak, kelvin, power, watt = watch.stdout.readline().split()
            watch.kill()
        console.terminate()
        console.stderr.read()
    assert (kelvin, watt) == ("K", "W")
    assert int(cycle) >= 0 and float(peak) >= 0.0 and 0.0 <= float(power) <= 0.1
    assert console.returncode == 1  # stopped by hand
