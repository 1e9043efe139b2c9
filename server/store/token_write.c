/*
 * token_write.c - tokens added and revoked: the file is replaced as a whole.
 *
 * Writers of several processes take turns by flock on DIR/tokens.lock.
 */
#include "store/token_file.h"

#include "store/digest.h"
#include "store/files.h"
#include "store/store.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define SECRET_PREFIX "srnfd_"
#define SECRET_BYTES 32

/* Gives a file that root has made to the owner of the directory, so that the daemon can read it. */
static int give_to_owner(const char *directory, int fd)
{
    struct stat info, own;

    if (fstat(fd, &own) != 0) {
        return store_map_errno(errno);
    }
    if (!S_ISREG(own.st_mode) || own.st_nlink != 1) {
        return STORE_CORRUPT; /* somebody put there what is not ours to give away */
    }
    if (geteuid() != 0) {
        return STORE_OK;
    }
    return stat(directory, &info) == 0 && fchown(fd, info.st_uid, info.st_gid) == 0
               ? STORE_OK
               : store_map_errno(errno);
}

/* Takes the writers' lock; *fd is to be closed. */
static int lock(const char *directory, int *fd)
{
    char path[STORE_TOKEN_PATH];
    int status = store_token_path(path, directory, STORE_TOKENS_NAME ".lock");

    *fd = -1;
    if (status != STORE_OK) {
        return status;
    }
    *fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
    if (*fd < 0) {
        return store_map_errno(errno);
    }
    status = give_to_owner(directory, *fd);
    if (status != STORE_OK) {
        return status;
    }
    while (flock(*fd, LOCK_EX) != 0) {
        if (errno != EINTR) {
            return store_map_errno(errno);
        }
    }
    return STORE_OK;
}

static char *make_text(const struct store_tokens *tokens, size_t *size)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, size);
    bool failed;

    if (!out) {
        return NULL;
    }
    (void)fputs(STORE_TOKENS_HEADER, out);
    for (size_t i = 0; i < tokens->n; i++) {
        const struct store_token *token = &tokens->list[i];

        (void)fprintf(out, "%s\t%s\t%s\t%s\t%" PRId64 "\t%" PRId64, token->id, token->name,
                      store_role_name(token->role), token->hash, token->created_ms,
                      token->expires_ms);
        for (size_t k = 0; k < STORE_QUOTAS; k++) {
            (void)fprintf(out, "\t%" PRId64, token->quotas[k]);
        }
        (void)fputc('\n', out);
    }
    failed = ferror(out) != 0;
    failed = fclose(out) != 0 || failed;
    if (failed) {
        free(text);
        text = NULL;
    }
    return text;
}

/* What stands at the path already, be it a link, is removed and not written to. */
static int write_file(const char *directory, const char *path, const char *text, size_t size)
{
    int fd, status;

    (void)unlink(path);
    fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    status = fd >= 0 ? give_to_owner(directory, fd) : store_map_errno(errno);
    if (status == STORE_OK) {
        status = store_write_all(fd, (const unsigned char *)text, size);
    }
    if (fd >= 0 && close(fd) != 0 && status == STORE_OK) {
        status = store_map_errno(errno);
    }
    return status;
}

static int sync_folder(const char *directory)
{
    int fd = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    int status = fd >= 0 && fsync(fd) == 0 ? STORE_OK : store_map_errno(errno);

    if (fd >= 0) {
        close(fd);
    }
    return status;
}

/* Replaces the file; the lock is held. */
static int save(const char *directory, const struct store_tokens *tokens)
{
    char path[STORE_TOKEN_PATH], temporary[STORE_TOKEN_PATH];
    size_t size = 0;
    char *text = make_text(tokens, &size);
    int status = text ? store_token_path(path, directory, STORE_TOKENS_NAME) : STORE_NOMEM;

    if (status == STORE_OK) {
        status = store_token_path(temporary, directory, STORE_TOKENS_NAME ".new");
    }
    if (status == STORE_OK) {
        status = write_file(directory, temporary, text, size);
        if (status == STORE_OK && rename(temporary, path) != 0) {
            status = store_map_errno(errno);
        }
        if (status != STORE_OK) {
            (void)unlink(temporary);
        }
    }
    free(text);
    return status == STORE_OK ? sync_folder(directory) : status;
}

static void make_secret(struct store_token *token, char secret[STORE_SECRET_MAX])
{
    unsigned char bytes[SECRET_BYTES], id[8];
    char hex[2 * sizeof id + 1];
    size_t prefix = sizeof SECRET_PREFIX - 1;

    randombytes_buf(id, sizeof id);
    if (!secret[0]) {
        randombytes_buf(bytes, sizeof bytes);
        memcpy(secret, SECRET_PREFIX, prefix);
        (void)sodium_bin2base64(secret + prefix, STORE_SECRET_MAX - prefix, bytes, sizeof bytes,
                                sodium_base64_VARIANT_URLSAFE_NO_PADDING);
        sodium_memzero(bytes, sizeof bytes);
    }
    store_sha256_hex(token->hash, secret, strlen(secret));
    (void)snprintf(token->id, sizeof token->id, "tok-%s",
                   sodium_bin2hex(hex, sizeof hex, id, sizeof id));
}

int store_token_add(const char *directory, struct store_token *token, char secret[STORE_SECRET_MAX])
{
    struct store_tokens tokens = {.list = NULL};
    struct store_token *grown;
    int fd = -1, status = store_make_directory(directory);

    if (status == STORE_OK) {
        status = sodium_init() < 0 ? STORE_IO : lock(directory, &fd);
    }
    if (status == STORE_OK) {
        status = store_tokens_load(directory, &tokens);
    }
    if (status != STORE_OK) {
        goto out;
    }
    grown = realloc(tokens.list, (tokens.n + 1) * sizeof *tokens.list);
    if (!grown) {
        status = STORE_NOMEM;
        goto out;
    }
    tokens.list = grown;
    make_secret(token, secret);
    token->created_ms = store_now_ms();
    tokens.list[tokens.n++] = *token;
    status = save(directory, &tokens);
out:
    store_tokens_clear(&tokens);
    if (fd >= 0) {
        close(fd);
    }
    return status;
}

int store_token_revoke(const char *directory, const char *id_or_name, size_t *removed)
{
    struct store_tokens tokens = {.list = NULL};
    size_t kept = 0;
    int fd = -1, status = lock(directory, &fd);

    *removed = 0;
    if (status == STORE_OK) {
        status = store_tokens_load(directory, &tokens);
    }
    for (size_t i = 0; status == STORE_OK && i < tokens.n; i++) {
        const struct store_token *token = &tokens.list[i];

        if (strcmp(token->id, id_or_name) != 0 && strcmp(token->name, id_or_name) != 0) {
            tokens.list[kept++] = *token;
        }
    }
    if (status == STORE_OK && kept < tokens.n) {
        *removed = tokens.n - kept;
        tokens.n = kept;
        status = save(directory, &tokens);
    }
    store_tokens_clear(&tokens);
    if (fd >= 0) {
        close(fd);
    }
    return status;
}
