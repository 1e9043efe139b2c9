#!/usr/bin/env bash
# Who may call, against a whole daemon: tokens made and revoked while it runs, roles, what belongs to whom, the same
# content sent by two, quotas, pages of other origins, and when it may listen beyond loopback.
# srnfd-test: slow
# srnfd-test: once (who may do what does not depend on the build)
. "$(dirname "$0")/../support/lib.sh"

DATA=$SCRATCH/data
MESH=@tests/data/aal_subcortex/L_thalamus.ply
OTHER=@tests/data/aal_subcortex/R_thalamus.ply

token() { # NAME [ARGUMENTS OF token add..]
    local name=$1
    shift
    "$SRNFD" token add --data "$DATA" --name "$name" "$@" 2>/dev/null
}

# A request with a token: as "$ADA" get /v1/meshes
as() { # TOKEN COMMAND ARGUMENTS..
    local token=$1
    shift
    "$@" --header "Authorization: Bearer $token"
}

# ---- The command ---------------------------------------------------------------------------------------

fails() { # NAME STATUS ARGUMENTS..
    local name=$1 wanted=$2
    shift 2
    "$SRNFD" token "$@" >"$SCRATCH/out" 2>"$SCRATCH/err"
    is "$?" "$wanted" "$name: refused"
    check "$name: and said why" test -s "$SCRATCH/err"
    check "$name: and gave no token" test ! -s "$SCRATCH/out"
}
fails 'no command' 2
fails 'an unknown command' 2 make
fails 'no name' 2 add --data "$DATA"
fails 'a name with a space' 2 add --data "$DATA" --name 'a b'
fails 'a role that is none' 2 add --data "$DATA" --name a --role king
fails 'a date that has passed' 2 add --data "$DATA" --name a --expires 2001-01-01
fails 'a quota that is no number' 2 add --data "$DATA" --name a --max-bytes lots
fails 'an option that is none' 2 add --data "$DATA" --name a --max-money 3
fails 'a token that is not there' 1 revoke --data "$SCRATCH" nobody
printf 'too-short\n' >"$SCRATCH/short"
fails 'a secret that is too short' 2 add --data "$DATA" --name a --secret-file "$SCRATCH/short"
printf '%064d\n' 1 >"$SCRATCH/long"
fails 'a secret that is too long' 2 add --data "$DATA" --name a --secret-file "$SCRATCH/long"
fails 'a secret that is not there' 2 add --data "$DATA" --name a --secret-file "$SCRATCH/absent"
fails 'a directory that cannot be' 1 add --data /proc/none --name a

# ---- Without tokens, and then with -----------------------------------------------------------------------

start_server "$DATA" --access-log all --quota-streams 1 --quota-queued 3 \
    --cors-origins 'https://app.example, https://b.example:8443' || exit 1
post '/v1/meshes?name=before' --data-binary "$MESH"
is "$STATUS" 201 'before there are tokens, everyone is let in'
ID=$(json .id)
ADA=$(token ada)
BEN=$(token ben --expires 90d)
EYE=$(token ada --role viewer)
ROOT=$(token root --role admin)
like "$ADA" '^srnfd_[A-Za-z0-9_-]{43}$' 'a token is printed alone'
get /v1/meshes
is_problem 401 token-required 'then a token is asked for, without a restart'
is "$(header WWW-Authenticate)" 'Bearer realm="srnfd"' 'with a challenge'
for path in / /healthz /readyz /v1/version /v1/openapi.yaml; do
    get "$path"
    is "$STATUS" 200 "$path is open"
done
as "${ADA%?}" get /v1/meshes
is_problem 401 token-invalid 'a token cut short'
as "$ADA" get "/v1/meshes/$ID"
is_problem 404 no-such-mesh 'what was there before is not a user'"'"'s'
as "$ROOT" get "/v1/meshes/$ID"
is "$STATUS $(json .name)" '200 before' 'but an admin sees it'

# A secret of an orchestrator, and the files that a command of root leaves.
printf 'an-orchestrators-secret-of-40-characters\n' >"$SCRATCH/secret"
is "$("$SRNFD" token add --data "$DATA" --name eve --secret-file "$SCRATCH/secret" 2>/dev/null)" '' \
    'a secret from a file is not printed'
