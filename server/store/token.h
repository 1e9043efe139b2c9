/*
 * token.h - the tokens of a data directory: who may call, in which role and within which quotas.
 *
 * They are in a file of their own, DIR/tokens, so that the command line can change them while a
 * daemon runs: the database has one writer, which is the daemon. The file is replaced as a whole
 * (a new file, fsync, rename, fsync of the folder) by whoever holds DIR/tokens.lock, and a reader
 * sees the one or the other. A daemon looks at its stamp at each request, so that a token that is
 * revoked is refused from the next request on.
 *
 * A token is "srnfd_" and 43 characters of base64url: 32 random bytes. Of it the file keeps only
 * the SHA-256. That is enough here: a slow hash protects secrets that can be guessed, and 256
 * random bits cannot.
 *
 * A token's name is the owner of what is made with it: several tokens may have one name, as when
 * one takes the place of another, or when a viewer is to read what a user makes.
 *
 * Where the file is, tokens are asked for, even when it has none left.
 */
#ifndef SRNFD_STORE_TOKEN_H
#define SRNFD_STORE_TOKEN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "ids.h"
#include "quota.h"
#include "store_status.h"

#define STORE_TOKENS_NAME "tokens" /* the file, in the data directory */

#define STORE_TOKEN_ID_MAX 24
#define STORE_SECRET_MAX 56 /* bytes of the longest secret with its zero */

enum store_role {
    STORE_ROLE_VIEWER,
    STORE_ROLE_USER,
    STORE_ROLE_ADMIN,
    STORE_ROLE_METRICS,
    STORE_ROLE_WORKER
};
#define STORE_ROLES 5
/* "viewer", "user", "admin", "metrics", "worker". */
const char *store_role_name(enum store_role role);
/* False: there is no such role. */
bool store_role_from_name(const char *name, enum store_role *role);

struct store_token {
    char id[STORE_TOKEN_ID_MAX]; /* tok- and 16 hex digits */
    char name[STORE_OWNER_MAX];  /* 1 to 64 letters, digits, dots, hyphens, underscores, @ */
    enum store_role role;
    char hash[65]; /* SHA-256 of the secret */
    int64_t created_ms;
    int64_t expires_ms;           /* 0: never */
    int64_t quotas[STORE_QUOTAS]; /* 0: no limit; -1: the service's default */
    int64_t last_ms;              /* last use; 0: none known. Set by store_tokens_uses alone */
};

/* The identity of the file: another one means that it was replaced. */
struct store_token_stamp {
    bool exists;
    dev_t device;
    ino_t inode;
    off_t size;
    int64_t modified_ns, changed_ns;
};

struct store_tokens {
    struct store_token_stamp stamp;
    struct store_token *list; /* malloc */
    uint64_t *keys;           /* [n] the first bits of the hashes, as loaded; malloc */
    size_t n;
};

/* STORE_OK also where there is no file. */
int store_token_look(const char *directory, struct store_token_stamp *stamp);
bool store_token_same(const struct store_token_stamp *a, const struct store_token_stamp *b);
/* Reads the file; one that is not there has no tokens. STORE_CORRUPT: not one of ours. On failure
   tokens is empty. */
int store_tokens_load(const char *directory, struct store_tokens *tokens);
void store_tokens_clear(struct store_tokens *tokens);
/* The token with this secret, expired or not; NULL: there is none. Takes the same time for every
   secret of the same length. */
const struct store_token *store_tokens_find(const struct store_tokens *tokens, const char *secret);
/* Fills last_ms from the database, as far as it can be read. */
void store_tokens_uses(const char *directory, struct store_tokens *tokens);

bool store_token_name_valid(const char *name);
/* 32 to STORE_SECRET_MAX - 1 letters, digits, hyphens and underscores. */
bool store_secret_valid(const char *secret);
/* Makes a token of token's name, role, expires_ms and quotas, adds it to the file (and the
   directory, where there is none) and sets id, hash and created_ms. secret: empty for a new one, or
   one that was chosen elsewhere (store_secret_valid). It is not kept. The files belong to the owner
   of the directory, also when root makes them. */
int store_token_add(const char *directory, struct store_token *token,
                    char secret[STORE_SECRET_MAX]);
/* Removes the token of that id, or all of that name; *removed counts them. */
int store_token_revoke(const char *directory, const char *id_or_name, size_t *removed);

#endif
