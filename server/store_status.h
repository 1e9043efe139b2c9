/*
 * store_status.h - how functions of the store end. The layers above hand these codes up as they
 * are, in ints that may hold a status of the core (srnf/base.h) or of the jobs (jobs/jobs.h) as
 * well: no value means two things.
 */
#ifndef SRNFD_STORE_STATUS_H
#define SRNFD_STORE_STATUS_H

enum store_status {
    STORE_OK = 0,
    STORE_NOT_FOUND = -201,
    STORE_CONFLICT = -202, /* the row is not in the state that the write asks for */
    STORE_FULL = -203,     /* no space left on the device */
    STORE_IO = -204,       /* any other failure of the device */
    STORE_CORRUPT = -205,  /* not our database, damaged, or a blob that does not match its name */
    STORE_NEWER = -206,    /* written by a newer version */
    STORE_BUSY = -207,     /* another daemon holds the data directory */
    STORE_NOMEM = -208,
    STORE_CLOSED = -209, /* the store is shutting down */
    STORE_QUOTA = -210,  /* the owner holds as many bytes as it may */
    STORE_QUEUED = -211, /* the owner has as many jobs waiting as it may */
};
/* A static sentence without a capital or a full stop. */
const char *store_strerror(int status);

#endif
