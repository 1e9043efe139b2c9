#!/usr/bin/env bash
# fake_slurm.sh - stands for sbatch, squeue and scancel in tests: links of these names to it run pilots on this machine and
# keep their states in the folder `state` beside the links.
#
# state/nodes       how many elements may run at once (2)
# state/reason      why others are pending (Resources)
# state/sbatch, state/squeue, state/scancel    how that program behaves: nothing special where there is no file;
#     refuse TEXT   prints the text on standard error and fails
#     hang          does nothing, and does not end
#     late          does its work and does not end
#     drop          does its work and fails
#     garbage       does its work and prints what nobody can read
#     flood         prints 6 MiB
#     hide          does its work and prints nothing
# state/memory      MiB below which an element ends as OUT_OF_MEMORY
# state/given       MiB of elements that ask for none; without the file Slurm gives no memory at all
# state/calls       one line a call: program and arguments; state/seen-N: arguments and environment of a call of sbatch,
#                   as /proc has them
# state/ID/N/       an element: word (its state, or DELAYED: pending until some time), pid, worker (the process of its
#                   script)
# state/asleep      processes of those that did not end
# state/instead     a script that elements run instead of their own, whose path is its argument
set -u
umask 077
STATE=${0%/*}/state # the daemon calls the links by whole paths
[ -d "$STATE" ] || mkdir -p "$STATE"
PROGRAM=${0##*/}
exec 9>"$STATE/lock"

# The first line of a file, or the second argument: sets LINE. Without a process: there are many files.
line() { # FILE [OTHERWISE]
    LINE=${2-}
    [ -e "$1" ] && read -r LINE <"$1"
}

is_word() { # ELEMENT WORD
    line "$1/word"
    [ "$LINE" = "$2" ]
}

# How the element's process ended, where it has.
settle() {
    local element
    for element in "$STATE"/*/*/; do
        is_word "$element" RUNNING || continue
        if [ -s "$element/status" ]; then
            line "$element/status"
            if [ "$LINE" = 0 ]; then echo COMPLETED >"$element/word"; else echo FAILED >"$element/word"; fi
        elif line "$element/pid" && ! kill -0 "$LINE" 2>/dev/null && [ ! -s "$element/status" ]; then
            echo NODE_FAIL >"$element/word"
        fi
    done
}

start() { # ELEMENT ARRAY
    local element=$1 own=$2/script script=$2/script
    line "$2/memory"
    if [ -e "$STATE/memory" ] && [ "$LINE" -lt "$(cat "$STATE/memory")" ]; then
        echo OUT_OF_MEMORY >"$element/word"
        return
    fi
    # Before it counts as running: whoever waits for that may take the script away then.
    if [ -e "$STATE/instead" ]; then
        script=$element/instead
        cp "$STATE/instead" "$script"
    fi
    echo RUNNING >"$element/word"
    setsid bash -c 'cd /; echo $$ >"$1/pid"; sh "$2" "$3" & echo $! >"$1/worker"; wait $!; echo $? >"$1/status"' \
        pilot "$element" "$script" "$own" 9>&- </dev/null >/dev/null 2>>"$STATE/pilots.log" &
    while [ ! -s "$element/worker" ]; do sleep 0.01; done
}

# Starts what there is room for.
schedule() {
    local element running=0 nodes
    line "$STATE/nodes" 2
    nodes=$LINE
    settle
    for element in "$STATE"/*/*/; do
        is_word "$element" RUNNING && running=$((running + 1))
    done
    for element in "$STATE"/*/*/; do
        if [ "$running" -lt "$nodes" ] && is_word "$element" PENDING; then
            start "${element%/}" "${element%/*/}"
            running=$((running + 1))
        fi
    done
}

submit() { # ARGUMENTS..
    local argument size=1 name='' memory=0 id n
    for argument; do
        case $argument in
        --array=1-*) size=${argument#--array=1-} ;;
        --job-name=*) name=${argument#--job-name=} ;;
        --mem=*M) memory=${argument#--mem=} memory=${memory%M} ;;
        esac
    done
    id=$(($(cat "$STATE/last" 2>/dev/null || echo 100) + 1))
    echo $id >"$STATE/last"
    mkdir "$STATE/$id"
    cat >"$STATE/$id/script"
    echo "$name" >"$STATE/$id/name"
    [ "$memory" != 0 ] || memory=$(cat "$STATE/given" 2>/dev/null || echo 0)
    echo "$memory" >"$STATE/$id/memory"
    for n in $(seq 1 "$size"); do
        mkdir "$STATE/$id/$n"
        echo PENDING >"$STATE/$id/$n/word"
    done
    schedule
    echo "$id"
}

