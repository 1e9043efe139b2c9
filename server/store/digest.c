/*
 * digest.c - SHA-256 of content, and the ids that are made of it.
 */
#include "store/digest.h"

#include <sodium.h>
#include <stdio.h>

void store_sha256_hex(char hex[65], const void *bytes, size_t size)
{
    unsigned char hash[crypto_hash_sha256_BYTES];

    crypto_hash_sha256(hash, bytes, size);
    sodium_bin2hex(hex, 65, hash, sizeof hash);
}

void store_content_id(char id[STORE_ID_MAX], const char *prefix, const void *bytes, size_t size)
{
    char hex[65];

    store_sha256_hex(hex, bytes, size);
    snprintf(id, STORE_ID_MAX, "%s%.32s", prefix, hex);
}
