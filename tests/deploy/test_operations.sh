#!/usr/bin/env bash
# What the daemon can raise an alarm with, against deploy/OPERATIONS.md: each event of the log above info, each problem
# that is the service's own, and back: what the tables name is there.
. "$(dirname "$0")/../support/lib.sh"

MANUAL=deploy/OPERATIONS.md
mkdir "$SCRATCH/installed"
make --no-print-directory -n install-service DESTDIR="$SCRATCH/installed" PREFIX=/usr |
    grep '^install .*share/doc' >"$SCRATCH/install.sh"
check 'the documents are installed' bash -e "$SCRATCH/install.sh"
for document in README.md CHANGELOG.md OPERATIONS.md reference.md tutorial.md examples/srnfd-slurm.json examples/nginx.conf; do
    check "$document is among them" test -s "$SCRATCH/installed/usr/share/doc/srnfd/$document"
done

TABLES=$(sed -n '/^## What each alarm means/,/^## [^W]/p' $MANUAL)
grep -oE '`[^`]+`' <<<"$TABLES" | tr -d '\`' | sort -u >"$SCRATCH/named" # the words in backquotes
missing() { # reads names; prints those that the table lacks
    sort -u | comm -23 - "$SCRATCH/named"
}
sources() {
    find server -name '*.c' -exec cat {} +
}

# "request" is for refusals of single requests, whose codes are below; job-failed has the job's.
events() {
    sources | grep -oE 'LOG_(WARN|ERROR)\("[a-z-]+"' | grep -oE '[a-z-]{3,}'
    sed -n '/alarms\[\] = {/,/};/p' server/main/service.c | grep -oE '"[a-z-]+"' | tr -d '"'
    sources | grep -oE 'compose\([^,]*, "(error|warn)", "[a-z-]+"' | sed 's/.*"\([a-z-]*\)"$/\1/'
    grep -oE '\\"event\\":\\"[a-z-]+' server/jobs/fault.c | sed 's/.*"//'
}
events >"$SCRATCH/events"
compare "$(grep -cvx request "$SCRATCH/events")" '>=' 14 'events above info are found'
for event in fault job-not-written log-lines-dropped tokens-missing; do
    check "$event among them" grep -qx "$event" "$SCRATCH/events"
done
is "$(grep -vx request "$SCRATCH/events" | missing | paste -sd' ')" '' 'the manual has each'

grep -oE '^ *\{"[a-z-]+", 5[0-9][0-9],' server/api/problem.c | grep -oE '[a-z]+(-[a-z]+)+' >"$SCRATCH/problems"
compare "$(wc -l <"$SCRATCH/problems")" '>=' 12 'problems of the service are found'
is "$(grep -vx http-version-not-supported "$SCRATCH/problems" | missing | paste -sd' ')" '' 'and each of these'

# What is named is what the daemon has.
sources >"$SCRATCH/sources"
grep -oE 'log `[^`]+`(, `[a-z-]+`)*' <<<"$TABLES" | grep -oE '`[a-z-]+`' | tr -d '\`' | sort -u |
    while read -r event; do
        grep -qE "\"$event\\\\?\"" "$SCRATCH/sources" || echo "$event"
    done >"$SCRATCH/unknown"
is "$(paste -sd' ' "$SCRATCH/unknown")" '' 'no event is named that there is not'
grep -ohE '\b(srnfd|process)_[a-z_]+[a-z]' $MANUAL server/README.md docs/*.md | sort -u |
    grep -vxE 'srnfd_(token|XXXX.*)' >"$SCRATCH/series"
compare "$(wc -l <"$SCRATCH/series")" '>=' 15 'series are named'
while read -r series; do
    grep -qE "\"$series\"" server/metrics*.c || echo "$series"
done <"$SCRATCH/series" >"$SCRATCH/unknown"
is "$(paste -sd' ' "$SCRATCH/unknown")" '' 'and each is there'
done_testing
