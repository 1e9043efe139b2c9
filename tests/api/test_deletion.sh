#!/usr/bin/env bash
# srnfd-test: timeout 400
# srnfd-test: slow
# test_deletion.sh - meshes, surfaces and models are deleted: not from under what needs them, with that by cascade=true,
# and so that nothing of them is left in the data directory, also where the daemon dies meanwhile.

# shellcheck source=tests/support/lib.sh
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
start_server "$DATA" --workers 2 || exit 1

# ---- A patient's mesh and what can be made of it -----------------------------------------------------

NAME=Xaverius-Quittenbaum
# As text, so that its lines can be searched for. Its vertices are below what the database holds as a row, and those of
# the large one, with the same shape in more digits, above it.
small() {
    awk 'function v(x) { return sprintf("%.9f", x) }
        BEGIN { n = 24; m = 48; print "ply\nformat ascii 1.0\ncomment '"$NAME"'\nelement vertex " 2 + (n - 1) * m
            print "property float x\nproperty float y\nproperty float z\nelement face " 2 * m * (n - 1)
            print "property list uchar int vertex_indices\nend_header\n0 0 1.5"
            for (i = 1; i < n; i++) for (j = 0; j < m; j++) { t = 3.14159265 * i / n; p = 6.2831853 * j / m
                r = 1 + 0.2 * sin(t) * cos(2 * p)
                print v(r * sin(t) * cos(p)), v(1.1 * r * sin(t) * sin(p)), v(1.5 * cos(t)) }
            print "0 0 -1.5"
            for (j = 0; j < m; j++) { k = (j + 1) % m; print 3, 0, 1 + j, 1 + k
                print 3, 1 + (n - 1) * m, 1 + (n - 2) * m + k, 1 + (n - 2) * m + j }
            for (i = 0; i < n - 2; i++) for (j = 0; j < m; j++) { k = (j + 1) % m; a = 1 + i * m
                print 3, a + j, a + m + j, a + m + k; print 3, a + j, a + m + k, a + k } }'
}
small >"$SCRATCH/patient.ply"
sed '/^[-0-9.]* [-0-9.]* [-0-9.]*$/ s/$/                                                                                                                                                                                                                      /' \
    "$SCRATCH/patient.ply" >"$SCRATCH/large.ply"
LINES=$(sed -n '200p;700p;1100p' "$SCRATCH/patient.ply")

upload() { # FILE NAME
    post "/v1/meshes?name=$2" --data-binary "@$1"
    json .id
}

# Files of the data directory that have the text.
holds() { # TEXT
    grep -rlaF -e "$1" "$DATA" | sed "s#$DATA/##" | sort | paste -sd ' '
}