as an-orchestrators-secret-of-40-characters get /v1/meshes
is "$STATUS" 200 'and lets in'
"$SRNFD" token revoke eve --data "$DATA" 2>/dev/null
MONITOR=$(token monitor --role metrics)
as "$MONITOR" get /metrics
is "$STATUS" 200 'a token for metrics reads them'
as "$ADA" get /metrics
is_problem 403 forbidden 'which count what others do, and are not for users'
mkdir -p "$SCRATCH/linked"
: >"$SCRATCH/victim"
ln -s "$SCRATCH/victim" "$SCRATCH/linked/tokens.new"
"$SRNFD" token add --data "$SCRATCH/linked" --name a >/dev/null 2>&1
is "$?" 0 'a link where the file is made'
check 'is not followed' test ! -s "$SCRATCH/victim"
ln -sf "$SCRATCH/elsewhere" "$SCRATCH/linked/tokens.lock"
fails 'a link for the lock' 1 add --data "$SCRATCH/linked" --name b
check 'which makes nothing elsewhere' test ! -e "$SCRATCH/elsewhere"
rm "$SCRATCH/linked/tokens.lock"
ln "$SCRATCH/victim" "$SCRATCH/linked/tokens.lock"
fails 'a second name of another file for the lock' 1 add --data "$SCRATCH/linked" --name b
rm "$SCRATCH/linked/tokens" "$SCRATCH/linked/tokens.lock"
mkfifo "$SCRATCH/linked/tokens"
fails 'a pipe for the file' 1 add --data "$SCRATCH/linked" --name b
is "$(stat -c %a "$DATA/tokens" "$DATA/srnfd.db" "$DATA"/blobs | sort -u | tr '\n' ' ')" '600 700 ' 'nothing of the data is for others'
if [ "$(id -u)" -eq 0 ]; then
    mkdir "$SCRATCH/theirs"
    chown nobody "$SCRATCH/theirs"
    "$SRNFD" token add --data "$SCRATCH/theirs" --name a >/dev/null 2>&1
    is "$(stat -c %U "$SCRATCH"/theirs/tokens* | sort -u)" nobody 'what root makes belongs to the owner of the directory'
fi

# ---- Whose it is -----------------------------------------------------------------------------------------

as "$ADA" post '/v1/meshes?name=hers' --data-binary "$MESH"
is "$STATUS $(json .id) $(json .name)" "201 $ID hers" 'content that another has is new to its sender'
as "$ADA" post '/v1/meshes?name=again' --data-binary "$MESH"
is "$STATUS $(json .name)" '200 again' 'and known the second time, when it takes the name that it comes with'
absent=${ID%????}0000
as "$BEN" get "/v1/meshes/$ID"
jq -S 'del(.instance,.requestId,.detail)' "$BODY" >"$SCRATCH/foreign"
foreign=$STATUS
as "$BEN" get "/v1/meshes/$absent"
is "$foreign" "$STATUS" 'a foreign mesh is answered as one that is not there'
is "$(cat "$SCRATCH/foreign")" "$(jq -S 'del(.instance,.requestId,.detail)' "$BODY")" 'to the last member'
as "$BEN" execute encode "{\"mesh\":\"$ID\"}"
is_problem 404 no-such-mesh 'nor can it be computed with'
as "$BEN" post_json /v1/cohorts "{\"name\":\"group\",\"members\":[{\"id\":\"$ID\"}]}"
is_problem 422 invalid-input 'nor named in a cohort'
as "$BEN" get /v1/meshes
is "$(json '.items | length')" 0 'nor is it listed'
as "$BEN" post '/v1/meshes?name=his' --data-binary "$MESH"
is "$STATUS $(json .name)" '201 his' 'until it is sent'

as "$ADA" execute encode "{\"mesh\":\"$ID\",\"lmax\":8}"
is "$STATUS" 200 'a user computes'
SURFACE=$(json .surface.id)
HER_JOB=$(json .surface.source.job)
as "$BEN" get "/v1/surfaces/$SURFACE"
is_problem 404 no-such-surface 'the surface is not another'"'"'s'
for path in "/v1/jobs/$HER_JOB" "/v1/jobs/$HER_JOB/results"; do
    as "$BEN" get "$path"
    is_problem 404 no-such-job "nor is $(basename "$path") of the job"
