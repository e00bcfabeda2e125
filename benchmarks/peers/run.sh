#!/usr/bin/env bash
# Measures pyMOR and retina-therm beside photocoag: installs both into a virtual environment of their own (Python 3.11 or
# 3.12 with venv; Debian 12: apt install python3-venv), exports the matrices, runs the comparisons.
#   benchmarks/peers/run.sh [pymor|retina-therm]      without a name: both
set -euo pipefail

here=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")
root=$(dirname -- "$(dirname -- "$here")")
work="$root/build/peers"
program="$root/build/release/apps/photocoag"
python="$work/venv/bin/python"

"$root/photocoag" --version >/dev/null # installs what is missing and builds
mkdir -p "$work"
if ! cmp -s "$here/requirements.txt" "$work/installed.txt"; then
  python3 -m venv "$work/venv"
  "$python" -m pip install --quiet --requirement "$here/requirements.txt"
  cp "$here/requirements.txt" "$work/installed.txt"
fi

peer_pymor() {
  rm -rf "$work/matrices"
  mkdir -p "$work/matrices"
  # Trained on five alphas, judged on those that `reduce` judges itself by.
  local judged
  judged=$("$python" -c 'print(",".join(f"{0.3 + 1.4 * i / 28:.12g}" for i in range(29)))')
  "$program" export --alphas 0.29,0.47,0.83,1.29,1.72 --out "$work/matrices/training" 2>/dev/null
  "$program" export --alphas "$judged" --out "$work/matrices/validation" 2>/dev/null
  "$python" "$here/pymor_peer.py" --program "$program" --matrices "$work/matrices" --json "$work/pymor.json"
}

peer_retina_therm() {
  "$python" "$here/retina_therm_peer.py" --program "$program" --json "$work/retina-therm.json"
}

case "${1:-both}" in
  pymor) peer_pymor ;;
  retina-therm) peer_retina_therm ;;
  both) peer_pymor && peer_retina_therm ;;
  *)
    echo "usage: benchmarks/peers/run.sh [pymor|retina-therm]" >&2
    exit 2
    ;;
esac
