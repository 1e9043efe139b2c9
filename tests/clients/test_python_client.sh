#!/usr/bin/env bash
# The Python client against the real daemon.
# srnfd-test: release-only
# srnfd-test: slow
cd "$(dirname "$0")/../.." || exit 1
MPLBACKEND=Agg PYTHONPATH=clients/python/src exec /usr/bin/python3 -B tests/clients/tap.py tests/clients/python_client.py
