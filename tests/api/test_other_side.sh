#!/usr/bin/env bash
# test_other_side.sh - new surfaces of the other side, which nothing calls so: project, score and predict try their mirror
# images and warn where these are clearly nearer;
# and meshes that a classifier of surfaces is asked of.
# srnfd-test: slow
# srnfd-test: release-only
# Under the sanitizers test_score.sh and test_train.sh try mirror images of small surfaces.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

REQUEST_SECONDS=400
start_server "$SCRATCH/data" --workers 2 || exit 1
declare -A MESH
NUMBER=0
for name in {L,R}_{thalamus,pallidum,amygdala,putamen,caudate,hippocampus}; do
    post "/v1/meshes?name=structure-$((NUMBER++))" --data-binary "@tests/data/aal_subcortex/$name.ply"
    MESH[$name]=$(json .id)
done
run() { # PROCESS INPUTS
    execute "$1" "$2" --header 'Prefer: wait=300'
}
sides() { # whether the last result warns of mirror images
    json '[.warnings[].code] | index("mirror-images") != null'
}

# A model of left ones alone, and of right ones mirrored.
MEMBERS=
for name in {L,R}_{pallidum,putamen,amygdala}; do
    [ "$name" = R_pallidum ] && continue
    MEMBERS="$MEMBERS${MEMBERS:+,}{\"id\":\"${MESH[$name]}\",\"mirror\":$([ "${name:0:1}" = R ] && echo true || echo false)}"
done
post_json /v1/cohorts "{\"name\":\"left\",\"members\":[$MEMBERS]}"
run pca '{"cohort":"left","lmax":4,"maxIterations":3}'
MODEL=$(json .model.id)
run project "{\"model\":\"$MODEL\",\"surface\":\"${MESH[R_pallidum]}\"}"
note "$(json '.warnings[] | select(.code == "mirror-images") | .detail')"
is "$STATUS $(sides)" '200 true' 'project: one of the other side'
compare "$(json '.warnings[] | select(.code == "mirror-images") | .figures | .mirrored / .distance')" '<' 0.8 \
    'would be nearer mirrored'
run project "{\"model\":\"$MODEL\",\"surface\":\"${MESH[R_pallidum]}\",\"handedness\":\"ignore\"}"
is "$STATUS $(sides)" '200 false' 'which may be left out'
run encode "{\"mesh\":\"${MESH[R_pallidum]}\",\"lmax\":4,\"mirror\":true}"
MIRRORED=$(json .surface.id)
run project "{\"model\":\"$MODEL\",\"surface\":\"$MIRRORED\"}"
is "$STATUS $(sides)" '200 false' 'and has no warning once it is mirrored'
run score "{\"model\":\"$MODEL\",\"surface\":\"${MESH[R_pallidum]}\",\"map\":false,\"calibration\":false}"
is "$STATUS $(sides)" '200 true' 'score says the same'

# A classifier of both sides, the right ones mirrored.
MEMBERS=
for name in {L,R}_{thalamus,caudate,putamen,pallidum,amygdala,hippocampus}; do
    [ "$name" = R_pallidum ] && continue
    LABEL=$([[ $name =~ thalamus|caudate|putamen ]] && echo large || echo small)
    MEMBERS="$MEMBERS${MEMBERS:+,}{\"id\":\"${MESH[$name]}\",\"label\":\"$LABEL\",\"mirror\":$([ "${name:0:1}" = R ] && echo true || echo false)}"
done
post_json /v1/cohorts "{\"name\":\"kinds\",\"members\":[$MEMBERS]}"
run train '{"cohort":"kinds","method":"srnf-nn","lmax":4}'
KINDS=$(json .model.id)
run predict "{\"model\":\"$KINDS\",\"surfaces\":[\"${MESH[L_pallidum]}\",\"${MESH[R_pallidum]}\"]}"
note "$(json '.warnings[] | select(.code == "mirror-images") | .detail')"
is "$STATUS $(json '[.warnings[] | select(.code == "mirror-images") | .figures.members[].member] | tojson')" '200 [1]' \
    'predict: the one of the other side, and no training member'
run predict "{\"model\":\"$KINDS\",\"surfaces\":[\"$MIRRORED\"]}"
is "$STATUS $(sides)" '200 false' 'but not once it is mirrored'
run predict "{\"model\":\"$KINDS\",\"surfaces\":[\"${MESH[R_pallidum]}\"],\"handedness\":\"ignore\"}"
is "$STATUS $(sides)" '200 false' 'nor where it is not to be tried'

# Trained on surfaces of degree 4, meshes are encoded so too: the mesh of a member is known again.
MEMBERS=
for name in L_{thalamus,caudate,putamen,pallidum,amygdala,hippocampus} R_{thalamus,caudate,amygdala,hippocampus}; do
    LABEL=$([[ $name =~ thalamus|caudate|putamen ]] && echo large || echo small)
    run encode "{\"mesh\":\"${MESH[$name]}\",\"lmax\":4}"
    MEMBERS="$MEMBERS${MEMBERS:+,}{\"id\":\"$(json .surface.id)\",\"label\":\"$LABEL\"}"
done
post_json /v1/cohorts "{\"name\":\"surfaces\",\"members\":[$MEMBERS]}"
run train '{"cohort":"surfaces","method":"srnf-nn","mixedRoutes":true}'
KINDS=$(json .model.id)
run predict "{\"model\":\"$KINDS\",\"surfaces\":[\"${MESH[L_caudate]}\",\"${MESH[R_putamen]}\"],\"handedness\":\"ignore\"}"
is "$STATUS $(json '[.predictions[].trainingSubject] | tojson')" '200 [true,false]' 'meshes are encoded at the degree of the classifier'
is "$(json '[.warnings[].code] | index("mixed-degrees")')" null 'and nobody is warned of degrees'

stop_server || not_ok 'the server ends well'
done_testing
