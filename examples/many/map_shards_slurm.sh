#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Maps one long recording with Slurm: map_shards_slurm.sh SHARDS OUT RECORDING [OPTION of event-fusion map]...
# It submits itself: a plan, an array of shards, a join. CPUS=N: cores of each. docs/cluster.md explains it.
#SBATCH --ntasks=1
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@60
[ $# -ge 3 ] || { sed -n 3,4p "$0" >&2; exit 2; }
program=${EVENT_FUSION:-event-fusion}

if [ -z "$STEP_OF_SHARDS" ]; then
    shards=$1 out=$2
    [[ $shards =~ ^[1-9][0-9]*$ ]] || { echo "error: '$shards': expected the number of shards" >&2; exit 2; }
    mkdir -p "$out.shards/slurm" || exit 2
    submit() { # submit STEP OUTPUT [OPTION of sbatch]...: prints the number of the job
        sbatch --parsable --export="ALL,STEP_OF_SHARDS=$1" --job-name="$1" --output="$out.shards/slurm/$2.txt" \
            --cpus-per-task="${CPUS:-4}" "${@:3}" "$0" "${arguments[@]}" | cut -d ';' -f 1
        return "${PIPESTATUS[0]}"
    }
    arguments=("$@")
    plan=$(submit plan plan) &&
        array=$(submit shard %a --dependency="afterok:$plan" --kill-on-invalid-dep=yes --array="0-$((shards - 1))") &&
        join=$(submit join join --dependency="afterany:$array") || exit 1
    echo "jobs: plan $plan, shards $array, join $join; their output is in $out.shards/slurm"
    exit
fi

shards=$1 out=$2
shift 2
case $STEP_OF_SHARDS in
    plan) command=(plan "$@" --shards "$shards" --out "$out.shards/plan.json") ;;
    shard)
        k=$SLURM_ARRAY_TASK_ID
        command=(map --plan "$out.shards/plan.json" --shard "$k" --out "$out.shards/$k" --quiet)
        ;;
    join)
        command=(join "$out.shards/plan.json" --out "$out")
        for ((k = 0; k < shards; ++k)); do command+=("$out.shards/$k"); done
        ;;
esac
"$program" "${command[@]}" &
trap 'kill -TERM $!' TERM # a minute before the time limit
while wait $!; status=$?; kill -0 $! 2>/dev/null; do :; done

# 75: another try may succeed. So may one of a program that was killed: Slurm does not try it again by itself.
# 130: the plan was stopped, and cannot go on. A job that was cancelled runs no more.
if [ "$status" = 75 ] || { [ "$status" -gt 128 ] && [ "$status" != 130 ]; }; then
    job=${SLURM_ARRAY_JOB_ID:-$SLURM_JOB_ID}${SLURM_ARRAY_TASK_ID:+_$SLURM_ARRAY_TASK_ID}
    [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ] && [ "$(squeue -h -j "$job" -o %T)" = RUNNING ] || exit 1
    scontrol requeue "$job" && sleep 60 # Slurm ends this script
fi
exit "$status"
