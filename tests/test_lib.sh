#!/usr/bin/env bash
# tests/support/lib.sh itself: its verdicts, and how it starts, stops and cleans up servers, against a
# pretended daemon.
# srnfd-test: release-only
. "$(dirname "$0")/support/lib.sh"

# The output of a script that sources lib.sh, without its plan; RESULT is its status.
script() { # STATEMENTS
    OUTPUT=$(SRNFD=$SCRATCH/daemon bash -c ". tests/support/lib.sh; $1" "$ROOT/tests/x.sh" 2>"$SCRATCH/err")
    RESULT=$?
}

passes() { # STATEMENT
    script "$1; done_testing"
    like "$RESULT:$OUTPUT" '^0:ok 1 - a' "passes: $1"
}
fails() { # STATEMENT
    script "$1; done_testing"
    like "$RESULT:$OUTPUT" '^1:not ok 1 - a' "fails: $1"
}

passes 'ok a'
fails 'not_ok a why'
passes 'is x x a'
fails 'is x y a'
fails 'isnt x x a'
passes 'isnt x y a'
fails 'isnt "" y a'
fails 'isnt null y a'
passes 'like abc b. a'
fails 'like abc d a'
passes 'unlike abc d a'
fails 'unlike abc b a'
passes 'check a true'
fails 'check a false'
passes 'compare 1e-7 "<=" 1E-5 a'
fails 'compare 1e-4 "<=" 1e-5 a'
fails 'compare null "<=" 1e-5 a'
fails 'compare 2 -le 1 a' # no operator of awk, which would take it for a difference
fails 'compare 1 -le 2 a'
fails 'compare "" "<=" 1 a'
fails 'compare nan "<=" 1 a'
fails 'compare -inf "<=" 1 a'
fails 'compare 2.75 "<" 2.5 a' # where numbers have a comma, mawk takes both for 2
passes 'echo "{\"x\":2}" >"$BODY"; is "$(json "(.x | real) < 3")" true a'
fails 'echo "{\"x\":null}" >"$BODY"; is "$(json "(.x | real) < 3")" true a'
OUTPUT=$(LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8 bash -c '. tests/support/lib.sh; echo "$LC_ALL"' "$ROOT/tests/x.sh" 2>/dev/null)
is "$OUTPUT" C 'the language of the caller is not that of the tests'

script 'ok a; is 1 2 b; skip c "no data"; done_testing'
like "$OUTPUT" '1\.\.3$' 'the plan counts what was reported'
like "$OUTPUT" 'ok 3 - c # SKIP no data' 'skips say why'
is "$RESULT" 1 'one failure makes the script fail'
script 'skip_all "no data"; echo more'
is "$RESULT:$OUTPUT" '0:1..0 # SKIP no data' 'a script can be left out'
script 'ok a; exit 0'
unlike "$OUTPUT" '1\.\.' 'a script that ends too early has no plan'

# The daemon: announces itself, says on TERM that it drains; "slow" is never ready, "dies" ends at once,
# "bad" ends with an error, "stubborn" does not end.
cat >"$SCRATCH/daemon" <<'END'
#!/usr/bin/env bash
case "$*" in
*dies*) echo 'no room' >&2; exit 3 ;;
*slow*) exec sleep 600 ;;
*stubborn*) trap '' TERM ;;
*bad*) trap 'exit 9' TERM ;;
*) trap 'echo drained >&2; exit 0' TERM ;;
esac
echo 'starting, not JSON' >&2
echo '{"time":"now","event":"listening", "address":"127.0.0.1:4711"}' >&2
echo "$*" >&2
while :; do sleep 0.05; done
END
chmod +x "$SCRATCH/daemon"

script 'start_server "$SCRATCH/d" --workers 2; echo "$URL"; stop_server; echo "$? $SERVER_STATUS"
    tail -n 2 "$SERVER_LOG"'
