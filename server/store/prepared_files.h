/*
 * prepared_files.h - what prepared.c and prepared_files.c share.
 */
#ifndef SRNFD_STORE_PREPARED_FILES_H
#define SRNFD_STORE_PREPARED_FILES_H

#include "store/internal.h"

#define PREPARED_FOLDER "prepared"
#define PREPARED_TEMPORARY "tmp"
#define PREPARED_PAIRS "pairs"
#define PREPARED_PATH 300     /* bytes of a path below DIR/prepared; also of any name there */
#define PREPARED_ID_LENGTH 37 /* of mesh-.. */

/* Whether a text begins with the id of a mesh. */
bool prepared_is_id(const char *text);
/* What a file of this size counts for. */
int64_t prepared_taken(int64_t size);
/* Reads a file that is what it was: malloc, the digest before the value. STORE_CORRUPT: it is
   not. */
int prepared_read(int fd, const char *name, unsigned char **bytes, size_t *size);
/* Whether the store has all meshes that the name of a file tells; true where that is not known. */
bool prepared_has_meshes(sqlite3 *db, const char *name);

typedef void prepared_visit(void *user, int folder_fd, const char *folder, const char *name);

/* Visits the files of a folder that have their names. */
void prepared_walk_folder(int at, const char *folder, prepared_visit *visit, void *user);
/* Looks at all files; where they take more than the limit the oldest go, down to nine tenths. */
void prepared_evict(struct store *store);
/* Whether a file that takes so many bytes leaves free what is to be. */
bool prepared_fits(struct store *store, int64_t taken);
/* Removes a file and takes it off the total. */
bool prepared_remove(struct store *store, int folder_fd, const char *name);

#endif
