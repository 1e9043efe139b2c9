/*
 * quota.c - the names of quotas, as the contract and the file of tokens have them.
 */
#include "quota.h"

static const char *const names[STORE_QUOTAS] = {"queued", "running", "bytes", "requests",
                                                "streams"};

const char *store_quota_name(enum store_quota quota)
{
    return names[quota];
}
