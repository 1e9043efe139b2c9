/*
 * fuzz_token.c - any bytes at all as the file of tokens. It is read as a whole or refused as a
 * whole; each token that is read has a name and quotas that could have been given.
 */
#include "fuzz/fuzz_require.h"
#include "store/store.h"
#include "store/token.h"
#include "support/scratch.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static char directory[SCRATCH_MAX];
static char path[SCRATCH_MAX + 16];

static void remove_directory(void)
{
    scratch_remove(directory);
}

static void write_file(const uint8_t *data, size_t size)
{
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);

    fuzz_require(file >= 0 && write(file, data, size) == (ssize_t)size);
    (void)close(file);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct store_tokens tokens = {.n = 0};
    int status;

    if (!path[0]) {
        fuzz_require(scratch_make(directory, "fuzz-token"));
        (void)snprintf(path, sizeof path, "%s/%s", directory, STORE_TOKENS_NAME);
        (void)atexit(remove_directory);
    }
    write_file(data, size);
    status = store_tokens_load(directory, &tokens);
    fuzz_require(status == STORE_OK || status == STORE_CORRUPT);
    fuzz_require(status == STORE_OK || (tokens.n == 0 && !tokens.list));
    for (size_t i = 0; i < tokens.n; i++) {
        const struct store_token *token = &tokens.list[i];

        fuzz_require(store_token_name_valid(token->name) && token->role < STORE_ROLES);
        fuzz_require(memchr(token->id, '\0', sizeof token->id) && strlen(token->hash) == 64);
        for (int k = 0; k < STORE_QUOTAS; k++) {
            fuzz_require(token->quotas[k] >= -1 && token->quotas[k] <= STORE_QUOTA_LARGEST);
        }
    }
    (void)store_tokens_find(&tokens, "srnfd_0");
    store_tokens_clear(&tokens);
    return 0;
}
