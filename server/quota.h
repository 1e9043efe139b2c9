/*
 * quota.h - what a token may use.
 */
#ifndef SRNFD_QUOTA_H
#define SRNFD_QUOTA_H

#include <stdint.h>

enum store_quota {
    STORE_QUOTA_QUEUED,   /* jobs of the owner that wait */
    STORE_QUOTA_RUNNING,  /* jobs of the owner that run at once */
    STORE_QUOTA_BYTES,    /* that the owner holds */
    STORE_QUOTA_REQUESTS, /* a second, with this token */
    STORE_QUOTA_STREAMS,  /* answers that wait for jobs at once, with this token */
};
#define STORE_QUOTAS 5
#define STORE_QUOTA_LARGEST INT64_C(9007199254740992)
/* "queued", "running", "bytes", "requests", "streams". */
const char *store_quota_name(enum store_quota quota);

#endif
