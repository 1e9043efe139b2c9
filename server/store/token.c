/*
 * token.c - the file of tokens (token.h has the design).
 *
 *   srnfd-tokens 1
 *   id <tab> name <tab> role <tab> hash <tab> created <tab> expires <tab> five quotas ...
 *
 * One line for each token; times in milliseconds since the epoch, quotas as in struct store_token.
 * A line that is not exactly this makes the file unreadable as a whole: a daemon then refuses
 * everyone, rather than to guess who may call.
 *
 * Calls are independent of each other and of any struct store; writers of several processes take
 * turns by flock on DIR/tokens.lock.
 */
#include "store/token.h"

#include "store/digest.h"
#include "store/internal.h"
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

#define HEADER "srnfd-tokens 1\n"
#define FIELDS (6 + STORE_QUOTAS)
#define FILE_MAX ((off_t)16 << 20)
#define PATH_SIZE 4096
#define LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"
#define SECRET_PREFIX "srnfd_"
#define SECRET_BYTES 32
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

/* ---- Reading --------------------------------------------------------------------------------- */

static int make_path(char path[PATH_SIZE], const char *directory, const char *name)
{
    int n = snprintf(path, PATH_SIZE, "%s/%s", directory, name);

    return n > 0 && n < PATH_SIZE ? STORE_OK : STORE_IO;
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
    char path[PATH_SIZE];
    struct stat info;
    int status = make_path(path, directory, STORE_TOKENS_NAME);

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
    char path[PATH_SIZE], *text = NULL;
    struct stat info;
    int fd = -1, status = make_path(path, directory, STORE_TOKENS_NAME);

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
        status = strncmp(text, HEADER, sizeof HEADER - 1) == 0
                     ? read_lines(text + sizeof HEADER - 1, tokens)
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

void store_tokens_uses(const char *directory, struct store_tokens *tokens)
{
    char path[PATH_SIZE];
    sqlite3_stmt *rows = NULL;
    sqlite3 *db = NULL;
    int status = make_path(path, directory, STORE_DATABASE_NAME);

    if (status == STORE_OK && access(path, R_OK) == 0) {
        status = store_connect_reader(path, &db);
    }
    if (!db) {
        return;
    }
    status = store_prepare(db, &rows, "SELECT token, last_ms FROM token_use", "");
    while (status == STORE_OK && (status = store_step(db, rows)) == STORE_OK) {
        char id[STORE_TOKEN_ID_MAX];

        store_column_id(rows, 0, id, sizeof id);
        for (size_t i = 0; i < tokens->n; i++) {
            if (strcmp(tokens->list[i].id, id) == 0) {
                tokens->list[i].last_ms = sqlite3_column_int64(rows, 1);
            }
        }
    }
    sqlite3_finalize(rows);
    sqlite3_close(db);
}

/* ---- Writing --------------------------------------------------------------------------------- */

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
    char path[PATH_SIZE];
    int status = make_path(path, directory, STORE_TOKENS_NAME ".lock");

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
    (void)fputs(HEADER, out);
    for (size_t i = 0; i < tokens->n; i++) {
        const struct store_token *token = &tokens->list[i];

        (void)fprintf(out, "%s\t%s\t%s\t%s\t%" PRId64 "\t%" PRId64, token->id, token->name,
                      roles[token->role], token->hash, token->created_ms, token->expires_ms);
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
    size_t done = 0;
    int fd, status;

    (void)unlink(path);
    fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    status = fd >= 0 ? give_to_owner(directory, fd) : store_map_errno(errno);

    while (status == STORE_OK && done < size) {
        ssize_t n = write(fd, text + done, size - done);

        if (n < 0 && errno != EINTR) {
            status = store_map_errno(errno);
        }
        done += n > 0 ? (size_t)n : 0;
    }
    if (status == STORE_OK && fsync(fd) != 0) {
        status = store_map_errno(errno);
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
    char path[PATH_SIZE], temporary[PATH_SIZE];
    size_t size = 0;
    char *text = make_text(tokens, &size);
    int status = text ? make_path(path, directory, STORE_TOKENS_NAME) : STORE_NOMEM;

    if (status == STORE_OK) {
        status = make_path(temporary, directory, STORE_TOKENS_NAME ".new");
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
