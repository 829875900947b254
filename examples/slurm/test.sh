#!/bin/bash
# The scripts of this folder against a real Slurm of one node, which this starts and stops:
#
#     sudo apt-get install slurm-wlm munge
#     cargo build --release -p drt-cli
#     sudo bash examples/slurm/test.sh
#
# Needs root, as Slurm's node daemon does; touches nothing outside a folder of its own.
set -euo pipefail
cd "$(dirname "$0")/../.."
export DRT="${DRT:-$PWD/target/release/drt}"
scripts=$PWD/examples/slurm

for program in munged slurmctld slurmd sbatch squeue "$DRT"; do
    command -v "$program" >/dev/null || { echo "there is no $program; see the first lines of $0" >&2; exit 2; }
done
[ "$(id -u)" = 0 ] || { echo "Slurm's node daemon needs root" >&2; exit 2; }

work=$(mktemp -d)
chmod 755 "$work"
started=()
stop() {
    for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait 2>/dev/null || true
    rm -rf "$work"
}
trap stop EXIT
trap 'exit 1' INT TERM

# A node with its controller, and the daemon by which they know each other.
mkdir -p "$work"/{munge,state,spool}
chmod 700 "$work/munge"
head -c 1024 /dev/urandom >"$work/munge/key"
chmod 600 "$work/munge/key"
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge.socket" --pid-file="$work/munge/pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed" >"$work/munged.out" 2>&1 &
started+=($!)
node=$(hostname -s)
cpus=$(nproc)
export SLURM_CONF=$work/slurm.conf
cat >"$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CryptoType=crypto/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmdParameters=config_overrides
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName=$node NodeAddr=127.0.0.1 CPUs=$cpus State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
# No limits are set here, so the plugin has nothing to do; it can only be left out since 23.11.
case "$(slurmd -V)" in
*' 1'?.* | *' '2[0-2].* | *' 23.02'*) echo "CgroupPlugin=cgroup/v1" ;;
*) echo "CgroupPlugin=disabled" ;;
esac >"$work/cgroup.conf"
for _ in $(seq 50); do [ -S "$work/munge.socket" ] && break; sleep 0.1; done
slurmctld -D -L "$work/slurmctld.log" >/dev/null 2>&1 &
started+=($!)
slurmd -D -L "$work/slurmd.log" >/dev/null 2>&1 &
started+=($!)
for _ in $(seq 60); do
    [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break
    sleep 1
done
sinfo || { tail -n 20 "$work"/slurm*.log; exit 1; }

# Waits until no job is left, and shows why where one failed.
finished() {
    while [ -n "$(squeue -h)" ]; do sleep 1; done
}
check() { # what, command...
    local what=$1
    shift
    if "$@"; then echo "ok     $what"; else
        echo "FAILED $what"
        tail -n 20 "$work"/run/*.out "$work"/slurm*.log
        exit 1
    fi
}
same() { # layers of two images
    python3 - "$1" "$2" <<'PY'
import sys

def pixels(path):
    """The bytes of an EXR file from its table of offsets on: headers tell of times."""
    data = open(path, "rb").read()
    at = 8
    while data[at] != 0:
        at = data.index(b"\0", at) + 1
        at = data.index(b"\0", at) + 1
        at += 4 + int.from_bytes(data[at : at + 4], "little")
    at += 1
    # The first offset says where the table ends and where pixels begin.
    return data[int.from_bytes(data[at : at + 8], "little") :]

sys.exit(pixels(sys.argv[1]) != pixels(sys.argv[2]))
PY
}

mkdir "$work/run"
cp -r examples/surface-box "$work/run/box"
cp -r examples/meshes "$work/run/" 2>/dev/null || true
cd "$work/run"
tiny=(--size 16x16 --spp 32)
export SBATCH_EXTRA="--cpus-per-task=1"
sbatch --version
bash "$scripts/submit.sh" 8 grad box/job.toml out.exr "${tiny[@]}"
finished
"$DRT" grad box/job.toml -o whole.exr --quiet "${tiny[@]}"
check "8 shards and a dependent merge make the pixels of one run" same out.exr whole.exr
check "no shard is left" test -z "$(ls out.*-8.exr 2>/dev/null)"

mkdir sweep
for v in 0.0 0.1 0.2 0.3 0.4; do
    echo "box/job.toml ${tiny[*]} --set parameter.cube-x.value=$v -o sweep/$v.exr"
done >list
sbatch --parsable --cpus-per-task=1 --array=1-3 "$scripts/sweep.sbatch" list sweep
finished
for v in 0.0 0.1 0.2 0.3 0.4; do
    "$DRT" grad box/job.toml --set "parameter.cube-x.value=$v" -o one.exr --quiet "${tiny[@]}"
    check "the sweep has cube-x = $v" same "sweep/$v.exr" one.exr
done
sbatch --parsable --cpus-per-task=1 --array=1-2 "$scripts/sweep.sbatch" list sweep
finished
check "a second sweep makes nothing again" test "$(cat sweep/task-*-2/batch.jsonl | grep -c '"skipped"')" = 5
echo "all passed"
