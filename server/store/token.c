/*
 * token.c - the file of tokens, read (token.h has the design; token_write.c writes it).
 *
 *   srnfd-tokens 1
 *   id <tab> name <tab> role <tab> hash <tab> created <tab> expires <tab> five quotas ...
 *
 * One line for each token; times in milliseconds since the epoch, quotas as in struct store_token.
 * A line that is not exactly this makes the file unreadable as a whole: a daemon then refuses
 * everyone, rather than to guess who may call.
 *
 * Calls are independent of each other and of any struct store.
 */
#include "store/token_file.h"

#include "store/digest.h"
#include "store/files.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define FIELDS (6 + STORE_QUOTAS)
#define FILE_MAX ((off_t)16 << 20)
#define LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"
#define SECRET_LEAST 32 /* characters of one that was chosen elsewhere */

static const char *const roles[STORE_ROLES] = {"viewer", "user", "admin", "metrics", "worker"};

const char *store_role_name(enum store_role role)
{
    return roles[role];
}

bool store_role_from_name(const char *name, enum store_role *role)
{
    for (int i = 0; i < STORE_ROLES; i++) {
        if (strcmp(roles[i], name) == 0) {
            *role = (enum store_role)i;
            return true;
        }
    }
    return false;
}

bool store_token_name_valid(const char *name)
{
    size_t length = strlen(name);

    return length > 0 && length < STORE_OWNER_MAX && strspn(name, LETTERS "._@-") == length;
}

bool store_secret_valid(const char *secret)
{
    size_t length = strlen(secret);

    return length >= SECRET_LEAST && length < STORE_SECRET_MAX &&
           strspn(secret, LETTERS "_-") == length;
}

int store_token_path(char path[STORE_TOKEN_PATH], const char *directory, const char *name)
{
    size_t length = strlen(directory), name_size = strlen(name) + 1;

    /* No printf(3): each request asks for the file of tokens. */
    if (length + 1 + name_size > STORE_TOKEN_PATH) {
        path[0] = '\0';
        return STORE_IO;
    }
    memcpy(path, directory, length);
    path[length] = '/';
    memcpy(path + length + 1, name, name_size);
    return STORE_OK;
}

static void set_stamp(struct store_token_stamp *stamp, const struct stat *info)
{
    *stamp = (struct store_token_stamp){
        .exists = true,
        .device = info->st_dev,
        .inode = info->st_ino,
        .size = info->st_size,
        .modified_ns = (int64_t)info->st_mtim.tv_sec * 1000000000 + info->st_mtim.tv_nsec,
        .changed_ns = (int64_t)info->st_ctim.tv_sec * 1000000000 + info->st_ctim.tv_nsec,
    };
}

int store_token_look(const char *directory, struct store_token_stamp *stamp)
{
    char path[STORE_TOKEN_PATH];
    struct stat info;
    int status = store_token_path(path, directory, STORE_TOKENS_NAME);

    *stamp = (struct store_token_stamp){.exists = false};
    if (status != STORE_OK) {
        return status;
    }
    if (stat(path, &info) != 0) {
        return errno == ENOENT ? STORE_OK : store_map_errno(errno);
    }
    set_stamp(stamp, &info);
    return STORE_OK;
}

bool store_token_same(const struct store_token_stamp *a, const struct store_token_stamp *b)
{
    return a->exists == b->exists && a->device == b->device && a->inode == b->inode &&
           a->size == b->size && a->modified_ns == b->modified_ns && a->changed_ns == b->changed_ns;
}

/* A whole number from least to STORE_QUOTA_LARGEST that fills its field. */
static bool read_number(const char *text, int64_t least, int64_t *number)
{
    char *end;
    long long value;

    errno = 0;
    value = strtoll(text, &end, 10);
    *number = value;
    return end != text && !*end && errno == 0 && value >= least && value <= STORE_QUOTA_LARGEST;
}

/* Cuts the line at its tabs; true where it has exactly so many fields. */
static bool cut(char *line, char *fields[FIELDS])
{
    for (size_t i = 0; i < FIELDS; i++) {
        char *tab = strchr(line, '\t');

        fields[i] = line;
        if ((tab == NULL) != (i == FIELDS - 1)) {
            return false;
        }
        if (tab) {
            *tab = '\0';
            line = tab + 1;
        }
    }
    return true;
}

