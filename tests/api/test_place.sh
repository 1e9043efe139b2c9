#!/usr/bin/env bash
# test_place.sh - a surface is content in a place: moved copies of a mesh, one mesh in two files, and mirror images made
# in two ways are surfaces each in its own place, which travel with studies; and what older versions stored under the id
# of the content alone is still that.
# srnfd-test: once (where surfaces lie does not depend on the build)
# srnfd-test: slow

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

# Coordinates are sixteenths, so that they are exact when 64 is added.
make_body() { # DX
    awk -v dx="$1" 'function exact(v) { return int(v * 16 + (v < 0 ? -0.5 : 0.5)) / 16 }
        BEGIN { pi = 3.14159265358979; n = 16; m = 24
        for (i = 0; i <= n; i++) for (j = 0; j < (i % n ? m : 1); j++) {
            t = pi * i / n; p = 2 * pi * j / m
            printf "v %.9g %.9g %.9g\n", exact(30 * sin(t) * cos(p)) + dx, exact(18 * sin(t) * sin(p)),
                exact(12 * cos(t) + 6 * sin(t)^2 * cos(p)) }
        for (j = 0; j < m; j++) print "f", 1, 2 + j, 2 + (j + 1) % m
        for (i = 1; i < n - 1; i++) for (j = 0; j < m; j++) {
            b = 2 + (i - 1) * m; print "f", b + j, b + m + j, b + m + (j + 1) % m, b + (j + 1) % m }
        b = 2 + (n - 2) * m; for (j = 0; j < m; j++) print "f", b + j, b + m, b + (j + 1) % m }'
}

upload() { # FILE: MESH
    post "/v1/meshes?name=$(basename "$1" .obj)" --data-binary "@$1"
    MESH=$(json .id)
}

encode() { # MESH [MORE]: SURFACE
    execute encode "{\"mesh\":\"$1\",\"lmax\":5${2:-}}"
    SURFACE=$(json .surface.id)
}

# The middle of its extent along x.
middle() { # SURFACE
    get "/v1/surfaces/$1/mesh?format=obj&resolution=16&space=original"
    awk '$1 == "v" { if (!n++ || $2 < lo) lo = $2; if (n == 1 || $2 > hi) hi = $2 } END { printf "%.3f\n", (lo + hi) / 2 }' "$BODY"
}

lies_at() { # SURFACE X NAME
    compare "$(jq -n "$(middle "$1") - $2 | fabs")" '<' 0.5 "$3"
}

coefficients() { # SURFACE
    get "/v1/surfaces/$1/coefficients"
    sha256sum <"$BODY"
}

start_server "$SCRATCH/a" --workers 2 || exit 1
FIRST=$SERVER_PID
make_body 32 >"$SCRATCH/here.obj"
make_body 96 >"$SCRATCH/there.obj"
(echo '# the same in another file' && cat "$SCRATCH/here.obj") >"$SCRATCH/again.obj"
for name in here there again; do
    upload "$SCRATCH/$name.obj"
    declare "$name=$MESH"
    encode "$MESH"
    declare "of_$name=$SURFACE"
    is "$STATUS $(json .surface.frame.mesh)" "200 $MESH" "$name is encoded, in the coordinates of its mesh"
done
# shellcheck disable=SC2154 # declared above
HERE=$here THERE=$there AGAIN=$again OF_HERE=$of_here OF_THERE=$of_there OF_AGAIN=$of_again
encode "$HERE" ',"mirror":true'
STAYS=$SURFACE
post_json /v1/cohorts "{\"name\":\"copies\",\"members\":[{\"id\":\"$OF_THERE\"},{\"id\":\"$OF_AGAIN\"},{\"id\":\"$STAYS\"}]}"
is "$STATUS" 201 'a cohort of copies'
get /v1/cohorts/copies/export
cp "$BODY" "$SCRATCH/study.zip"

# ---- Moved copies ------------------------------------------------------------------------------------

