#!/usr/bin/env bash
# The curl lines of README and of the reference in docs/, run word for word against a live server. Then the server's log
# must show every route of the table answered well at least once. Tokens come last, as nothing works without one then.
#
# The server is one on which nothing is ready at once: it has one worker, which has a job of its own, and answers an
# execution with its job after a millisecond where the request does not ask for more. So lines that take the results
# for granted store null. The job is the one that README asks for, which then has its results.
# The other scripts of this folder ask the same of the daemon that sanitizers watch, of smaller surfaces.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --access-log all --workers 1 --sync-wait-seconds 0.001 || exit 1

for name in L_thalamus L_putamen L_hippocampus; do
    post /v1/meshes --data-binary "@tests/data/aal_subcortex/$name.ply"
    json .id
done >"$SCRATCH/meshes"
post_json /v1/processes/distances/execution "{\"inputs\":{\"surfaces\":$(jq -R . "$SCRATCH/meshes" | jq -sc .)}}"
is "$STATUS $(json .type)" '201 process' 'a job keeps the worker busy, and an execution does not wait for it'

run_documents docs/reference.md README.md docs/security.md
for document in docs/reference.md README.md docs/security.md; do
    check "$document has curl lines" grep -q '^ *curl ' "$document"
done
compare "$(grep -c curl "$SCRATCH/blocks.sh")" '>=' 20 'and there are twenty in all'
for file in openapi.yaml thalamus.ply encoded.json coefficients.json srnf.npy grid.npy thalamus.glb geodesic.json registered.json \
    distances.csv scores.csv modes.npy classified.json; do
    check "$file was written" test -s "$SCRATCH/clone/$file"
done
while read -r file; do
    unlike "$(jq -c . "$file")" '^(null|"")?$' "${file##*/} holds a document"
done < <(find "$SCRATCH/clone" -maxdepth 1 -name '*.json')
is "$(grep -c '"type":"process"' "$SCRATCH/clone"/*.json | grep -vc ':0$')" 0 'and none of them a job instead of its results'
is "$(grep -E "^\++ [A-Z]+=('?null'?|'')?\$" "$SCRATCH/trace" | sort -u)" '+ MEMBERS=' 'no variable is null, or empty but that which grows'
is "$(grep -E '^ *("[a-zA-Z]+": )?null,?$' "$SCRATCH/out" | grep -vE '"(default|queuePosition|estimatedSecondsLeft|limit)"')" '' \
    'and nothing that is shown is null, but for what may be'
check 'the content that comes back is the file' cmp "$SCRATCH/clone/thalamus.ply" tests/data/aal_subcortex/L_thalamus.ply

jq -Rr 'fromjson? | select(.event == "request" and .status < 400) | "\(.method) \(.path)"' "$SERVER_LOG" |
    sort -u >"$SCRATCH/asked"
while read -r method pattern _; do
    expression=$(sed 's/[.]/[.]/g; s/{[a-z]*}/[^\/]+/g' <<<"$pattern")
    check "the documents show $method $pattern" grep -qE "^$method $expression\$" "$SCRATCH/asked"
done < <("$SRNFD" routes | grep -v ' /v1/leases') # what srnfd worker speaks, and nobody else: test_workers.sh

stop_server || not_ok 'the server ends well'
done_testing