done
as "$BEN" post "/v1/jobs/$HER_JOB/cancel"
is_problem 404 no-such-job 'which another cannot cancel'
as "$BEN" request DELETE "/v1/jobs/$HER_JOB"
is_problem 404 no-such-job 'nor delete'
as "$BEN" execute encode "{\"mesh\":\"$ID\",\"lmax\":8}"
is "$STATUS $(header Cache-Status)" '200 srnfd; fwd=miss' 'the same work is not answered from a foreign cache'
isnt "$(json .surface.source.job)" "$HER_JOB" 'and names no foreign job'
HIS_JOB=$(json .surface.source.job)
is "$(json .surface.name)" his 'nor a foreign name'
as "$BEN" get "/v1/surfaces/$SURFACE"
is "$(json .source.job)" "$HIS_JOB" 'the surface itself is known by the own job'
as "$ADA" get "/v1/surfaces/$SURFACE"
is "$(json .source.job)" "$HER_JOB" 'by each owner'
for who in ADA BEN; do
    as "${!who}" get /v1/jobs
    is "$(json '.jobs | length')" 1 "jobs are listed for $who alone"
    as "${!who}" post_json /v1/cohorts "{\"name\":\"group\",\"members\":[{\"id\":\"$ID\",\"label\":\"$who\"}]}"
    is "$STATUS" 201 "$who may take the same name for a cohort"
done
as "$ADA" get /v1/cohorts/group
is "$(json '.members[0].label')" ADA 'and each gets the own one'
as "$BEN" request DELETE /v1/cohorts/group
is "$STATUS" 204 'and deletes that'
as "$ADA" get /v1/cohorts/group
is "$STATUS" 200 'and no other'
is "$(json .owner)" ada 'whose record says whose it is'
# An admin sees all cohorts, and names the owner of one that is not the own.
as "$BEN" post_json /v1/cohorts "{\"name\":\"group\",\"members\":[{\"id\":\"$ID\",\"label\":\"BEN\"}]}"
as "$ROOT" get /v1/cohorts
is "$(json '[.items[] | .owner + " " + .links.self] | sort | join(", ")')" \
    'ada /v1/cohorts/group?owner=ada, ben /v1/cohorts/group?owner=ben' 'an admin sees whose cohorts there are'
for method in GET DELETE; do
    as "$ROOT" request $method /v1/cohorts/group
    is_problem 409 owner-required "$method of a name that others have asks for the owner"
    like "$(json .detail)" '"ada", "ben"' 'and tells who has one'
    as "$ROOT" request $method '/v1/cohorts/group?owner=eve'
    is_problem 404 no-such-cohort "$method of an owner's who has none"
    as "$ADA" request $method '/v1/cohorts/group?owner=ben'
    is_problem 404 no-such-cohort "$method of another's, as a user"
done
as "$ROOT" get '/v1/cohorts/group?owner=ben'
is "$STATUS $(json .owner) $(json '.members[0].label')" '200 ben BEN' 'with the owner the admin gets that one'
as "$ROOT" get '/v1/cohorts?owner=ada'
is "$(json '[.items[].owner] | join(" ")')" ada 'and lists those of one owner'
as "$ADA" get '/v1/cohorts?owner=ben'
is_problem 403 forbidden 'which no user may'
as "$ADA" get '/v1/cohorts?owner=ada'
is "$STATUS $(json '.items | length')" '200 1' 'but for the own ones'
as "$ROOT" execute distances '{"cohort":"group","register":false}'
is_problem 409 owner-required 'an admin who computes with a name of several is asked, too'
as "$ROOT" request DELETE '/v1/cohorts/group?owner=ben'
is "$STATUS" 204 'an admin deletes what it names'
as "$ADA" get '/v1/cohorts/group?owner=ada'
is "$STATUS $(json .owner)" '200 ada' 'and the other stays'
as "$ROOT" get /v1/jobs
is "$(json '.jobs | length')" 2 'an admin sees all jobs'
as "$EYE" get "/v1/surfaces/$SURFACE"
is "$STATUS" 200 'a viewer of her name sees what is hers'
as "$EYE" post '/v1/meshes' --data-binary "$MESH"
is_problem 403 forbidden 'and changes nothing'

