#!/usr/bin/env bash
# same_answers.sh - whether two builds answer the same: for each process, the result document of either build on the
# structures of tests/data, at a low degree, to the last bit.
#
#   tests/bench/same_answers.sh OLD-SRNFD NEW-SRNFD
#
# What tells of the run and not of the answer is left out, as a member and in texts: ids of jobs, moments, seconds and
# the numeric build, and the length of the page that has them. Ids of surfaces are of their coefficients, so they are
# answers. Prints a line for each job, with the first members that differ and the largest relative difference of their
# numbers; fails where any does, where a job fails, and where a process of the new build is asked for nothing. One that
# the new build alone has is passed over, with a line that says so.

if [ $# -ne 2 ] || [ ! -x "$1" ] || [ ! -x "$2" ]; then
    echo 'usage: tests/bench/same_answers.sh OLD-SRNFD NEW-SRNFD' >&2
    exit 2
fi
OLD=$(realpath "$1")
NEW=$(realpath "$2")

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

LMAX=8
REQUEST_SECONDS=900

# Of a result document: the answer.
answer() {
    jq -S 'walk(if type == "object" then del(.job, .jobs, .created, .numericBuild, .seconds)
            | if has("html") then del(.bytes) else . end
        elif type == "string" then gsub("job-[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}"; "job")
            | gsub("core [0-9a-f]{16}"; "core") | gsub("\"seconds\":[0-9.e-]+"; "\"seconds\":0")
            | gsub("[0-9]{4}-[0-9]{2}-[0-9]{2}[T ][0-9:.]+Z?"; "moment") | gsub("[0-9]{4}-[0-9]{2}-[0-9]{2}"; "day")
        else . end)'
}

run() { # NAME PROCESS INPUTS: its answer in FOLDER/NAME.json, and the document in BODY
    if [ "$SRNFD" = "$OLD" ] && ! grep -qx "$2" "$FOLDER.listed"; then
        : >"$FOLDER/$1.absent"
        return
    fi
    execute "$2" "$3" --header 'Prefer: wait=300'
    if [ "$STATUS" = 200 ]; then
        answer <"$BODY" >"$FOLDER/$1.json"
    else
        printf '"status %s: %s"\n' "$STATUS" "$(json '.code // .type')" >"$FOLDER/$1.failed"
    fi
}

# The members of cohorts as JSON, from rows of jq with the surfaces as $s: [structure, side] of each.
cohort() { # NAME FILTER
    post_json /v1/cohorts "$(jq -cn --arg name "$1" --argjson s "$(printf '%s\n' "${S[@]}" | jq -R . | jq -sc .)" \
        "{name: \$name, members: [$2]}")"
    [ "$STATUS" = 201 ] || { echo "cohort $1: $(cat "$BODY")" >&2; exit 1; }
}

answers() { # SRNFD FOLDER
    local side name mesh process inputs
    FOLDER=$2
    mkdir "$FOLDER"
    SRNFD=$1
    start_server "$FOLDER.data" --workers 2 || exit 1
    get '/v1/processes?limit=100'
    json '.processes[].id' | sort >"$FOLDER.listed"
    S=()
    for side in L R; do
        for name in amygdala caudate hippocampus pallidum putamen thalamus; do
            post "/v1/meshes?name=${side}_$name" --data-binary "@tests/data/aal_subcortex/${side}_$name.ply"
            answer <"$BODY" >"$FOLDER/mesh-${side}_$name.json"
            mesh=$(json .id)
            run "encode-${side}_$name" encode "{\"mesh\":\"$mesh\",\"lmax\":$LMAX}"
            S+=("$(json .surface.id)")
        done
    done
    post /v1/volumes --data-binary @tests/data/aal_volume/subcortex.nii.gz
    VOLUME=$(json .id)
    cohort sides 'range(12) as $i
        | {id: $s[$i], label: (if $i < 6 then "L" else "R" end), covariates: {age: (40 + $i * $i % 7)}}'
    cohort pairs 'range(12) as $i | {id: $s[$i], subject: "s\($i % 6)", side: (if $i < 6 then "left" else "right" end),
        time: (if $i < 6 then 0 else 1 end), label: ["a", "b"][$i % 2]}'
    cohort parts 'range(12) as $i | range(2) as $p
        | {id: $s[($i + $p) % 12], subject: "s\($i)", label: ["a", "b"][$i % 2], covariates: {part: "p\($p)"}}'
    run pca pca '{"cohort":"sides"}'
    M=$(json .model.id)
    run train train '{"cohort":"sides","method":"srnf-gauss"}'
    C=$(json .model.id)
    while read -r name process inputs; do
        run "$name" "$process" "$inputs"
    done < <(rows "$mesh")
    { rows "$mesh" | cut -d ' ' -f 2; printf '%s\n' encode pca train; } | sort -u >"$FOLDER.asked"
    stop_server || exit 1
}

