#!/usr/bin/env bash
# The dashboard as it is served: where it is, its policy, what is packed and what is kept; and who calls.
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" --workers 1 || exit 1

get / --header 'Accept: text/html,application/xhtml+xml,*/*;q=0.8'
is "$STATUS $(header Location)" '302 ui/' 'a browser is led to the dashboard'
get /
is "$STATUS $(header Content-Type)" '200 application/json' 'a program is not'
get /ui
is "$STATUS $(header Location)" '302 ui/' 'without the last slash too, by an address that a prefix keeps'

get /ui/
is "$STATUS $(header Content-Type)" '200 text/html; charset=utf-8' 'the page is there'
like "$(header Content-Security-Policy)" "^default-src 'none'; script-src 'self'; style-src 'self'" 'with its policy'
unlike "$(header Content-Security-Policy)" "unsafe|http:" 'which allows nothing from elsewhere, and nothing in the page'
is "$(header Cache-Control)" no-cache 'the page itself is asked for again'
TAG=$(header ETag)
get /ui/ --header "If-None-Match: $TAG"
is "$STATUS $(wc -c <"$BODY")" '304 0' 'by its tag'
get /ui/
APP=$(grep -oE 'app-[A-Z0-9]+\.js' "$BODY")

get "/ui/$APP" --header 'Accept-Encoding: gzip'
is "$STATUS $(header Content-Encoding)" '200 gzip' 'the program is packed'
is "$(header Cache-Control)" 'public, max-age=31536000, immutable' 'and kept for good'
gzip -dc "$BODY" >"$SCRATCH/app.js"
PACKED_TAG=$(header ETag)
get "/ui/$APP"
is "$STATUS $(header Content-Encoding)" '200 ' 'who takes no gzip gets it unpacked'
check 'with the same bytes' cmp "$BODY" "$SCRATCH/app.js"
check 'those of the tree' cmp "$BODY" "web/dist/$APP"
isnt "$(header ETag)" "$PACKED_TAG" 'under another tag'
get "/ui/$APP" --header 'Accept-Encoding: gzip;q=0'
is "$(header Content-Encoding)" '' 'as does who refuses it'
request HEAD "/ui/$APP"
is "$STATUS" 200 'HEAD is answered'

get /ui/example/L_thalamus.ply
check 'a mesh of the example is the one of the tree' cmp "$BODY" tests/data/aal_subcortex/L_thalamus.ply
get /ui/example/licence.txt
like "$(cat "$BODY")" 'Copyright 2006-2010, Chris Rorden' 'its licence goes along'
get /ui/licences.txt
like "$(cat "$BODY")" 'preact .*three ' 'and those of what is bundled'

for name in nothing.js index.html.gz ... example; do
    get "/ui/$name"
    is_problem 404 not-found "$name is not there"
done
post /ui/
is_problem 405 method-not-allowed 'it is only read'

get /v1/caller
is "$(jq -Sc . "$BODY")" '{"role":"admin","tokens":false}' 'without tokens everyone may do all'
EYE=$("$SRNFD" token add --data "$SCRATCH/data" --name ada --role viewer 2>/dev/null)
get /v1/caller --header "Authorization: Bearer $EYE"
is "$(jq -Sc . "$BODY")" '{"name":"ada","role":"viewer","tokens":true}' 'a token has a name and a role'
get /v1/caller
is_problem 401 token-required 'and is needed then'
get /ui/
is "$STATUS" 200 'the dashboard itself opens without'

stop_server
is $? 0 'it ends well'
done_testing
