#!/usr/bin/env bash
# The Python lines of docs/python.md, run word for word against a live server, whose routes must all have been asked.
# srnfd-test: release-only
# srnfd-test: nightly
# srnfd-test: timeout 600
. "$(dirname "$0")/../support/lib.sh"

export PYTHONPATH=$ROOT/clients/python/src MPLBACKEND=Agg
unset SRNF_TOKEN SRNF_TOKEN_FILE
mkdir "$SCRATCH/clone"
ln -s "$ROOT/tests" "$SCRATCH/clone/tests"
ln -s "$SRNFD_BUILD" "$SCRATCH/clone/build"
ln -s "$SCRATCH/data" "$SCRATCH/clone/data"
start_server "$SCRATCH/data" --access-log all || exit 1
export SRNF_SERVER=$URL
cd "$SCRATCH/clone" || exit 1

awk '/^```python$/ { on = 1; next } /^```$/ { on = 0 } on' "$ROOT/docs/python.md" >document.py
if /usr/bin/python3 -B document.py >"$SCRATCH/out" 2>"$SCRATCH/err"; then
    ok 'all lines of docs/python.md succeed'
else
    not_ok 'all lines of docs/python.md succeed' "$(tail -n 12 "$SCRATCH/err")"
fi
for file in thalamus.ply uploaded.glb volume.nii.gz thalamus.gii geodesic.json distances.csv study.zip model.zip shape.glb members.csv \
    first-study/report.html; do
    check "$file is written" test -s $file
done
check 'the content that comes back is the file' cmp thalamus.ply tests/data/aal_subcortex/L_thalamus.ply
cd "$ROOT" || exit 1
get /v1/processes -H "Authorization: Bearer $("$SRNFD" token add --name eve --data "$SCRATCH/data" 2>/dev/null)"
json '.processes[].id' >"$SCRATCH/processes"
stop_server || not_ok 'the server ends well'

jq -Rr 'fromjson? | select(.event == "request" and .status < 300) | "\(.method) \(.path)"' "$SERVER_LOG" | sort -u >"$SCRATCH/asked"
while read -r method pattern _; do
    expression=$(sed 's/[.]/[.]/g; s/{[a-z]*}/[^\/]+/g' <<<"$pattern")
    check "the document shows $method $pattern" grep -qE "^$method $expression\$" "$SCRATCH/asked"
done < <("$SRNFD" routes | grep -vE ' (/ui(/|$| )|/v1/leases)') # for browsers; for srnfd worker
while read -r process; do
    check "the document runs $process" grep -q "/v1/processes/$process/execution" "$SERVER_LOG"
done <"$SCRATCH/processes"
compare "$(wc -l <"$SCRATCH/processes")" '>=' 18 'which are all that there are'
done_testing
