#!/bin/bash
# An export as a Slurm array: every task does its part of the chunks, and the last to end completes
# it. Model, queries and target lie where all nodes see them.
#
#   sbatch --array=0-7 export-slurm.sh reaching.onnx queries.csv /scratch/motions
#
# Further arguments are those of `posefield export`. A task that was killed goes on where it ended
# when it is queued again: sbatch --array=3 --export=ALL,PARTS=8 export-slurm.sh ...
#SBATCH --job-name=posefield-export
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
# Told to stop a minute before its time is up, a task puts away what it began.
#SBATCH --signal=B:TERM@60
set -euo pipefail

if (($# < 3)); then
    echo "usage: sbatch --array=0-N export-slurm.sh MODEL QUERIES TARGET [ARGUMENT...]" >&2
    exit 2
fi
model=$1 queries=$2 target=$3
shift 3

# Array indices count from 0. With some tasks alone, PARTS says how many there were.
parts=${PARTS:-$((SLURM_ARRAY_TASK_MAX + 1))}

exec posefield export "$model" "$queries" --output "$target" \
    --shard "$SLURM_ARRAY_TASK_ID/$parts" --workers "${SLURM_CPUS_PER_TASK:-1}" "$@"
