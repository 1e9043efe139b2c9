#!/usr/bin/env bash
# What a job may have in use (--job-memory): one that needs more fails with memory-limit, wherever on its way it comes
# to that, leaves nothing, and does not disturb the others; with more memory the very same job succeeds.
. "$(dirname "$0")/../support/lib.sh"

DATA=tests/data/aal_subcortex
MIB=1048576

# Runs a job to its end: JOB_STATUS, and the code and the detail of what it failed with.
run_job() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: respond-async'
    job=$(json .id)
    poll_job "$job" 300
    get "/v1/jobs/$job"
    code=$(json '.exception.code // ""')
    detail=$(json '.exception.detail // ""')
}

number_in() { # WORDS-BEFORE: the number that follows them in the detail
    sed -n "s/.*$1 \([0-9]*\)[ .].*/\1/p" <<<"$detail"
}

# The same encode within ever more memory: it fails at another place each time until it has enough.
limit=20000
failures=0
places=
while [ "$limit" -lt $((256 * MIB)) ]; do
    start_server "$SCRATCH/data" --workers 2 --job-memory "$limit" || exit 1
    post '/v1/meshes?format=ply' --data-binary "@$DATA/L_thalamus.ply"
    mesh=$(json .id)
    run_job encode "{\"mesh\":\"$mesh\",\"lmax\":15}"
    [ "$JOB_STATUS" = failed ] || break
    failures=$((failures + 1))
    held=$(number_in with)
    asked=$(number_in for)
    places="$places $held"
    if [ "$code $(json .exception.status) $(number_in is)" != "memory-limit 422 $limit" ] ||
        [ "$held" -gt "$limit" ] || [ $((held + asked)) -le "$limit" ]; then
        not_ok "a limit of $limit bytes is told of" "$code: $detail"
    fi
    # A job that needs nothing to speak of passes beside it.
    if [ "$failures" = 1 ]; then
        is "$(jq -r 'select(.event == "listening") | .jobMemory' "$SERVER_LOG")" 20000 'the log has the limit'
        get /metrics
        is "$(awk '$1 == "srnfd_job_memory_limit_bytes" { print $2 }' "$BODY")" 20000 'and so have the metrics'
    fi
    unlike "$(cat "$SERVER_LOG")" job-memory-kept "with $limit bytes nothing is left"
    stop_server || not_ok 'the server ends well'
    limit=$((limit * 4))
done
is "$JOB_STATUS" successful "with $limit bytes it succeeds"
compare "$failures" '>=' 3 "and failed $failures times before that"
compare "$(tr ' ' '\n' <<<"$places" | sort -u | grep -c .)" '>=' 3 'in different places'
first=$(cat "$SERVER_LOG")
unlike "$first" job-memory-kept 'nor is anything of a success left'
get /metrics
is "$(awk '$1 == "srnfd_job_memory_bytes_count{process=\"encode\"}" { print $2 }' "$BODY")" 1 'the job is in the histogram'
peak=$(awk '$1 == "srnfd_job_memory_bytes_sum{process=\"encode\"}" { print $2 }' "$BODY")
compare "$peak" '<=' "$limit" 'with what it had in use'
compare "$peak" '>' $((limit / 4)) 'which a smaller limit did not allow'

# Beside a job that fails, another one succeeds, and so does a smaller one after it on the same worker.
execute encode "{\"mesh\":\"$mesh\",\"lmax\":16}" --header 'Prefer: respond-async'
beside=$(json .id)
run_job encode "{\"mesh\":\"$mesh\",\"lmax\":63}"
is "$JOB_STATUS $code" 'failed memory-limit' 'a larger job fails'
poll_job "$beside" 300
like "$JOB_STATUS" '^(successful|failed)$' 'the one beside it ends by itself'
run_job encode "{\"mesh\":\"$mesh\",\"lmax\":6}"
is "$JOB_STATUS" successful 'and a smaller one succeeds after it'
run_job encode "{\"mesh\":\"$mesh\",\"lmax\":63}"
is "$JOB_STATUS $code" 'failed memory-limit' 'the same again is not remembered, but computed'
stop_server || not_ok 'the server ends well'

start_server "$SCRATCH/data" --workers 2 || exit 1
memory=$(jq -r 'select(.event == "listening") | .jobMemory' "$SERVER_LOG")
# In the shell's arithmetic: an awk may print such a number with six digits.
total=$(sed -n 's/^MemTotal: *\([0-9]*\) kB$/\1/p' /proc/meminfo)
compare "$memory" '<=' $((total * 1024 / 8 * 3)) \
    'without a limit it is at most three eighths of the machine for each of two'
compare "$memory" '>' $((16 * MIB)) 'and more than nothing'
run_job encode "{\"mesh\":\"$mesh\",\"lmax\":63}"
is "$JOB_STATUS" successful 'which is enough for it'
stop_server || not_ok 'the server ends well'

# Nor may the jobs have more than the address space that the process may have.
if [ -n "$SRNFD_SANITIZED" ]; then
    skip 'a limit of the address space bounds it' 'sanitizers reserve more than any limit'
else
    printf '#!/bin/sh\nulimit -v 2000000 && exec "%s" "$@"\n' "$SRNFD" >"$SCRATCH/narrow"
    chmod +x "$SCRATCH/narrow"
    SRNFD=$SCRATCH/narrow start_server "$SCRATCH/data" --workers 2 || exit 1
    memory=$(jq -r 'select(.event == "listening") | .jobMemory' "$SERVER_LOG")
    compare "$memory" '<=' $((2000000 * 1024 / 16 * 3)) 'a limit of the address space bounds it'
    compare "$memory" '>' $((16 * MIB)) '  to more than nothing'
    run_job encode "{\"mesh\":\"$mesh\",\"lmax\":31}"
    is "$JOB_STATUS" successful '  and jobs run within it'
    stop_server || not_ok 'the server ends well'
fi
done_testing