is "$OUTPUT" 'http://127.0.0.1:4711
0 0
serve --listen 127.0.0.1:0 --data '"$(sed -n 's/.*--data \([^ ]*\) .*/\1/p' <<<"$OUTPUT")"' --workers 2
drained' 'a server is started with its arguments, announced, and drained'
script 'start_server d dies; echo "$?"'
is "$OUTPUT" 1 'a server that ends before it is ready is an error'
like "$(cat "$SCRATCH/err")" 'no room' 'and its log is shown'
script 'SERVER_SECONDS=1; start_server d slow; echo "$?"'
is "$OUTPUT" 1 'a server that is never ready is an error'
script '(start_server d; kill_server; echo "$SERVER_LOG"); start_server e; kill_server; echo "$SERVER_LOG"'
is "$(sort -u <<<"$OUTPUT" | wc -l)" 2 'a server of a subshell has another log'
script 'start_server d bad; stop_server; echo "$? $SERVER_STATUS"'
is "$OUTPUT" '1 9' 'a server that ends badly is an error'
script 'SERVER_SECONDS=1; start_server d stubborn; stop_server; echo "$?"'
is "$OUTPUT" 1 'a server that does not drain is an error'
script 'start_server d; kill_server; echo "$SERVER_STATUS"'
is "$OUTPUT" 137 'a server can be killed'
script 'start_server d stubborn; echo "$SERVER_PID"; start_server e; echo "$SERVER_PID"'
for pid in $OUTPUT; do
    unlike "$(cat "/proc/$pid/stat" 2>/dev/null)" '\) [^ZX] ' 'no server outlives its script'
done

# Answers as curl leaves them.
script 'printf "HTTP/1.1 404 Not Found\r\ncontent-type: application/problem+json\r\n\r\n" >"$HEADERS"
    echo "{\"code\":\"no-such-mesh\",\"status\":404}" >"$BODY"; STATUS=404
    echo "$(header Content-Type)"; is_problem 404 no-such-mesh a; is_problem 404 no-such-job b'
like "$OUTPUT" 'application/problem\+json' 'headers are found without regard to case'
like "$OUTPUT" 'ok 1 - a' 'a problem is known by status and code'
like "$OUTPUT" 'not ok 2 - b' 'and told from another'

# Members of documents: what json_member prints is what jq prints, and what it cannot print it leaves to jq.
same=0
while IFS= read -r document; do
    printf '%s' "$document" >"$SCRATCH/document"
    for filter in .a .a.b '.a[0]' '.a[1].b' .a.b.c '.a[7]' .b .missing .missing.deep '.a[0' .1 .a-b '.a["b"]' '.a|.b' .a.; do
        got=$("$JSON_MEMBER" "$SCRATCH/document" "$filter")
        case $?:$got in
        0:*) same=$((same + 1)) && [ "$got" = "$(jq -r "$filter" "$SCRATCH/document" 2>&1)" ] ;;
        3:) ;;
        *) false ;;
        esac || not_ok "$filter of $document" "got: $got"
    done
done <<'END'
{"a": "text", "b": true}
{"a": {"b": "two\nlines \u00e9 \"quoted\""}, "b": null}
{"a": {"b": {"c": 17}}, "b": -3}
{"a": [1, {"b": false}], "b": 0}
{"a": [{}, []], "b": 1.50}
{"a": 9007199254740993, "b": 1e3}
{"a": 12345678901234567890, "b": ""}
{"a": 1, "a": 2}
{"a": 1} {"a": 2}
[{"a": 1}]
"a"
{"a": "cut
END
is "$same" 27 'members are as jq prints them'
"$JSON_MEMBER" "$SCRATCH/none" .a
is $? 3 'a file that is not there is left to jq'
script 'echo "{\"a\": [{\"b\": \"c d\"}], \"x\": 0.5}" >"$BODY"; json ".a[0].b"; json .x; json ".a | length"; json .y; json .x.y'
is "$OUTPUT" $'c d\n0.5\n1\nnull' 'members, and what jq computes of them'
script 'REQUEST_SECONDS=2; get http://127.0.0.1:1/; echo "$STATUS"'
is "$OUTPUT" 000 'no answer is status 000'

done_testing
