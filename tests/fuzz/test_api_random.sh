#!/usr/bin/env bash
# test_api.sh with requests that no run has drawn before. It prints the seed: SEED=.. REQUESTS=.. tests/fuzz/test_api.sh
# draws them again.
# srnfd-test: nightly
# srnfd-test: timeout 900
export SEED=${SEED:-random} REQUESTS=${REQUESTS:-4000}
exec "$(dirname "$0")/test_api.sh"
