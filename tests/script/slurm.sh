#!/usr/bin/env bash
# examples/slurm/campaign.sh with stand-ins for srun, squeue and scontrol: interrupted by its time limit again and again it
# ends with the bytes of a campaign that was not; what cannot succeed, or was cancelled, is not queued again.
# Arguments: program, job script.
set -euo pipefail
program="$1" job="$2"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; cat "$work/said" 2>/dev/null; exit 1; }
bash -n "$job"
! command -v shellcheck >/dev/null || shellcheck "$job"

mkdir "$work/bin"
# Sends SIGTERM once the journal has grown by $GROWTH bytes, as the time limit of --signal does; options are srun's own.
cat >"$work/bin/srun" <<'END'
#!/usr/bin/env bash
[ "$1" != --mpi=list ] || { echo "MPI plugin types are... ${PLUGINS:-none pmi2}" >&2; exit 0; }
echo "$@" >"$LAUNCHED"
while [[ "$1" == -* ]]; do shift; done
bytes() { stat -c %s "$JOURNAL" 2>/dev/null || echo 0; }
end=$(($(bytes) + GROWTH))
"$@" &
pid=$!
while kill -0 "$pid" 2>/dev/null; do
  [ "$(bytes)" -lt "$end" ] || { kill -TERM "$pid"; break; }
  sleep 0.01
done
wait "$pid"
END
printf '#!/bin/sh\necho "${STATE:-RUNNING}"\n' >"$work/bin/squeue"
printf '#!/bin/sh\n[ "$*" = "requeue 42" ] && touch "%s/requeued"\n' "$work" >"$work/bin/scontrol"
chmod +x "$work/bin/"*
export PATH="$work/bin:$PATH" PHOTOCOAG="$program" LAUNCH="srun --mpi=pmix" SLURM_JOB_ID=42 SLURM_CPUS_PER_TASK=1
export XDG_CACHE_HOME="$work/cache" JOURNAL="$work/out/journal.bin" GROWTH=400000 LAUNCHED="$work/launched"
unset PLUGINS

cat >"$work/spots.toml" <<'END'
spots = 10000
set = ["plant.model=reduced", "run.duration_ms=20", "grid.min_cells=4000"]
[[input]]
key = "plant.absorption_factor"
distribution = "uniform"
low = 0.4
high = 1.4
END

# What Slurm does: a queued job is started again.
jobs=0
while true; do
  rm -f "$work/requeued"
  status=0
  "$job" "$work/spots.toml" "$work/out" >"$work/said" 2>&1 || status=$?
  jobs=$((jobs + 1))
  [ -e "$work/requeued" ] || break
  [ ! -e "$work/out/campaign.h5" ] || fail "a table before the end"
  [ "$jobs" -lt 50 ] || fail "no end"
done
[ "$status" -eq 0 ] || fail "exit code $status"
[ "$jobs" -ge 3 ] || fail "only $jobs jobs: nothing was interrupted"
"$program" campaign "$work/spots.toml" --out "$work/whole" --threads 2 >"$work/said" 2>&1 || fail "the whole"
for file in campaign.h5 summary.json tables.md index.html; do
  cmp "$work/whole/$file" "$work/out/$file" || fail "$file differs"
done

not_again() { # description, expected exit code, campaign
  rm -rf "$work/out" "$work/requeued"
  status=0
  "$job" "$3" "$work/out" >"$work/said" 2>&1 || status=$?
  [ "$status" -eq "$2" ] || fail "$1: exit code $status"
  [ ! -e "$work/requeued" ] || fail "$1: queued again"
}
STATE=CANCELLED not_again "cancelled" 1 "$work/spots.toml"
not_again "a file that is not there" 2 "$work/none.toml"
mkdir -p "$work/early"
printf '#!/bin/sh\nexit 1\n' >"$work/early/photocoag"
chmod +x "$work/early/photocoag"
PHOTOCOAG="$work/early/photocoag" not_again "stopped at once" 1 "$work/spots.toml"
# Unless told otherwise: srun as it is, or with PMIx where there is that.
launched() { # what Slurm offers, the arguments before the program
  printf '#!/bin/sh\n' >"$work/early/photocoag"
  PLUGINS="$1" LAUNCH="" PHOTOCOAG="$work/early/photocoag" not_again "$1" 0 "$work/spots.toml"
  [ "$(cut -d / -f 1 "$LAUNCHED")" = "$2" ] || fail "$1: srun $(cat "$LAUNCHED")"
}
launched "none pmi2" ""
launched "none pmix pmi2" "--mpi=pmix "
echo "$jobs jobs, the same bytes"