static bool read_line(char *line, struct store_token *token)
{
    char *fields[FIELDS];

    *token = (struct store_token){.id = ""};
    if (!cut(line, fields) || strlen(fields[0]) >= sizeof token->id ||
        !store_token_name_valid(fields[1]) || !store_role_from_name(fields[2], &token->role) ||
        strlen(fields[3]) != 64 || strspn(fields[3], "0123456789abcdef") != 64 ||
        !read_number(fields[4], 0, &token->created_ms) ||
        !read_number(fields[5], 0, &token->expires_ms)) {
        return false;
    }
    for (size_t i = 0; i < STORE_QUOTAS; i++) {
        if (!read_number(fields[6 + i], -1, &token->quotas[i])) {
            return false;
        }
    }
    memcpy(token->id, fields[0], strlen(fields[0]));
    memcpy(token->name, fields[1], strlen(fields[1]));
    memcpy(token->hash, fields[3], sizeof token->hash);
    return true;
}

/* 64 bits of a hash: no two of a file's are alike in those. */
static uint64_t key_of(const char *hash)
{
    unsigned char bytes[8] = {0};
    uint64_t key;

    (void)sodium_hex2bin(bytes, sizeof bytes, hash, 2 * sizeof bytes, NULL, NULL, NULL);
    memcpy(&key, bytes, sizeof key);
    return key;
}

/* The lines after the header; text is cut up. */
static int read_lines(char *text, struct store_tokens *tokens)
{
    size_t capacity = 0;

    for (const char *at = text; (at = strchr(at, '\n')) != NULL; at++) {
        capacity++;
    }
    tokens->list = calloc(capacity + 1, sizeof *tokens->list);
    tokens->keys = calloc(capacity + 1, sizeof *tokens->keys);
    if (!tokens->list || !tokens->keys) {
        return STORE_NOMEM;
    }
    for (char *end; *text; text = end + 1) {
        end = strchr(text, '\n');
        if (!end) {
            return STORE_CORRUPT;
        }
        *end = '\0';
        if (!read_line(text, &tokens->list[tokens->n])) {
            return STORE_CORRUPT;
        }
        tokens->keys[tokens->n] = key_of(tokens->list[tokens->n].hash);
        tokens->n++;
    }
    return STORE_OK;
}

/* The file's bytes, with a zero after them (malloc). */
static int read_text(int fd, off_t size, char **text)
{
    size_t done = 0, wanted = (size_t)size;

    *text = size <= FILE_MAX ? malloc(wanted + 1) : NULL;
    if (!*text) {
        return size <= FILE_MAX ? STORE_NOMEM : STORE_CORRUPT;
    }
    while (done < wanted) {
        ssize_t n = read(fd, *text + done, wanted - done);

        if (n == 0 || (n < 0 && errno != EINTR)) {
            return STORE_IO;
        }
        done += n > 0 ? (size_t)n : 0;
    }
    (*text)[wanted] = '\0';
    return strlen(*text) == wanted ? STORE_OK : STORE_CORRUPT;
}

int store_tokens_load(const char *directory, struct store_tokens *tokens)
{
    char path[STORE_TOKEN_PATH], *text = NULL;
    struct stat info;
    int fd = -1, status = store_token_path(path, directory, STORE_TOKENS_NAME);

    *tokens = (struct store_tokens){.list = NULL};
    if (status != STORE_OK) {
        return status;
    }
    /* Not blocked by a pipe that somebody put there. */
    fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) {
        return errno == ENOENT ? STORE_OK : store_map_errno(errno);
    }
    status = fstat(fd, &info) == 0 ? STORE_OK : store_map_errno(errno);
    if (status == STORE_OK) {
        status = S_ISREG(info.st_mode) ? read_text(fd, info.st_size, &text) : STORE_CORRUPT;
    }
    if (status == STORE_OK) {
        set_stamp(&tokens->stamp, &info);
        status = strncmp(text, STORE_TOKENS_HEADER, sizeof STORE_TOKENS_HEADER - 1) == 0
                     ? read_lines(text + sizeof STORE_TOKENS_HEADER - 1, tokens)
                     : STORE_CORRUPT;
    }
    close(fd);
    free(text);
    if (status != STORE_OK) {
        store_tokens_clear(tokens);
    }
    return status;
}

void store_tokens_clear(struct store_tokens *tokens)
{
    free(tokens->list);
    free(tokens->keys);
    *tokens = (struct store_tokens){.list = NULL};
}

const struct store_token *store_tokens_find(const struct store_tokens *tokens, const char *secret)
{
    size_t found = tokens->n;
    char hash[65];
    uint64_t key;

    store_sha256_hex(hash, secret, strlen(secret));
    key = key_of(hash);
    for (size_t i = 0; i < tokens->n; i++) { /* all, and without a branch */
        found = tokens->keys[i] == key ? i : found;
    }
    return found < tokens->n && sodium_memcmp(tokens->list[found].hash, hash, 64) == 0
               ? &tokens->list[found]
               : NULL;
}
