#!/usr/bin/env bash
# cluster.sh - a Slurm cluster on this machine for tests: munged, slurmctld and slurmd as Debian packages have them, started
# by hand as root, on ports of loopback that the system has free.
#
#   tests/slurm/cluster.sh up FOLDER [NODES]     three nodes of two processors; then: . FOLDER/env
#   tests/slurm/cluster.sh far FOLDER [NODES]    the same within a network namespace of the caller's own (unshare --net),
#                                                where the last node has a network for itself, beyond a cable
#   tests/slurm/cluster.sh cut FOLDER            pulls that cable
#   tests/slurm/cluster.sh heal FOLDER           and puts it back
#   tests/slurm/cluster.sh start FOLDER NAME     slurmctld, or a node (n1), again
#   tests/slurm/cluster.sh pid FOLDER NAME       its process
#   tests/slurm/cluster.sh down FOLDER           cancels all jobs and ends what was started, by its process ids
#
# FOLDER/env has the variables SLURM_CONF and NEAR, the address under which all nodes reach this side of the cable.
# Exit status 3: there is no Slurm on this machine. Everything lies in FOLDER.
set -u
export LC_ALL=C
PATH=$PATH:/usr/sbin:/sbin
ACTION=${1:?up, far, cut, heal, start, pid or down}
LAB=$(readlink -m "${2:?a folder}")
HOST=$(hostname -s)
NEAR=127.0.0.1 # this side of the cable
FAR=           # the other side
LAST=          # the node there

free_ports() { # COUNT
    /usr/bin/python3 -c 'import socket, sys
held = [socket.socket() for _ in range(int(sys.argv[1]))]
for s in held: s.bind(("127.0.0.1", 0))
print(*[s.getsockname()[1] for s in held])' "$1"
}

# A network namespace with one end of a cable, as long as a process lives in it.
lay_cable() {
    local holder i
    ip link set lo up
    unshare --net sleep infinity </dev/null >/dev/null 2>&1 &
    holder=$!
    echo $holder >"$LAB/run/far.pid"
    for i in $(seq 1 100); do
        [ "$(readlink /proc/$holder/ns/net)" = "$(readlink /proc/$$/ns/net)" ] || break
        sleep 0.05
    done
    ip link add near type veth peer name far netns $holder &&
        ip addr add $NEAR/24 dev near && ip link set near up &&
        beyond ip link set lo up && beyond ip addr add $FAR/24 dev far && beyond ip link set far up
}

beyond() { # COMMAND..
    nsenter --net="/proc/$(cat "$LAB/run/far.pid")/ns/net" "$@"
}

configure() { # NODES
    local ports i address
    read -ra ports < <(free_ports $(($1 + 1)))
    cat >"$LAB/slurm.conf" <<CONF
ClusterName=srnfdtest
SlurmctldHost=$HOST($NEAR)
SlurmctldPort=${ports[0]}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$LAB/munge/munge.sock
CredType=cred/munge
$([ -n "$FAR" ] || echo CommunicationParameters=NoInAddrAny,NoCtldInAddrAny)
StateSaveLocation=$LAB/state
SlurmctldPidFile=$LAB/run/slurmctld.pid
SlurmctldLogFile=$LAB/log/slurmctld.log
SlurmdPidFile=$LAB/run/%n.pid
SlurmdLogFile=$LAB/log/%n.log
SlurmdSpoolDir=$LAB/spool-%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,bf_interval=5
PriorityType=priority/basic
ReturnToService=2
SlurmdTimeout=20
SlurmctldTimeout=10
InactiveLimit=0
KillWait=5
MinJobAge=300
JobRequeue=1
PropagateResourceLimits=NONE
PropagatePrioProcess=0
CONF
    for i in $(seq 1 "$1"); do
        address=$NEAR
        [ "n$i" = "$LAST" ] && address=$FAR
        echo "NodeName=n$i NodeHostname=$HOST NodeAddr=$address Port=${ports[$i]} CPUs=2 RealMemory=4000 State=UNKNOWN"
    done >>"$LAB/slurm.conf"
    echo "PartitionName=shape Nodes=ALL Default=YES MaxTime=1-0 State=UP OverSubscribe=NO" >>"$LAB/slurm.conf"
    echo "export SLURM_CONF=$LAB/slurm.conf NEAR=$NEAR LAST=$LAST" >"$LAB/env"
}

start() { # NAME
    case $1 in
    slurmctld) slurmctld -f "$LAB/slurm.conf" ;;
    n*)
        mkdir -p "$LAB/spool-$1"
        if [ "$1" = "$LAST" ]; then
            beyond slurmd -N "$1" -f "$LAB/slurm.conf"
        else
            slurmd -N "$1" -f "$LAB/slurm.conf"
        fi
        ;;
    esac
}

up() { # NODES
    local program i ready=0
    for program in munged slurmctld slurmd sbatch squeue scancel sinfo; do
        command -v $program >/dev/null || {
            echo "$program is not installed (apt-get install --no-install-recommends slurm-wlm munge)"
            exit 3
        }
    done
    [ "$(id -u)" = 0 ] || {
        echo "a cluster is started as root"
        exit 3
    }
    umask 022
    mkdir -p "$LAB"/{run,log,state,munge}
    chmod 755 "$LAB" "$LAB"/*
    if [ "$ACTION" = far ]; then
        NEAR=10.77.0.1 FAR=10.77.0.2 LAST=n$1
        lay_cable || exit 1
    fi
    configure "$1"
    head -c 1024 /dev/urandom >"$LAB/munge/munge.key"
    chmod 600 "$LAB/munge/munge.key"
    munged --key-file="$LAB/munge/munge.key" --socket="$LAB/munge/munge.sock" --pid-file="$LAB/run/munged.pid" \
        --log-file="$LAB/log/munged.log" --seed-file="$LAB/munge/munge.seed" --force 2>"$LAB/log/munged.err" || {
        cat "$LAB/log/munged.err"
        exit 1
    }
    . "$LAB/env"
    start slurmctld || exit 1
    for i in $(seq 1 "$1"); do start "n$i" || exit 1; done
    for i in $(seq 1 100); do
        ready=$(timeout 5 sinfo -h -N -t idle -o %n 2>/dev/null | wc -l)
        [ "$ready" = "$1" ] && return
        sleep 0.2
    done
    timeout 5 sinfo -N -l
    exit 1
}

# Ends a process that this started, if it is still that.
stop() { # NAME PROGRAM
    local pid i
    pid=$(cat "$LAB/run/$1.pid" 2>/dev/null) || return
    case $(cat "/proc/$pid/comm" 2>/dev/null) in
    "$2"*) ;;
    *) return ;;
    esac
    kill "$pid"
    for i in $(seq 1 60); do
        kill -0 "$pid" 2>/dev/null || return
        sleep 0.1
    done
    kill -9 "$pid"
}

down() {
    local file
    [ -e "$LAB/env" ] || return
    . "$LAB/env"
    timeout 5 scancel --user=root 2>/dev/null && sleep 1
    for file in "$LAB"/run/n*.pid; do
        [ -e "$file" ] && stop "$(basename "$file" .pid)" slurmd
    done
    stop slurmctld slurmctld
    stop munged munged
    [ ! -e "$LAB/run/far.pid" ] || stop far sleep
}

case $ACTION in
up | far) up "${3:-3}" ;;
cut) ip link set near down ;;
heal) ip link set near up ;;
start)
    . "$LAB/env"
    start "$3"
    ;;
pid) cat "$LAB/run/$3.pid" ;;
down) down ;;
esac