# Keys are each owner's, also while they are in flight.
for who in ADA BEN; do
    as "${!who}" execute encode "{\"mesh\":\"$ID\",\"lmax\":7}" --header 'Idempotency-Key: same'
    is "$STATUS" 200 "the same Idempotency-Key of $who"
done

# ---- Quotas ----------------------------------------------------------------------------------------------

SMALL=$(token small --max-bytes 100000 --max-requests 3)
as "$SMALL" post '/v1/meshes' --data-binary "$MESH"
is "$STATUS" 201 'within the quota of bytes'
as "$SMALL" post '/v1/meshes' --data-binary "$OTHER"
is_problem 507 storage-quota-exceeded 'beyond it'
is "$(json .quota) $(json .limit)" 'bytes 100000' 'which is named'
like "$(header Retry-After)" '^[0-9]+$' 'with Retry-After'
head -c 100001 /dev/zero >"$SCRATCH/large"
sleep 1
as "$SMALL" post '/v1/meshes' --data-binary "@$SCRATCH/large"
is_problem 413 body-too-large 'what could never be kept is not read'
refused=
for _ in 1 2 3 4 5 6 7 8 9 10 11 12; do
    as "$SMALL" get /v1/meshes
    if [ "$STATUS" = 429 ]; then
        refused=$(json .quota)
        break
    fi
done
is "$refused" requests 'too many requests a second'
like "$(header Retry-After)" '^[1-9]' 'with Retry-After, too'

# A job that takes long, so that what comes after it waits: then the owner's queue fills.
LONG="{\"srnf\":{\"surface\":\"$SURFACE\"},\"initial\":\"sphere\",\"lmax\":40,\"tolerance\":1e-30,\"maxIterations\":100000}"
ONE=$(token one --max-running 1)
as "$ONE" post '/v1/meshes' --data-binary "$MESH"
as "$ONE" execute encode "{\"mesh\":\"$ID\",\"lmax\":8}"
queue() { # NUMBER
    as "$ONE" execute invert "${LONG/100000/$((50000 + $1))}" --header 'Prefer: respond-async'
}
queue 0
is "$STATUS" 201 'a job that runs'
LONG_JOB=$(json .id)
for _ in $(seq 200); do
    as "$ONE" get "/v1/jobs/$LONG_JOB"
    [ "$(json .status)" = running ] && break
    sleep 0.05
done
is "$(json .status)" running 'does so'
JOBS=$LONG_JOB
for i in 1 2 3; do
    queue "$i"
    JOBS="$JOBS $(json .id)"
done
is "$STATUS" 201 'as many may wait as the quota says'
queue 4
is_problem 429 quota-exceeded 'and no more'
is "$(json .quota)" queued 'which is named, too'
as "$ADA" execute encode "{\"mesh\":\"$ID\",\"lmax\":6}"
is "$STATUS" 200 'another is served meanwhile'

# Answers that wait: one at a time.
(
    BODY=$SCRATCH/first HEADERS=$SCRATCH/first.h
    as "$ONE" execute invert "${LONG/100000/50000}" --header 'Prefer: wait=2'
) &
waiting=$!
sleep 0.7
as "$ONE" execute invert "${LONG/100000/50000}" --header 'Prefer: wait=2'
is "$STATUS $(json .quota)" '429 streams' 'answers that wait for jobs are counted'
wait "$waiting"
as "$ONE" execute invert "${LONG/100000/50000}" --header 'Prefer: wait=0.2'
is "$STATUS" 201 'until they are given'

# A stream of events ends with its token, while the job goes on.
curl --silent --no-buffer --max-time 60 --header "Authorization: Bearer $ONE" "$URL/v1/jobs/$LONG_JOB/events" \
    >"$SCRATCH/events" &
follower=$!
for _ in $(seq 200); do
    grep -q '^data' "$SCRATCH/events" && break
    sleep 0.05
