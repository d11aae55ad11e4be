#!/usr/bin/env bash
# Runs the recipes for GNU parallel and for a Slurm array (src/lab/README.md) on this machine, and compares the errors of
# the merged studies with those of a study that ran in one piece.
#
#     tests/cluster.sh [--install]
#
# Needs the packages parallel, slurm-wlm and munge; --install installs them with apt-get, as root. Slurm is started with a
# configuration of its own, one node with as many tasks as processors, below a temporary folder, and stopped at the end.
# Not a part of `cargo test`.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
missing=$(for tool in parallel sbatch munged; do command -v "$tool" >/dev/null || echo "$tool"; done)
if [ -n "$missing" ]; then
    [ "${1:-}" = --install ] || { echo "missing:" $missing "- apt-get install parallel slurm-wlm munge, or --install"; exit 2; }
    apt-get install -y --no-install-recommends parallel slurm-wlm munge
fi
[ -n "${SIMPULSE_BIN:-}" ] || cargo build --release --manifest-path "$root/Cargo.toml" --quiet
export PATH="${SIMPULSE_BIN:-$root/target/release}:$PATH"
work=$(mktemp -d)
cd "$work"
scenes=stack:3,arch,bounce,incline_slip
export STUDY="simpulse study --scenes $scenes --quick --lanes 8 --solvers pgs,soft_step,shim"

# The same settings with the same errors, whatever ran where.
same() {
    python3 - "$1" "$2" <<'PYTHON'
import json, sys
def errors(folder):
    records = json.load(open(folder + "/study.json"))["records"]
    return {(r["scene"], r["solver"], r["order"], r["lanes"], r["budget_text"]): r["errors"] for r in records}
one, other = (errors(folder) for folder in sys.argv[1:])
assert one == other and one, "the errors differ"
print(f"{len(one)} settings have the same errors in {sys.argv[1]} and {sys.argv[2]}")
PYTHON
}

echo "== in one piece"
$STUDY --out whole >/dev/null

echo "== GNU parallel: whole scenes"
parallel --will-cite --jobs 2 '$STUDY --shard {}/4 --out scenes-{} >scenes-{}.log 2>&1' ::: 1 2 3 4
simpulse study --merge scenes-{1..4} --out scenes | head -3
same whole scenes
test -s scenes/replay-1.rec

echo "== GNU parallel: errors by scene and solver, then times"
parallel --will-cite --jobs 2 '$STUDY --errors --shard {}/4 --out errors-{} >errors-{}.log 2>&1' ::: 1 2 3 4
simpulse study --merge errors-{1..4} --out errors
$STUDY --times errors --out parallel | head -3
same whole parallel

echo "== a part is missing"
if simpulse study --merge errors-{1,2,4} --out broken 2>missing.txt; then exit 1; fi
cat missing.txt
grep -q -- '--shard 3/4' missing.txt

echo "== Slurm"
user=$(id -un)
mkdir -p daemon/{state,spool,munge}
if ! pgrep -x munged >/dev/null; then
    dd if=/dev/urandom of=daemon/munge/key bs=1024 count=1 status=none
    chmod 700 daemon/munge && chmod 600 daemon/munge/key
    munged --force --socket "$work/daemon/munge/socket" --key-file daemon/munge/key --pid-file daemon/munge/pid \
        --seed-file daemon/munge/seed --log-file daemon/munge/log
    auth_socket=",socket=$work/daemon/munge/socket"
fi
cat >daemon/slurm.conf <<CONF
ClusterName=one
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
CredType=cred/munge
AuthInfo=ttl=300${auth_socket:-}
SlurmctldPort=16817
SlurmdPort=16818
StateSaveLocation=$work/daemon/state
SlurmdSpoolDir=$work/daemon/spool
SlurmctldPidFile=$work/daemon/slurmctld.pid
SlurmdPidFile=$work/daemon/slurmd.pid
SlurmctldLogFile=$work/daemon/slurmctld.log
SlurmdLogFile=$work/daemon/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
ReturnToService=2
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/daemon/slurm.conf
slurmctld
slurmd
stop() {
    for pid in daemon/slurmd.pid daemon/slurmctld.pid daemon/munge/pid; do
        [ -s "$work/$pid" ] && kill "$(cat "$work/$pid")" || true
    done
}
trap stop EXIT
for _ in $(seq 30); do sinfo -h -o %T 2>/dev/null | grep -q idle && break; sleep 1; done
sinfo
cat >array.sh <<'ARRAY'
#!/bin/bash
#SBATCH --array=1-4
#SBATCH --cpus-per-task=1
#SBATCH --output=slurm-%a.log
$STUDY --errors --shard $SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT --out slurm-$SLURM_ARRAY_TASK_ID
ARRAY
job=$(sbatch --parsable array.sh)
cat >merge.sh <<'MERGE'
#!/bin/bash
#SBATCH --exclusive
#SBATCH --output=merge.log
simpulse study --merge slurm-{1..4} --out slurm-errors && $STUDY --times slurm-errors --out slurm
MERGE
merge=$(sbatch --parsable --dependency=afterok:"$job" merge.sh)
echo "array $job, merge $merge"
for _ in $(seq 300); do [ -z "$(squeue -h)" ] && break; sleep 1; done
squeue
head -3 slurm-1.log merge.log
same whole slurm
echo "all recipes work: $work"
