#!/bin/sh
# What the image runs: a token before anything else, then the daemon.
#
# A container is reached from outside, so the daemon has tokens from its first start on. The first one, an
# administrator's, is what the secret srnfd_token holds (/run/secrets/srnfd_token, or SRNFD_TOKEN_FILE; 32 to 55
# letters, digits, hyphens and underscores), or else a new one, which is printed once:
#
#   docker logs CONTAINER 2>&1 | grep srnfd_
#
# Further tokens: docker exec CONTAINER srnfd token add --name ada
set -eu

data=${SRNFD_DATA:-/var/lib/srnfd}
secret=${SRNFD_TOKEN_FILE:-/run/secrets/srnfd_token}

if [ ! -e "$data/tokens" ]; then
    if [ -e "$secret" ] || [ -n "${SRNFD_TOKEN_FILE:-}" ]; then
        srnfd token add --data "$data" --name admin --role admin --secret-file "$secret"
    else
        srnfd token add --data "$data" --name admin --role admin
    fi
fi
exec srnfd serve --data "$data" --listen "${SRNFD_LISTEN:-0.0.0.0:8080}" "$@"
