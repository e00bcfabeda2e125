#!/usr/bin/env bash
# The driver of docs/own-driver.md keeps every promise against the fake bench, with latency and dropped samples.
# Arguments: the program, the driver, the bench.
set -eu
folder=$(mktemp -d)
python3 "$3" --port 0 --latency-ms 1 --drop 0.02 >"$folder/said" &
bench=$!
trap 'kill $bench; rm -rf "$folder"' EXIT
for _ in $(seq 300); do grep -q listening "$folder/said" && break; sleep 0.1; done
"$1" driver-check "$2" --settings "port=$(sed 's/.*port //' "$folder/said")" --failing port=1 --period-ms 4
