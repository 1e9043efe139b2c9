/*
 * accounts.c - the accounts of tokens, as auth.c keeps them under its mutex.
 *
 * Requests a second are a token bucket of two seconds' worth, streams a count, both of the token
 * and in memory. Jobs and bytes are the owner's and are asked for in the transaction of the store
 * that would add to them.
 */
#include "api/accounts.h"

#include "clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BURST_SECONDS 2.0 /* of requests that may come at once */

struct auth_account *account_of(struct auth_account **accounts, const struct store_token *token)
{
    struct auth_account *account = *accounts;

    while (account && strcmp(account->token, token->id) != 0) {
        account = account->next;
    }
    if (!account) {
        account = calloc(1, sizeof *account);
        if (!account) {
            return NULL;
        }
        memcpy(account->token, token->id, sizeof account->token);
        account->level = HUGE_VAL;
        account->next = *accounts;
        *accounts = account;
    }
    return account;
}

double account_draw(struct auth_account *account, int64_t rate)
{
    double now = clock_now(), most = BURST_SECONDS * (double)rate;

    if (rate <= 0) {
        return 0;
    }
    account->level = fmin(most, account->level + (now - account->filled) * (double)rate);
    account->filled = now;
    if (account->level < 1) {
        return (1 - account->level) / (double)rate;
    }
    account->level -= 1;
    return 0;
}
