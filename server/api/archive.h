/*
 * archive.h - the files within a zip, tar or tar.gz, one after another, from memory into memory.
 */
#ifndef SRNFD_API_ARCHIVE_H
#define SRNFD_API_ARCHIVE_H

#include <stdbool.h>
#include <stddef.h>

#define ARCHIVE_ENTRIES_MAX ((size_t)400000)
#define ARCHIVE_PATH_MAX 1024 /* bytes with the zero */
#define ARCHIVE_PROBLEM_MAX 200

struct archive_reader;

/* What it may hold. */
struct archive_limits {
    size_t file;      /* bytes of one file, unpacked */
    size_t *left;     /* bytes that all entries may still have, unpacked; counted down */
    const char *only; /* files of other names, in whichever folder, are passed over; NULL: none */
};

enum archive_status {
    ARCHIVE_FILE,     /* a file is there */
    ARCHIVE_REFUSED,  /* an entry that is not taken, and why; the archive can be read on */
    ARCHIVE_PASSED,   /* one that is passed over; so with these three */
    ARCHIVE_AT_END,   /* there are no more */
    ARCHIVE_WRONG,    /* it cannot be read on: damaged, cut off, or of a kind not known here */
    ARCHIVE_TOO_MUCH, /* it holds more entries, or more in one, than the limits allow */
    ARCHIVE_GROWS,    /* all together unpack to more than the limits allow */
    ARCHIVE_NO_MEMORY,
    ARCHIVE_STOPPED, /* the upload was told to stop */
};

struct archive_file {
    char path[ARCHIVE_PATH_MAX]; /* with forward slashes; cut where it is too long */
    unsigned char *bytes;        /* srnf_free */
    size_t size;
    const char *code;                  /* where it is refused: a code of a refusal, static */
    char problem[ARCHIVE_PROBLEM_MAX]; /* and a sentence, also where the archive is refused */
};

/* Whether the bytes begin as an archive does that can be read here. */
bool archive_is_one(const void *bytes, size_t size);
/* The name of the kind of archive or compressed file that the bytes begin as, of those that are not
   read here; NULL where they begin as none. */
const char *archive_other(const void *bytes, size_t size);

/* Whether all of a zip fits the limits by what its directory says, of which nothing is unpacked:
   ARCHIVE_AT_END where it does, and for other archives, or why it cannot be read. */
enum archive_status archive_fits(const void *bytes, size_t size,
                                 const struct archive_limits *limits, struct archive_file *file);
/* Begins to read: bytes are borrowed until it is closed. NULL with a status and file->problem. */
struct archive_reader *archive_open(const void *bytes, size_t size,
                                    const struct archive_limits *limits,
                                    enum archive_status *status, struct archive_file *file);
/* Goes on to the next entry that is no folder. */
enum archive_status archive_next(struct archive_reader *reader, struct archive_file *file);
void archive_close(struct archive_reader *reader);

/* Whether a path stays where it is unpacked: relative, without "..", backslashes, colons after a
   drive's letter, and control characters, in UTF-8. NULL, or a sentence about what is wrong. */
const char *archive_path_problem(const char *path);

#endif
