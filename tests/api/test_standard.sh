#!/usr/bin/env bash
# OGC API - Processes 1.0 by a client that others wrote (standard.py has the table of requirements).
# srnfd-test: slow
# srnfd-test: once (every process runs with sanitizers, by its least inputs)
. "$(dirname "$0")/../support/lib.sh"

/usr/bin/python3 -c 'import owslib, jsonschema' 2>/dev/null || {
    not_ok 'OWSLib is installed (deploy/install-deps.sh --tests)'
    done_testing
}
start_server "$SCRATCH/data" --workers 2 || exit 1
/usr/bin/python3 tests/api/standard.py "$URL" >"$SCRATCH/tap" 2>"$SCRATCH/errors"
is "$?$(head -c 2000 "$SCRATCH/errors")" 0 'the client comes to its end'
while IFS= read -r line; do
    case $line in
    'ok '*) ok "${line#* - }" ;;
    'not ok '*) not_ok "${line#* - }" ;;
    '#'*) note "${line#\# }" ;;
    esac
done <"$SCRATCH/tap"
stop_server || not_ok 'the server ends well'
done_testing