done
started=$(date +%s)
"$SRNFD" token revoke one --data "$DATA" 2>/dev/null
wait "$follower"
is "$?" 0 'the stream of a token that is revoked ends'
compare "$(($(date +%s) - started))" '<=' 10 'within seconds'
for job in $JOBS; do
    as "$ROOT" post "/v1/jobs/$job/cancel"
done
is "$STATUS" 200 'and the jobs go on until somebody ends them'

# So does an answer that waits.
FIVE=$(token five)
as "$FIVE" post '/v1/meshes' --data-binary "$MESH"
as "$FIVE" execute encode "{\"mesh\":\"$ID\",\"lmax\":9}"
FIVE_SURFACE=$(json .surface.id)
(
    BODY=$SCRATCH/waits HEADERS=$SCRATCH/waits.h
    began=$(date +%s%3N)
    as "$FIVE" execute invert "${LONG/$SURFACE/$FIVE_SURFACE}" --header 'Prefer: wait=60'
    printf '%s %s %s\n' "$STATUS" "$(json .code)" "$(($(date +%s%3N) - began))" >"$SCRATCH/waited"
) &
waiting=$!
sleep 1
"$SRNFD" token revoke five --data "$DATA" 2>/dev/null
wait "$waiting"
read -r status code waited <"$SCRATCH/waited"
is "$status $code" '401 token-invalid' 'an answer that waits is not given to a token that was revoked'
compare "$waited" '<' 6000 'and that is told within seconds'
as "$ROOT" get '/v1/jobs?status=running&limit=1'
as "$ROOT" post "/v1/jobs/$(json '.jobs[0].id')/cancel"

# ---- Other origins -----------------------------------------------------------------------------------------

get /healthz --header 'Origin: https://app.example'
is "$(header Access-Control-Allow-Origin)" https://app.example 'a page of an allowed origin may read'
for name in ETag Content-Range Srnfd-Relative-Energy Srnfd-Offset Srnfd-Deleted; do
    like "$(header Access-Control-Expose-Headers), " "(^| )$name, " "and its scripts see $name"
done
is "$(header Vary)" Origin 'and caches are told'
request OPTIONS /v1/meshes --header 'Origin: https://b.example:8443' --header 'Access-Control-Request-Method: POST' \
    --header 'Access-Control-Request-Headers: authorization'
is "$STATUS $(header Access-Control-Allow-Origin)" '204 https://b.example:8443' 'a preflight'
like "$(header Access-Control-Allow-Methods)" 'POST' 'names the methods'
like "$(header Access-Control-Allow-Headers)" 'Authorization' 'and the headers'
like "$(header Access-Control-Allow-Headers)" 'If-Match, If-None-Match, If-Range, Range' 'those of conditions and parts too'
is "$(header Access-Control-Allow-Credentials)" '' 'and no credentials'
for origin in https://evil.example http://app.example https://app.example:8443 https://app.example.evil null; do
    get /healthz --header "Origin: $origin"
    is "$(header Access-Control-Allow-Origin) $(header Vary)" ' Origin' "$origin may not"
done
as "$ADA" post '/v1/meshes' --header 'Origin: https://app.example' --data-binary "$MESH"
is "$STATUS $(header Access-Control-Allow-Origin)" '200 https://app.example' 'a page of an allowed origin may send'
as "$ADA" post '/v1/meshes' --header 'Origin: https://evil.example' --data-binary "$MESH"
is_problem 403 forbidden 'one of another may not'

# ---- Revoking, and the list ---------------------------------------------------------------------------------

"$SRNFD" token list --data "$DATA" >"$SCRATCH/list"
is "$(awk -F'\t' '$2 == "ben" { print $3 }' "$SCRATCH/list")" user 'tokens are listed'
like "$(awk -F'\t' '$2 == "ben" { print $6 }' "$SCRATCH/list")" '^20' 'with their last use'
as "$ADA" get /v1/meshes --header 'X-Request-Id: whose'
get /healthz --header 'X-Request-Id: open'
askers() {
    jq -r 'select(.event == "request" and (.id == "whose" or .id == "open")) | .id + " " + (.owner // "nobody")' \
        "$SERVER_LOG" | paste -sd' '
}
for _ in {1..50}; do # a line is written after its answer has been sent
    [ "$(askers)" != 'whose ada open nobody' ] || break
    sleep 0.1