# Everything that tells of the patient: name, vertices as they were sent, and, in hexadecimal, 24 bytes from the middle
# of the surface's coefficients.
left() { # [COEFFICIENTS]
    local text
    for text in "$NAME" "$LINES"; do
        holds "$text"
    done
    while [ $# -gt 0 ]; do
        grep -rlaP -e "$1" "$DATA" | sed "s#$DATA/##"
        shift
    done
}

# The bytes of a surface's coefficients as a pattern of grep.
pattern() { # SURFACE
    get "/v1/surfaces/$1/coefficients?format=npy"
    tail -c +400 "$BODY" | head -c 24 | od -An -v -tx1 | tr -d ' \n' | sed 's/../\\x&/g'
}

count() {
    local kind total=''
    for kind in meshes surfaces models jobs cohorts; do
        get "/v1/$kind?limit=200"
        total="$total $(json '.items | length')"
    done
    echo "${total# }"
}

bytes_held() {
    sqlite3 -readonly "$DATA/srnfd.db" "SELECT bytes FROM owner WHERE name = ''" 2>/dev/null
}

OTHER=$(upload tests/data/aal_subcortex/L_pallidum.ply other)
execute encode "{\"mesh\":\"$OTHER\",\"lmax\":7}"
KEPT=$(json .surface.id)
BEFORE=$(count)

MESH=$(upload "$SCRATCH/patient.ply" "$NAME")
LARGE=$(upload "$SCRATCH/large.ply" "$NAME")
isnt "$MESH" "$LARGE" 'the patient has two meshes'
is "$(find "$DATA/blobs" -type f -size +256k | wc -l)" 1 'one of them in a file'
execute encode "{\"mesh\":\"$MESH\",\"lmax\":7}"
SURFACE=$(json .surface.id)
execute register "{\"template\":\"$KEPT\",\"moving\":\"$MESH\",\"degree\":2}" --header 'Idempotency-Key: of a patient'
REGISTERED=$(json .surface.id)
is "$(json .surface.name)" "$NAME" 'a registered surface has the name of the one that was moved'
post_json /v1/cohorts "{\"name\":\"study\",\"members\":[{\"id\":\"$MESH\",\"subject\":\"$NAME\"},{\"id\":\"$KEPT\"}]}"
execute pca "{\"surfaces\":[\"$SURFACE\",\"$KEPT\",\"$REGISTERED\"],\"register\":false,\"components\":1}"
MODEL=$(json .model.id)
MEAN=$(json .model.mean.id)
like "$SURFACE $REGISTERED $MODEL $MEAN" '^surf-.* surf-.* model-.* surf-' 'and much was made of them'
execute encode "{\"mesh\":\"$LARGE\",\"lmax\":9}"
COEFFICIENTS=$(pattern "$SURFACE")
OF_REGISTERED=$(pattern "$REGISTERED")
isnt "$(left "$COEFFICIENTS" "$OF_REGISTERED")" '' 'which the search finds in the data directory'

# ---- What is needed stays ----------------------------------------------------------------------------

FULL=$(count)
request DELETE "/v1/meshes/$MESH"
is_problem 409 in-use 'a mesh that something needs is not deleted'
like "$(json .detail)" 'The cohort [^ ]+ can stay: PATCH /v1/cohorts/[^ ]+ with' 'the problem says how a cohort does without it'
is "$(json '[.neededBy[].kind] | unique | join(" ")')" 'cohort job model surface' 'the problem says what needs it'
is "$(json '.neededByCount == (.neededBy | length)') $(json "[.neededBy[].id] | index(\"$SURFACE\") != null")" 'true true' \
    'by its ids'
request DELETE "/v1/surfaces/$MEAN"
is "$STATUS $(json '[.neededBy[].id] | join(" ")')" "409 $MODEL" 'nor the mean of a model'
request DELETE "/v1/meshes/$MESH?cascade=maybe"
is_problem 422 invalid-input 'cascade is true or false'
request DELETE "/v1/meshes/$MESH?all=true"
is_problem 400 unknown-parameter 'and the only way'
request DELETE "/v1/meshes/$SURFACE"
is_problem 404 no-such-mesh 'a surface is no mesh'
request DELETE /v1/models/model-00000000000000000000000000000000
is_problem 404 no-such-model 'what is not there is not deleted'
is "$(count)" "$FULL" 'and nothing has gone'

# ---- A surface and a model alone ---------------------------------------------------------------------

request DELETE "/v1/models/$MODEL"
is "$STATUS $(header Srnfd-Deleted)" '204 job=1, model=1' 'a model goes, with the job whose results it was'
get "/v1/models/$MODEL"
is_problem 404 no-such-model 'for good'
execute pca "{\"surfaces\":[\"$SURFACE\",\"$KEPT\",\"$REGISTERED\"],\"register\":false,\"components\":1}"
is "$STATUS $(json .model.id)" "200 $MODEL" 'and is made again when asked for'

# ---- All of it ---------------------------------------------------------------------------------------

HELD=$(bytes_held)
request DELETE "/v1/meshes/$MESH?cascade=true"
is "$STATUS" 204 'with cascade=true all that needs it goes too'
like "$(header Srnfd-Deleted)" 'cohort=1, .*mesh=1' 'and the answer says how much'
for path in "meshes/$MESH" "surfaces/$SURFACE" "surfaces/$REGISTERED" "surfaces/$MEAN" "models/$MODEL" cohorts/study; do
    get "/v1/$path"
    is "$STATUS" 404 "${path%%/*}: gone"
done
get "/v1/meshes/$LARGE"
is "$STATUS" 200 'what does not need it stays'
compare "$(bytes_held)" '<' "$HELD" 'the room is free'
request DELETE "/v1/meshes/$LARGE?cascade=true"
is "$STATUS $(header Srnfd-Deleted)" '204 job=1, surface=1, mesh=1' 'the other mesh goes too'
is "$(left "$COEFFICIENTS" "$OF_REGISTERED")" '' 'nothing of the patient is left in the data directory'
is "$(grep -c "$NAME" "$SERVER_LOG")" 0 'nor in the log'
is "$(count)" "$BEFORE" 'and everything else is as it was'
is "$(find "$DATA/blobs" -type f | wc -l)" 0 'no file is left'
execute encode "{\"mesh\":\"$OTHER\",\"lmax\":7}"
is "$(json .surface.id) $(header Cache-Status)" "$KEPT srnfd; hit" 'other results are still in the cache'
request DELETE "/v1/surfaces/$KEPT"
is "$STATUS $(header Srnfd-Deleted)" '204 job=1, surface=1' 'a surface goes with the job that made it'
execute encode "{\"mesh\":\"$OTHER\",\"lmax\":7}"
is "$(json .surface.id) $(header Cache-Status)" "$KEPT srnfd; fwd=miss" 'so that its encoding is made again, not found'

# ---- Jobs that run -----------------------------------------------------------------------------------

MESH=$(upload "$SCRATCH/patient.ply" "$NAME")
for degree in 20 21 22; do
    execute register "{\"template\":\"$KEPT\",\"moving\":\"$MESH\",\"degree\":$degree,\"exact\":true,\"symmetric\":true}" \
        --header 'Prefer: respond-async'
done
JOB=$(json .id)
request DELETE "/v1/meshes/$MESH"
is "$STATUS $(json '[.neededBy[].kind] | unique | join(" ")')" '409 job' 'jobs that wait or run need their inputs'
request DELETE "/v1/meshes/$MESH?cascade=true"
is "$STATUS $(header Srnfd-Deleted)" '204 job=3, mesh=1' 'with cascade=true they are canceled and deleted'
get "/v1/jobs/$JOB"
is_problem 404 no-such-job 'with their records'
is "$(left)" '' 'and leave nothing'

# ---- A crash in between ------------------------------------------------------------------------------

# Whatever a deletion is killed in, it has happened or not, and the next start leaves no file behind.
halves=0
for round in 1 2 3 4 5 6; do
    MESH=$(upload "$SCRATCH/patient.ply" "$NAME")
    LARGE=$(upload "$SCRATCH/large.ply" "$NAME")
    execute encode "{\"mesh\":\"$LARGE\",\"lmax\":9}"
    SURFACE=$(json .surface.id)
    curl --silent --output "$SCRATCH/ignored" --request DELETE "$URL/v1/meshes/$LARGE?cascade=true" &
    sleep "0.0$((round + 1))"
    kill_server
    wait $! 2>/dev/null
    "$SRNFD" check --data "$DATA" >"$SCRATCH/checked" 2>&1 || note "$(cat "$SCRATCH/checked")"
    start_server "$DATA" --workers 2 || exit 1
    get "/v1/meshes/$LARGE"
    mesh=$STATUS
    get "/v1/surfaces/$SURFACE"
    [ "$mesh" = "$STATUS" ] || halves=$((halves + 1))
    request DELETE "/v1/meshes/$LARGE?cascade=true"
    [ "$STATUS" = "$([ "$mesh" = 200 ] && echo 204 || echo 404)" ] || halves=$((halves + 1))
    request DELETE "/v1/meshes/$MESH?cascade=true"
    [ "$STATUS" = 204 ] || halves=$((halves + 1))
done
is "$halves" 0 'a deletion that the daemon dies in has happened or not'
waited=0
while [ -n "$(left)" ] && [ "$waited" -lt 100 ]; do
    sleep 0.1
    waited=$((waited + 1))
done
is "$(left) $(find "$DATA/blobs" -type f | wc -l)" ' 0' 'and nothing stays behind'
if stop_server; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
check 'the check finds nothing wrong' "$SRNFD" check --data "$DATA"

# ---- Several owners ----------------------------------------------------------------------------------

DATA=$SCRATCH/owned
token() { # NAME [ARGUMENTS]
    local name=$1
    shift
    "$SRNFD" token add --data "$DATA" --name "$name" "$@" 2>/dev/null
}
as() { # TOKEN COMMAND..
    local secret=$1
    shift
    "$@" --header "Authorization: Bearer $secret"
}
mkdir "$DATA" && chmod 700 "$DATA"
ADA=$(token ada --role user)
BEN=$(token ben --role user)
EVE=$(token eve --role viewer)
ROOT_TOKEN=$(token root --role admin)
start_server "$DATA" --workers 1 || exit 1
as "$ADA" post "/v1/meshes?name=$NAME" --data-binary "@$SCRATCH/patient.ply"
MESH=$(json .id)
as "$BEN" post "/v1/meshes?name=his" --data-binary "@$SCRATCH/patient.ply"
as "$BEN" execute encode "{\"mesh\":\"$MESH\",\"lmax\":7}"
SURFACE=$(json .surface.id)
as "$ADA" execute encode "{\"mesh\":\"$MESH\",\"lmax\":7}"
as "$EVE" request DELETE "/v1/meshes/$MESH"
is "$STATUS" 403 'a viewer deletes nothing'
as "$ROOT_TOKEN" request DELETE "/v1/meshes/$MESH"
is_problem 409 owner-required 'an admin says whose is meant'
as "$ADA" request DELETE "/v1/meshes/$MESH?owner=ben"
is_problem 404 no-such-mesh 'others reach nobody else'"'"'s'
as "$ADA" request DELETE "/v1/meshes/$MESH?cascade=true"
is "$STATUS $(header Srnfd-Deleted)" '204 job=1, surface=1, mesh=1' 'an owner gives up what is its own'
as "$ADA" get "/v1/meshes/$MESH"
is_problem 404 no-such-mesh 'and has it no more'
as "$BEN" get "/v1/meshes/$MESH"
is "$STATUS $(json .name)" '200 his' 'the other owner has it as before'
as "$BEN" get "/v1/surfaces/$SURFACE"
is "$STATUS $(json .name)" '200 his' 'and what was made of it'
is "$(grep -rlaF -e "$NAME" "$DATA")" "$(grep -rlaF -e "comment $NAME" "$DATA")" \
    'what the first called it is nowhere but in the bytes that both sent'
as "$ROOT_TOKEN" post_json /v1/cohorts "{\"name\":\"theirs\",\"members\":[{\"id\":\"$MESH\"}]}"
as "$BEN" request DELETE "/v1/meshes/$MESH?cascade=true"
is "$STATUS $(json .code) $(json '[.neededBy[].kind] | index("cohort")')" '409 in-use null' \
    'the last owner does not take it from under an admin'
as "$ROOT_TOKEN" request DELETE "/v1/meshes/$MESH?owner=ben&cascade=true"
is "$STATUS $(header Srnfd-Deleted)" '204 job=1, cohort=1, surface=1, mesh=1' 'who can take it all'
is "$(left)" '' 'then it is gone'
is "$(sqlite3 -readonly "$DATA/srnfd.db" 'SELECT sum(bytes) FROM owner; SELECT count(*) FROM need' 2>/dev/null | paste -sd ' ')" \
    '0 0' 'and nobody pays for it'
if stop_server; then
    ok 'the server ends well'
else
    not_ok 'the server ends well'
fi
check 'the check finds nothing wrong' "$SRNFD" check --data "$DATA"
done_testing
