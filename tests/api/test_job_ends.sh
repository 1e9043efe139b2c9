#!/usr/bin/env bash
# srnfd-test: release-only
# srnfd-test: slow
# srnfd-test: timeout 300
#
# test_job_ends.sh - a job that is told to stop does so: by a client, by --job-seconds and by SIGTERM, at the highest
# degree and on a mesh of slivers. Idle, each ends within a fraction of a second; the limit here is that of a machine
# with other work. tests/bench/bench_ends.sh has all processes.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LIMIT=5 # seconds from being told to the end
RIM=80000

# Two apexes over and under a rim that goes in and out at each vertex: radial blades, two for each vertex of the rim.
blades() { # RIM
    awk -v n="$1" 'BEGIN {
        print "OFF"; print n + 2, 2 * n, 0
        for (i = 0; i < n; i++) { r = i % 2 ? 1 : 0.1; a = 6.283185307179586 * i / n
            printf "%.15g %.15g %.15g\n", 0.8 * r * cos(a), r * sin(a), 0.6 * r * cos(a) }
        print "-0.6 0 0.8"; print "0.6 0 -0.8"
        for (i = 0; i < n; i++) { j = (i + 1) % n; print 3, n, i, j; print 3, n + 1, j, i } }'
}

# Milliseconds from one event of a job to another, by the server's log.
between() { # ID FROM TO
    jq -Rrn --arg id "$1" --arg from "$2" --arg to "$3" '
        def ms: (.[0:19] + "Z" | fromdateiso8601) * 1000 + (.[20:23] | tonumber);
        [inputs | fromjson? | objects | select(.job == $id)] as $lines |
        ([$lines[] | select(.event == $to) | .ts] | last | ms) -
        ([$lines[] | select(.event == $from) | .ts] | first | ms)' "$SERVER_LOG"
}

await_running() { # ID
    local deadline=$(($(date +%s) + 60))
    while [ "$(date +%s)" -lt "$deadline" ]; do
        get "/v1/jobs/$1"
        [ "$(json .status)" = running ] && return 0
        sleep 0.05
    done
    return 1
}

start_server "$SCRATCH/data" --workers 2 --grace-seconds 6 || exit 1

# ---- A client ----------------------------------------------------------------------------------------

blades "$RIM" >"$SCRATCH/blades.off"
post '/v1/meshes?format=off' --data-binary "@$SCRATCH/blades.off"
is "$STATUS $(json .report.analysable)" '201 true' 'a mesh of 160,000 slivers'
BLADES=$(json .id)
execute encode "{\"mesh\":\"$BLADES\",\"lmax\":127,\"parameterization\":\"star\"}" --header 'Prefer: respond-async'
ID=$(json .id)
await_running "$ID"
sleep 0.4
post "/v1/jobs/$ID/cancel"
poll_job "$ID" 60
is "$JOB_STATUS" dismissed 'its encoding is dismissed'
compare "$(between "$ID" job-cancel-requested job-dismissed)" '<=' $((1000 * LIMIT)) 'at once'

# Their coefficients above degree 15 are 0: that costs no encoding at the highest degree, and a registration as much.
SURFACES=()
for name in L_thalamus L_pallidum; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESH=$(json .id)
    execute encode "{\"mesh\":\"$MESH\",\"lmax\":15}" --header 'Prefer: wait=100'
    get "/v1/surfaces/$(json .surface.id)/coefficients?format=json"
    jq -c '[range(128 * 128 - 256) | 0] as $more |
        {coefficients: {lmax: 127, x: (.x + $more), y: (.y + $more), z: (.z + $more)}}' "$BODY" >"$SCRATCH/padded.json"
    post_json /v1/surfaces "@$SCRATCH/padded.json"
    SURFACES+=("$(json .id)")
done
PAIR="{\"template\":\"${SURFACES[0]}\",\"moving\":\"${SURFACES[1]}\",\"symmetric\":true}"

# ---- SIGTERM -----------------------------------------------------------------------------------------

execute register "$PAIR" --header 'Prefer: respond-async'
ID=$(json .id)
await_running "$ID"
for degree in {60..83}; do # one after another, beside it
    execute encode "{\"mesh\":\"$MESH\",\"lmax\":$degree}" --header 'Prefer: respond-async'
done
sleep 0.3
# A request that does not end uses up the grace; the job does not get it once more.
exec 9<>"/dev/tcp/127.0.0.1/${URL##*:}"
printf 'POST /v1/meshes?format=off HTTP/1.1\r\nHost: %s\r\nContent-Length: 100\r\n\r\nOFF' "${URL#http://}" >&9
sleep 0.2
STARTED=$(date +%s%N)
if stop_server; then
    ok 'the server drains'
else
    not_ok 'the server drains'
fi
exec 9>&-
compare "$((($(date +%s%N) - STARTED) / 1000000))" '<=' $((6000 + 1000 * LIMIT)) 'soon after the one grace of six seconds'
is "$(between "$ID" job-running job-accepted | grep -c .)" 1 'the job is put back'
is "$(jq -Rrn '[inputs | fromjson? | objects | .event] | .[index("draining"):] | map(select(. == "job-running")) | length' \
    "$SERVER_LOG")" 0 'no job starts in its grace'
compare "$(sqlite3 -readonly "$SCRATCH/data/srnfd.db" "SELECT count(*) FROM job WHERE status = 'accepted'")" '>=' 2 \
    'those that wait are for the next start'

# ---- The limit ---------------------------------------------------------------------------------------

start_server "$SCRATCH/data" --workers 2 --grace-seconds 1 --job-seconds 1 || exit 1
poll_job "$ID" 60
# Begun for the second time: the stop put it back.
is "$JOB_STATUS $(json .exception.code) $(json .attempt)" 'failed time-limit 2' 'after a second its time is over'
compare "$(between "$ID" job-running job-failed)" '<=' $((1000 + 1000 * LIMIT)) 'and it ends'
stop_server || not_ok 'the server drains'
done_testing
