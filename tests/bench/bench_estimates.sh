#!/usr/bin/env bash
# bench_estimates.sh - what a job is estimated to take beside what it takes: processor time of a daemon with one worker, on
# the subcortical meshes of tests/data, at DEGREES="8 15 31". server/compute/seconds.c is fitted to it.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

DEGREES=${DEGREES:-8 15 31}
REQUEST_SECONDS=600

# A line of the table; pairs or members, by which seconds are divided as well.
one() { # PROCESS INPUTS NAME DIVISOR
    local told before after
    post_json "/v1/processes/$1/estimate" "{\"inputs\":$2}"
    told=$(json .estimatedSeconds)
    before=$(processor_of "$SERVER_PID")
    execute "$1" "$2" --header 'Prefer: wait=600'
    after=$(processor_of "$SERVER_PID")
    [ "$STATUS" = 200 ] || echo "$1: status $STATUS: $(head -c 300 "$BODY")" >&2
    awk -v name="$3" -v degree="$degree" -v told="$told" -v took="$(jq -n "$after - $before")" -v each="$4" 'BEGIN {
        ratio = told == "null" ? "-" : sprintf("%.2f", told / (took + 0.01)) # a tick of the clock
        printf "%6d %-24s %9s %9.2f %7s %10.0f\n", degree, name, told == "null" ? "-" : sprintf("%.2f", told), took, ratio,
            1000 * took / each
    }'
}

start_server "$SCRATCH/data" --workers 1 || exit 1
meshes=()
for file in tests/data/aal_subcortex/*.ply; do
    name=$(basename "$file" .ply)
    post "/v1/meshes?name=$name" --data-binary "@$file"
    meshes+=("{\"id\":\"$(json .id)\"}")
done
post_json /v1/cohorts "{\"name\":\"meshes\",\"members\":[$(IFS=, && echo "${meshes[*]}")]}"
n=${#meshes[@]}
pairs=$((n * (n - 1) / 2))
printf '%6s %-24s %9s %9s %7s %10s\n' degree job estimate took ratio 'ms of one'
for degree in $DEGREES; do
    one encode "{\"cohort\":\"meshes\",\"lmax\":$degree}" "encode $n" "$n"
    members=$(json '[.rows | to_entries[] | {id: .value.surface, label: (if .key % 2 == 0 then "a" else "b" end)}]')
    post_json /v1/cohorts "{\"name\":\"d$degree\",\"members\":$members}"
    a=$(jq -r '.[0].id' <<<"$members") b=$(jq -r '.[5].id' <<<"$members")
    one register "{\"template\":\"$a\",\"moving\":\"$b\"}" register 1
    one geodesic "{\"from\":\"$a\",\"to\":\"$b\",\"steps\":7,\"register\":false}" 'geodesic of 7' 7
    one invert "{\"srnf\":{\"surface\":\"$a\"}}" invert 1
    one distances "{\"cohort\":\"d$degree\"}" "distances of $pairs pairs" "$pairs"
    one neighbours "{\"cohort\":\"d$degree\",\"k\":3}" "neighbours of $n" "$n"
    one pca "{\"cohort\":\"d$degree\"}" "pca of $n" "$n"
    one pca "{\"cohort\":\"d$degree\",\"commonPose\":true}" 'in a common pose' "$n"
    one classify "{\"cohort\":\"d$degree\",\"method\":[\"srnf-gauss\"],\"permutations\":99,\"seed\":1}" "classify $n" "$n"
    one classify "{\"cohort\":\"d$degree\",\"method\":[\"icp-nn\"],\"permutations\":99,\"seed\":1}" 'by icp' "$n"
done
stop_server
