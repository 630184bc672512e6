#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Maps many recordings as a Slurm array: map_many_slurm.sh LIST OUT [OPTION of event-fusion map]...
# It submits itself. CPUS=N: cores per recording. docs/many-recordings.md explains LIST, OUT and more.
#SBATCH --ntasks=1
#SBATCH --requeue
#SBATCH --open-mode=append
[ $# -ge 2 ] || { sed -n 3,4p "$0" >&2; exit 2; }
list=$1 out=$2

if [ -z "$SLURM_ARRAY_TASK_ID" ]; then
    here=$(cd "$(dirname "$0")" && pwd)
    "$here/recordings.py" jobs "$@" || exit 2
    mkdir -p "$out/slurm"
    job=$(sbatch --parsable --array="1-$(wc -l <"$out/jobs")" --cpus-per-task="${CPUS:-4}" \
        --output="$out/slurm/%a.txt" "$0" "$@") || exit 1
    job=${job%%;*}
    table=$(printf '%q ' "$here/recordings.py" table "$list" "$out")
    sbatch --dependency="afterany:$job" --output="$out/table.txt" --wrap="$table"
    exit
fi

export MAP_THREADS=${SLURM_CPUS_PER_TASK:-$SLURM_CPUS_ON_NODE}
bash -c "$(sed -n "${SLURM_ARRAY_TASK_ID}p" "$out/jobs")"
status=$?
# 75: the program was killed. It is tried three times; Slurm does not try again by itself.
if [ $status = 75 ]; then
    [ "${SLURM_RESTART_COUNT:-0}" -lt 2 ] || exit 1
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" && sleep 60 # Slurm ends this script
fi
exit $status