rows() { # MESH: "name process inputs"
    local a=${S[0]} b=${S[5]} c=${S[11]} raw='"register":false'
    local landmarks='{"template":[1,100,200,300],"moving":[1,100,200,300]}'
    cat <<END
register register {"template":"$a","moving":"$b"}
register-symmetric register {"template":"$a","moving":"$b","symmetric":true}
register-landmarks register {"template":"$a","moving":"$b","landmarks":$landmarks}
register-exact register {"template":"$a","moving":"$b","exact":true,"degree":8}
register-rigid register {"template":"$a","moving":"$b","reparameterization":false}
geodesic geodesic {"from":"$a","to":"$b","steps":3}
geodesic-pullback geodesic {"from":"$a","to":"$b",$raw,"method":"pullback","steps":3}
invert invert {"srnf":{"surface":"$a"},"initial":"sphere"}
distances distances {"cohort":"sides"}
distances-icp distances {"cohort":"sides","metric":"icp"}
neighbours neighbours {"cohort":"sides","k":3}
mean mean {"cohort":"sides"}
mean-common mean {"cohort":"sides","commonPose":true}
mean-plain mean {"cohort":"sides",$raw}
mean-pullback mean {"surfaces":["$a","$b","$c"],$raw,"method":"pullback"}
pca-parts pca-parts {"cohort":"parts","modes":2}
classify classify {"cohort":"sides","method":["srnf-gauss","srm-gauss","icp-nn"],"seed":1}
classify-parts classify-parts {"cohort":"parts","covariance":"pooled"}
train-parts train-parts {"cohort":"parts","method":"srnf-gauss"}
predict predict {"model":"$C","surfaces":["$a","$b"]}
modes modes {"model":"$M","mode":1,"coefficients":[-2,0,2]}
sample sample {"model":"$M","count":2,"seed":1}
project project {"model":"$M","surface":"$c"}
score score {"model":"$M","surface":"$a"}
evaluate-model evaluate-model {"model":"$M","samples":100,"seed":1}
compare-groups compare-groups {"cohort":"sides","permutations":999,"seed":1}
regress regress {"cohort":"sides","formula":"shape ~ label + age","permutations":999,"bootstraps":100,"seed":1}
change change {"cohort":"pairs","permutations":999,"bootstraps":100,"seed":1}
asymmetry asymmetry {"cohort":"pairs","permutations":999,"bootstraps":100,"seed":1}
trajectories trajectories {"cohort":"pairs","at":[{"time":0.5}],"bootstraps":100,"seed":1}
shoot shoot {"surface":"$a","velocity":{"toward":"$b"},"times":[0.5]}
transport transport {"from":"$a","to":"$b","vector":{"toward":"$c"}}
transfer transfer {"source":"$a","deformed":"$b","target":"$c"}
extract extract {"volume":"$VOLUME","labels":[41]}
repair repair {"mesh":"$1"}
mirror mirror {"mesh":"$1"}
mirror-surface mirror {"surface":"$a"}
report report {"cohort":"sides"}
END
}

answers "$OLD" "$SCRATCH/old"
answers "$NEW" "$SCRATCH/new"
python3 - "$SCRATCH/old" "$SCRATCH/new" <<'PYTHON'
import json, os, sys

def leaves(document, path=''):
    if isinstance(document, dict):
        for name, value in document.items():
            yield from leaves(value, f'{path}/{name}')
    elif isinstance(document, list):
        yield path, len(document)
        for i, value in enumerate(document):
            yield from leaves(value, f'{path}/{i}')
    else:
        yield path, document

old, new = sys.argv[1:]
moved = 0
for name in sorted(set(os.listdir(old)) | set(os.listdir(new))):
    files = [os.path.join(folder, name) for folder in (old, new)]
    texts = [open(file).read() if os.path.exists(file) else None for file in files]
    if name.endswith('.absent'):
        print(f'{name[:-7]:28} passed over: the old build has no such process')
        continue
    if name.endswith('.failed'):
        print(f'{name[:-7]:28} failed: {[text and text.strip() for text in texts]}')
    elif texts[0] == texts[1]:
        print(f'{name[:-5]:28} same, {len(texts[0])} bytes')
        continue
    elif None in texts:
        continue  # it failed in the other
    else:
        a, b = (dict(leaves(json.loads(text))) for text in texts)
        paths = [path for path in {**a, **b} if a.get(path) != b.get(path)]
        sizes = [abs(a[p] - b[p]) / max(abs(a[p]), abs(b[p])) for p in paths
                 if all(isinstance(x.get(p), (int, float)) for x in (a, b))]
        print(f'{name[:-5]:28} {len(paths)} of {len(b)} differ, numbers by {max(sizes, default=0):.2g}:', *paths[:3])
    moved += 1
listed, asked = ({line.strip() for line in open(f'{new}.{what}')} for what in ('listed', 'asked'))
for process in sorted(listed - asked):
    print(f'{process:28} is not asked for anything')
sys.exit(bool(moved or listed - asked))
PYTHON
