# shellcheck shell=bash
# browser.sh - tests that drive a browser by node scripts of tests/web. Sourced after lib.sh.

# Leaves the whole test out where there is no chromium, or no packages and no registry.
browser_ready() {
    [ -x "${CHROMIUM:-/usr/bin/chromium}" ] || skip_all 'chromium is not installed'
    web/install.sh >"$SCRATCH/npm" 2>&1
    case $? in
    0) ;;
    3) skip_all 'the packages are not installed, and the registry cannot be reached' ;;
    *)
        not_ok 'the packages are installed' "$(head -n 4 "$SCRATCH/npm")"
        done_testing
        ;;
    esac
}

# Runs a script, whose lines are steps (tests/web/steps.cjs).
run_steps() { # SECONDS SCRIPT ARGUMENTS..
    local seconds=$1 verdict name detail status
    shift
    HOME=$SCRATCH timeout -k 2 "$seconds" node "$@" >"$SCRATCH/steps" 2>"$SCRATCH/errors"
    status=$?
    while IFS=$'\t' read -r verdict name detail; do
        case $verdict in
        ok) ok "$name" ;;
        note) note "$name" ;;
        *) not_ok "$name" "$detail" ;;
        esac
    done <"$SCRATCH/steps"
    is "$status$(head -n 5 "$SCRATCH/errors")" 0 "all steps of $1 were taken"
}
