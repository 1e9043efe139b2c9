/*
 * store_status.h - how functions of the store end. The layers above hand these codes up as they
 * are.
 */
#ifndef SRNFD_STORE_STATUS_H
#define SRNFD_STORE_STATUS_H

enum store_status {
    STORE_OK = 0,
    STORE_NOT_FOUND = -1,
    STORE_CONFLICT = -2, /* the row is not in the state that the write asks for */
    STORE_FULL = -3,     /* no space left on the device */
    STORE_IO = -4,       /* any other failure of the device */
    STORE_CORRUPT = -5,  /* not our database, damaged, or a blob that does not match its name */
    STORE_NEWER = -6,    /* written by a newer version */
    STORE_BUSY = -7,     /* another daemon holds the data directory */
    STORE_NOMEM = -8,
    STORE_CLOSED = -9,  /* the store is shutting down */
    STORE_QUOTA = -10,  /* the owner holds as many bytes as it may */
    STORE_QUEUED = -11, /* the owner has as many jobs waiting as it may */
};
/* A static sentence without a capital or a full stop. */
const char *store_strerror(int status);

#endif