# What the elements of an array were given.
resources() { # ID
    local element
    line "$STATE/$1/memory" 0
    for element in "$STATE/$1"/*/; do
        if [ "$LINE" = 0 ]; then echo 'cpu=1,node=1,billing=1'; else echo "cpu=1,mem=${LINE}M,node=1,billing=1"; fi
    done
}

list() { # ARGUMENTS..
    local argument names='' element array name reason id='' asks=''
    for argument; do
        case $argument in
        --jobs=*) id=${argument#--jobs=} ;;
        tres-alloc*) asks=resources ;;
        --name=*) names=,${argument#--name=}, ;;
        --me) names=all ;;
        esac
    done
    if [ -n "$asks" ]; then
        resources "$id"
        return
    fi
    schedule
    for element in "$STATE"/*/*/; do
        element=${element%/}
        [ -e "$element/word" ] || continue
        array=${element%/*}
        line "$array/name"
        name=$LINE
        [[ $names == all || $names == *,$name,* ]] || continue
        line "$STATE/reason" Resources
        reason=$LINE
        line "$element/word"
        case $LINE in
        PENDING) ;;
        DELAYED) LINE=PENDING reason=BeginTime ;;
        FAILED) reason=NonZeroExitCode ;;
        TIMEOUT) reason=TimeLimit ;;
        *) reason=None ;;
        esac
        printf '%s|%s_%s|%s|%s\n' "$name" "${array##*/}" "${element##*/}" "$LINE" "$reason"
    done
}

cancel() { # IDS..
    local id element
    settle
    for id; do
        case $id in
        *_*) set -- "$STATE/${id%_*}/${id#*_}" ;;
        *) set -- "$STATE/$id"/*/ ;;
        esac
        for element; do
            line "$element/word"
            case $LINE in
            PENDING) echo CANCELLED >"$element/word" ;;
            RUNNING | DELAYED)
                echo CANCELLED >"$element/word"
                kill -TERM "$(cat "$element/worker")" 2>/dev/null
                ;;
            esac
        done
    done
}

work() { # ARGUMENTS..
    flock 9
    case $PROGRAM in
    sbatch) submit "$@" ;;
    squeue) list "$@" ;;
    scancel) cancel "$@" ;;
    esac
    flock -u 9
}

# What the controller does it does to the end, whatever becomes of the program that asked for it.
at_work() { # ARGUMENTS..
    AT_WORK=1 setsid "$0" "$@"
}

sleep_on() {
    echo $$ >>"$STATE/asleep"
    exec sleep 600
}

if [ -n "${AT_WORK-}" ]; then
    unset AT_WORK
    work "$@"
    exit
fi
echo "$PROGRAM $*" >>"$STATE/calls"
if [ "$PROGRAM" = sbatch ]; then
    tr '\0' '\n' <"/proc/$$/cmdline" >"$STATE/seen-$$"
    tr '\0' '\n' <"/proc/$$/environ" >>"$STATE/seen-$$"
fi
line "$STATE/$PROGRAM"
MODE=$LINE
case $MODE in
refuse*)
    echo "$PROGRAM: error: ${MODE#refuse }" >&2
    exit 1
    ;;
hang) sleep_on ;;
late)
    at_work "$@" >/dev/null
    sleep_on
    ;;
drop)
    at_work "$@" >/dev/null
    echo "$PROGRAM: error: Unable to contact slurm controller (connect failure)" >&2
    exit 1
    ;;
garbage)
    at_work "$@" >/dev/null
    printf 'Segmentation\001 fault\377\n'
    ;;
hide) at_work "$@" >/dev/null ;;
flood) head -c 6291456 /dev/zero | tr '\0' x ;;
*) at_work "$@" ;;
esac