is "$(coefficients "$OF_HERE")" "$(coefficients "$OF_THERE")" 'a moved copy has the same coefficients'
isnt "$OF_HERE" "$OF_THERE" 'and is another surface'
lies_at "$OF_HERE" 32 'the first is where its mesh is'
lies_at "$OF_THERE" 96 'and the copy where its own is'
isnt "$OF_AGAIN" "$OF_HERE" 'the same mesh in another file has a surface of its own'
for pair in "$HERE=$OF_HERE" "$THERE=$OF_THERE" "$AGAIN=$OF_AGAIN"; do
    get "/v1/surfaces?mesh=${pair%%=*}"
    is "$(json '[.items[] | select(.mirrored | not).id] | tojson')" "[\"${pair#*=}\"]" 'a list by mesh finds it'
done
execute encode "{\"mesh\":\"$THERE\",\"lmax\":5,\"smoothing\":0}"
is "$STATUS $(json .surface.id)" "200 $OF_THERE" 'made again it is the same'
execute distances "{\"surfaces\":[\"$OF_HERE\",\"$OF_THERE\",\"$OF_AGAIN\"],\"register\":false}"
is "$STATUS $(json_in_order '[.matrix[0][1], ([.warnings[] | select(.code == "duplicate-content") | .figures] | tojson)] | join(" ")')" \
    "200 0 [{\"members\":[0,1],\"content\":\"$OF_HERE\"},{\"members\":[0,2],\"content\":\"$OF_HERE\"}]" \
    'copies are known as copies all the same'
execute mean "{\"surfaces\":[\"$THERE\",\"$HERE\"],\"register\":false}"
is "$(json '[.warnings[] | select(.code == "duplicate-content") | .figures.content] | tojson')" "[\"$THERE\"]" \
    'meshes too'
execute pca "{\"surfaces\":[\"$OF_HERE\",\"$(
    upload tests/data/aal_subcortex/L_pallidum.ply && encode "$MESH" && echo "$SURFACE"
)\",\"$(
    upload tests/data/aal_subcortex/R_pallidum.ply && encode "$MESH" && echo "$SURFACE"
)\"],\"register\":false}"
MODEL=$(json .model.id)
for id in "$OF_THERE" "$OF_HERE"; do
    execute project "{\"model\":\"$MODEL\",\"surface\":\"$id\"}"
    is "$STATUS $(json .trainingSubject)" '200 true' 'a model knows its subjects wherever they lie'
done

# ---- Paths and images --------------------------------------------------------------------------------

execute geodesic "{\"from\":\"$OF_THERE\",\"to\":\"$OF_HERE\",\"steps\":3,\"method\":\"linear\",\"register\":false}"
is "$(json '.surfaces[0].id')" "$OF_THERE" 'a path begins with the surface itself'
is "$(json '.surfaces[1].frame | [.of, .mesh] | tojson')" "[\"$OF_THERE\",\"$THERE\"]" 'and is in its place'
lies_at "$(json '.surfaces[1].id')" 96 'which exports show'
execute mirror "{\"mesh\":\"$HERE\"}"
IMAGE=$(json .mesh.id)
encode "$IMAGE"
is "$(coefficients "$SURFACE")" "$(coefficients "$STAYS")" 'an image by either way has the same coefficients'
lies_at "$STAYS" 32 'encoded with mirror it stays'
lies_at "$SURFACE" -32 'made by mirror it is on the other side'
execute mirror "{\"surface\":\"$OF_HERE\"}"
execute mirror "{\"surface\":\"$(json .surface.id)\"}"
is "$(json .surface.id)" "$OF_HERE" 'the image of an image is the original, in its place'

# ---- Deletion ----------------------------------------------------------------------------------------

execute mean '{"cohort":"copies","register":false}' # so that something else needs them
request DELETE "/v1/meshes/$AGAIN?cascade=true"
is "$STATUS" 204 'a mesh goes with all that was made of it'
get "/v1/surfaces/$OF_AGAIN"
is_problem 404 no-such-surface 'its surface too'
for id in "$OF_HERE" "$OF_THERE"; do
    get "/v1/surfaces/$id"
    is "$STATUS" 200 'and what other meshes have stays'
