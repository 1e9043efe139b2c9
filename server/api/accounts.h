/*
 * accounts.h - what each token that was ever used has in use: requests a second, streams.
 */
#ifndef SRNFD_API_ACCOUNTS_H
#define SRNFD_API_ACCOUNTS_H

#include "store/token.h"

struct auth_account {
    struct auth_account *next;
    char token[STORE_TOKEN_ID_MAX];
    double level, filled; /* requests in the bucket, and when (monotonic seconds) */
    size_t streams;
    int64_t used_ms, recorded_ms;
};

/* The account of a token, made where there is none; NULL without memory. */
struct auth_account *account_of(struct auth_account **accounts, const struct store_token *token);
/* Takes a request out of the bucket. Returns 0, or the seconds after which there is one. */
double account_draw(struct auth_account *account, int64_t rate);

#endif
