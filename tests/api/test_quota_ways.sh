#!/usr/bin/env bash
# srnfd-test: nightly
# srnfd-test: timeout 1200
# test_quota.sh with all its ways: more than a hundred.
export SRNFD_QUOTA_WAYS=all
exec bash "$(dirname "$0")/test_quota.sh"
