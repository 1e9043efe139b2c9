#!/usr/bin/env bash
# bench_permutations.sh - seconds of a processor that ten thousand permutations, or samples of a bootstrap, take, which the
# daemon computes itself, beside the registrations that come before them: whether it would pay to give them to workers.
# MEMBERS=40 scans.

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
printf '\n%d scans of %d subjects at degree 15\n%16s %14s %12s %10s\n' "$MEMBERS" $((MEMBERS / 2)) process permutations \
    bootstraps 'cpu s'
row() { # PROCESS PERMUTATIONS BOOTSTRAPS [INPUTS]
    printf '%16s %14d %12s %10s\n' "$1" "$2" "$3" \
        "$(seconds_of "$1" "{\"cohort\":\"shapes\",\"permutations\":$2${4-}$([ "$3" = - ] || echo ",\"bootstraps\":$3")}")"
}
row compare-groups 1 -
row compare-groups 9999 -
for few in '1 100' '9999 100' '1 10000'; do
    # shellcheck disable=SC2086
    row change $few
    # shellcheck disable=SC2086
    row regress $few ',"formula":"shape ~ label"'
    # shellcheck disable=SC2086
    row trajectories $few
done
stop_server
