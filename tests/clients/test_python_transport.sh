#!/usr/bin/env bash
# The Python client beside servers that are busy, broken or gone. Needs no daemon.
# srnfd-test: release-only
cd "$(dirname "$0")/../.." || exit 1
PYTHONPATH=clients/python/src exec /usr/bin/python3 -B tests/clients/tap.py tests/clients/python_transport.py
