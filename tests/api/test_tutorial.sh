#!/usr/bin/env bash
# docs/tutorial.md, run word for word against a live server, and that its answers are what the text says of them.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

start_server "$SCRATCH/data" || exit 1
run_documents docs/tutorial.md
cd "$SCRATCH/clone" || exit 1

is "$(jq -sc 'map(select(.report).report.analysable) | [length, all]' ./[LR]_*.json)" '[12,true]' 'the meshes can be analysed'
like "$(cat "$SCRATCH/out")" '"analysable": false' 'and the one that lacks a face cannot'
like "$(cat "$SCRATCH/out")" 'duplicate-vertices-merged' 'repairs are shown'
is "$(jq -s length members.txt)" 12 'the cohort has twelve members'
is "$(wc -l <distances.csv)" 12 'and a matrix of distances'
is "$(jq .converged mean.json)" true 'the mean converged'
is "$(jq '.relativeEnergy < 0.00035 and .relativeEnergy > 0.0002' mean.json)" true 'with the energy that the text has'
is "$(jq -c '[.groupSizes.subjects, .exact, .relabellings]' compared.json)" '[[3,3],true,20]' \
    'three subjects against three have twenty relabellings'
is "$(jq -r '.warnings[].code' compared.json)" p-floor 'and a smallest p, which is warned of'
is "$(jq '.warnings[0].figures.leastP' compared.json)" 0.1 'of 0.1'
is "$(jq -c '[.subjects, .majorityRate]' classified.json)" '[6,0.5]' 'the classifiers count subjects'
is "$(head -c 3 mean.ply)" ply 'the mean is a PLY file'
check 'the map is in the VTK file' grep -qa '^SCALARS significance' significance.vtk
check 'both ends of the mode are there' test -s mode_0.ply -a -s mode_2.ply

cd "$ROOT" || exit 1
stop_server || not_ok 'the server ends well'
done_testing
