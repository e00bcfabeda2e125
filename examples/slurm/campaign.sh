#!/usr/bin/env bash
# A campaign as a Slurm job that comes back until it is done:
#   sbatch examples/slurm/campaign.sh FILE DIR
# FILE is the campaign, DIR its folder, on a disk that the job's nodes share. Before its time is over, or when it is
# preempted, the program is told to stop, keeps every finished spot, and the job queues itself again; a node that dies
# costs the spots in flight. Table and report are written once all spots are there. What is asked for below can be asked
# for otherwise on sbatch's command line, e.g. --ntasks=256 --time=12:00:00.
# PHOTOCOAG: the program, default: photocoag; more than one task needs one built with MPI.
# LAUNCH: what starts its ranks, default: srun, with --mpi=pmix where there is that, which Open MPI needs; for another
# MPI: "srun --mpi=pmi2" and the like (srun --mpi=list).
#SBATCH --job-name=photocoag
#SBATCH --ntasks=16
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=500M
#SBATCH --time=04:00:00
#SBATCH --signal=TERM@120
#SBATCH --requeue
#SBATCH --open-mode=append
set -euo pipefail
[ $# -eq 2 ] || { echo "usage: sbatch campaign.sh FILE DIR" >&2; exit 2; }
file="$1" folder="$2"
pmix=""
[ -n "${LAUNCH:-}" ] || ! srun --mpi=list 2>&1 | grep -qw pmix || pmix=" --mpi=pmix"
read -ra launch <<<"${LAUNCH:-srun$pmix}"

journal_bytes() { stat -c %s "$folder/journal.bin" 2>/dev/null || echo 0; }
before=$(journal_bytes)
status=0
"${launch[@]}" "${PHOTOCOAG:-photocoag}" campaign "$file" --out "$folder" --only-complete \
  --threads "${SLURM_CPUS_PER_TASK:-1}" || status=$?
# 0: complete. 1: interrupted, to be continued. Anything else would go wrong again.
[ "$status" -eq 1 ] || exit "$status"
[ "$(journal_bytes)" -gt "$before" ] || { echo "stopped before a single spot was done: not queued again" >&2; exit 1; }
# A job that was cancelled stays so.
[ "$(squeue --noheader --jobs "$SLURM_JOB_ID" --format %T)" = RUNNING ] || exit 1
scontrol requeue "$SLURM_JOB_ID"