done
execute encode "{\"mesh\":\"$HERE\",\"lmax\":5}"
is "$STATUS $(json .surface.id)" "200 $OF_HERE" 'with the answers that name it'

# ---- Studies -----------------------------------------------------------------------------------------

start_server "$SCRATCH/b" --workers 1 || exit 1
SECOND=$SERVER_PID
post /v1/imports --data-binary "@$SCRATCH/study.zip"
is "$STATUS $(json '[.restored.surfaces, (.refused | length)] | tojson')" '201 [4,0]' 'a study is restored'
get /v1/cohorts/copies
is "$(json '[.members[].id] | tojson')" "[\"$OF_THERE\",\"$OF_AGAIN\",\"$STAYS\"]" 'with its ids'
lies_at "$OF_THERE" 96 'each'
lies_at "$OF_AGAIN" 32 '  in its place'

# Writes the study as an older version would have: ids of the content alone, no mesh in frames. SHIFT moves the places,
# which such an id does not tell; a sum of the record would.
older() { # FILE old|new SHIFT
    /usr/bin/python3 - "$SCRATCH/study.zip" "$1" "$2" "$3" <<'PY'
import hashlib, io, json, struct, sys, zipfile
import numpy as np
source, target, version, shift = sys.argv[1:]
into = zipfile.ZipFile(target, 'w')
study = zipfile.ZipFile(source)
manifest = json.loads(study.read('srnfd-study.json'))
names, kept = {}, []
for entry in manifest['surfaces']:
    record = json.loads(entry['record'])
    record['origin'][0] += float(shift)
    c = np.load(io.BytesIO(study.read(entry['file'])))['coefficients']
    digest = hashlib.sha256(struct.pack('<q', entry['lmax']) + (c.astype('<f8').ravel() + 0.0).tobytes()
                            + struct.pack('<d', record['scale'])).hexdigest()[:32]
    names[entry['id']] = 'surf-' + digest
    if version == 'old':
        del record['frame']['mesh']
        if any(k['id'] == 'surf-' + digest for k in kept):
            continue
        entry['id'] = 'surf-' + digest
    entry['record'] = json.dumps(record, separators=(',', ':'), sort_keys=True)
    entry.pop('sha256', None)
    kept.append(entry)
manifest['surfaces'] = kept
manifest['jobs'] = []
manifest.pop('files', None)
manifest['cohort'].pop('sha256', None)
if version == 'old':
    members = json.loads(manifest['cohort']['members'])
    for member in members:
        member['id'] = names[member['id']]
    unique = {member['id']: member for member in members}
    manifest['cohort']['members'] = json.dumps(list(unique.values()))
into.writestr('srnfd-study.json', json.dumps(manifest))
for name in study.namelist():
    if name != 'srnfd-study.json':
        into.writestr(name, study.read(name))
into.close()
PY
}
older "$SCRATCH/old.zip" old 0
start_server "$SCRATCH/c" --workers 1 || exit 1
THIRD=$SERVER_PID
post /v1/imports --data-binary "@$SCRATCH/old.zip"
is "$STATUS $(json '[.restored.surfaces, (.refused | length)] | tojson')" '201 [2,0]' 'what an older version exported is restored'
get /v1/cohorts/copies
OLD=$(json '.members[0].id')
isnt "$OLD" "$OF_THERE" 'under the ids that it had'
lies_at "$OLD" 96 'in the place of the first'
encode "$THERE"
is "$SURFACE" "$OLD" 'encoded again it is the surface that is there'
encode "$AGAIN"
is "$STATUS $SURFACE" "200 $OF_AGAIN" 'and a copy gets one of its own'
lies_at "$OF_AGAIN" 32 'in its place'
older "$SCRATCH/moved.zip" new 8
start_server "$SCRATCH/d" --workers 1 || exit 1
post /v1/imports --data-binary "@$SCRATCH/moved.zip"
is "$STATUS $(json '[.refused[].code] | unique | tojson')" '422 ["not-as-described"]' 'an id stands for its place'
for pid in "$FIRST" "$SECOND" "$THIRD" "$SERVER_PID"; do
    stop_server "$pid" || not_ok 'a server ends well'
done
done_testing
