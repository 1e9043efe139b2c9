#!/usr/bin/env bash
# bench_permutations.sh - seconds of a processor that ten thousand permutations take, which the daemon
# computes itself, beside the registrations that come before them: whether it would pay to give them to workers. MEMBERS=40
# scans.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"
# shellcheck source=tests/support/workers.sh
. "$(dirname "$0")/../support/workers.sh"

MEMBERS=${MEMBERS:-40}
REQUEST_SECONDS=600

# Each subject has two scans.
make_cohort() {
    post_json /v1/cohorts "$(jq -c '{name: "shapes", members: [to_entries[] | {id: .value, subject: "s\(.key / 2 | floor)",
        time: (.key % 2), label: (if (.key / 2 | floor) % 2 == 0 then "a" else "b" end)}]}' <<<"$1")"
}

seconds_of() { # PROCESS INPUTS
    local before
    before=$(processor_of "$SERVER_PID")
    execute "$1" "$2" --header 'Prefer: wait=600'
    [ "$STATUS" = 200 ] || echo "status $STATUS: $(head -c 300 "$BODY")" >&2
    awk -v a="$before" -v b="$(processor_of "$SERVER_PID")" 'BEGIN { printf "%.1f", b - a }'
}

start_server "$SCRATCH/data" --workers 2 || exit 1
IDS=()
for name in L_thalamus L_caudate; do
    post "/v1/meshes?name=$name" --data-binary "@tests/data/aal_subcortex/$name.ply"
    execute encode "{\"mesh\":\"$(json .id)\",\"lmax\":15}"
    IDS+=("$(json .surface.id)")
done
make_cohort "$(shapes_between "$MEMBERS" "${IDS[@]}")"
printf '\n%d scans of %d subjects at degree 15\n%16s %14s %10s\n' "$MEMBERS" $((MEMBERS / 2)) process permutations 'cpu s'
for process in compare-groups change; do
    for permutations in 1 9999; do
        printf '%16s %14d %10s\n' "$process" "$permutations" \
            "$(seconds_of "$process" "{\"cohort\":\"shapes\",\"permutations\":$permutations}")"
    done
done
stop_server
