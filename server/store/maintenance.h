/*
 * maintenance.h - looking after a data directory from outside the daemon that uses it: verifying
 * it (verify.c) and copying it (backup.c). Both read the database through a read-only connection
 * and need no daemon; one may run meanwhile.
 */
#ifndef SRNFD_STORE_MAINTENANCE_H
#define SRNFD_STORE_MAINTENANCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "store_status.h"

/* What is told while it is found: a kind ("damaged", "missing", "orphan", "database", ...) and a
   sentence. */
struct store_listener {
    void (*found)(void *user, const char *kind, const char *detail);
    void *user;
};

struct store_report {
    int64_t version;         /* of the schema */
    size_t blobs, bytes;     /* rows of blobs, and the size of their content */
    size_t damaged, missing; /* blobs whose content is not what it was; without content */
    size_t orphans;          /* files that no row names, among them what crashes have left */
    size_t removed;          /* of the orphans */
    size_t database_errors;  /* lines of integrity_check and foreign_key_check */
    bool in_use;             /* a daemon runs: what is just being written was passed over */
};

/*
 * Verifies that the database is intact and of a version known here, that every blob has the content
 * that its name says, and that no file is without a row.
 *   repair  [in] removes such files; only without a daemon (STORE_BUSY otherwise)
 * STORE_OK: there was nothing wrong, orphans apart. STORE_CORRUPT: the report says what. Any other
 * code: it could not be verified, message has a sentence. The time is that of reading all blobs.
 */
int store_verify(const char *directory, bool repair, const struct store_listener *listener,
                 struct store_report *report, char *message, size_t message_size);

/*
 * Copies a data directory as it is at one moment, while the daemon may be running, to a directory
 * that does not exist or is empty. What it copies it verifies. The database file appears there
 * last, under its name: a backup without one is not complete. To restore: put it in the place of
 * the data directory. link  [in] blobs become hard links rather than copies, on the same file
 * system STORE_CORRUPT: a blob is damaged, which the listener tells; the backup then has all
 * others.
 */
int store_backup(const char *directory, const char *destination, bool link,
                 const struct store_listener *listener, struct store_report *report, char *message,
                 size_t message_size);

#endif