done
is "$(askers)" 'whose ada open nobody' 'the log says who asked'
unlike "$(cat "$SCRATCH/list" "$DATA"/tokens* "$SERVER_LOG")" "${BEN#srnfd_}" 'and no secret is in list, file or log'
"$SRNFD" token revoke "$(awk -F'\t' '$2 == "ben" { print $1 }' "$SCRATCH/list")" --data "$DATA" 2>/dev/null
is $? 0 'a token is revoked by its id'
as "$BEN" get /v1/jobs
is_problem 401 token-invalid 'and refused from then on'
BEN=$(token ben)
as "$BEN" get "/v1/jobs/$HIS_JOB"
is "$STATUS" 200 'a new token of the name has what was the name'"'"'s'
kill_server
start_server "$DATA" || exit 1
as "$BEN" get "/v1/surfaces/$SURFACE"
is "$STATUS $(json .source.job)" "200 $HIS_JOB" 'also after a crash'
get /v1/jobs
is "$STATUS" 401 'and tokens are asked for'
mv "$DATA/tokens" "$DATA/kept"
mkdir "$DATA/tokens"
as "$BEN" get /v1/jobs
is_problem 503 not-ready 'a file that cannot be read lets nobody in'
get /readyz
is "$STATUS $(json '.errors[0].pointer')" '503 /checks/tokensReadable' 'and a probe says so'
like "$(jq -r 'select(.event | startswith("tokens-")) | .level' "$SERVER_LOG" | tail -n 1)" error 'and the log'
rmdir "$DATA/tokens"
mv "$DATA/kept" "$DATA/tokens"
get /readyz
is "$STATUS" 200 'until it is back'
stop_server || not_ok 'the server ends well'

# ---- Pages of other sites, where everyone may call -----------------------------------------------------------

start_server "$SCRATCH/open" --listen 0.0.0.0:0 --insecure || exit 1
URL=http://127.0.0.1:${URL##*:}
page() { # HOST ORIGIN
    post /v1/meshes --header "Host: $1" ${2:+--header "Origin: $2"} --data-binary "$MESH"
    printf '%s' "$STATUS"
}
port=${URL##*:}
is "$(page "127.0.0.1:$port") $(page "192.0.2.7:$port") $(page "[2001:db8::1]:$port") $(page "localhost:$port")" \
    '201 200 200 200' 'without tokens beyond loopback any address in numbers may be asked for'
is "$(page "evil.example:$port") $(page "127.0.0.1.evil.example:$port") $(page '127.0.0.1:1:2') $(page '[::1')" \
    '403 403 403 403' 'but no name, which a site may have pointed here'
is "$(page "192.0.2.7:$port" "http://192.0.2.7:$port") $(page "192.0.2.7:$port" http://evil.example)" \
    '200 403' 'and no page of another site may send'
stop_server || not_ok 'the open server ends well'

# ---- Where it may listen ---------------------------------------------------------------------------------------

refuses() { # NAME ARGUMENTS..
    local name=$1
    shift
    timeout 20 "$SRNFD" serve --listen 0.0.0.0:0 "$@" >/dev/null 2>"$SCRATCH/refused"
    is $? 2 "$name: refused"
}
refuses 'beyond loopback without tokens' --data "$SCRATCH/none"
"$SRNFD" token add --data "$SCRATCH/emptied" --name a >/dev/null 2>&1
"$SRNFD" token revoke a --data "$SCRATCH/emptied" 2>/dev/null
refuses 'beyond loopback when all are revoked' --data "$SCRATCH/emptied"
printf 'no tokens\n' >"$SCRATCH/emptied/tokens"
refuses 'beyond loopback with a file that is damaged' --data "$SCRATCH/emptied"
is "$("$SRNFD" serve --listen 127.0.0.1:0 --data "$DATA" --tls-key x 2>&1 | jq -r .event)" refused 'a key without its certificate'
done_testing
