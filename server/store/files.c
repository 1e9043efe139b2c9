/*
 * files.c - folders made, bytes written, and what errno means to the store.
 */
#include "store/files.h"

#include "ids.h"
#include "store_status.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int store_map_errno(int error)
{
    /* EFBIG comes from a limit on file sizes: for whoever waits, that is a full disk too. */
    return error == ENOSPC || error == EDQUOT || error == EFBIG ? STORE_FULL
           : error == ENOMEM                                    ? STORE_NOMEM
                                                                : STORE_IO;
}

int store_make_directory(const char *directory)
{
    char *path = strdup(directory);
    int status = STORE_OK;

    if (!path) {
        return STORE_NOMEM;
    }
    for (char *slash = path + 1; status == STORE_OK && *path; slash++) {
        char kept = *slash;

        if (kept != '/' && kept != '\0') {
            continue;
        }
        *slash = '\0';
        if (mkdir(path, 0700) != 0 && errno != EEXIST) {
            status = store_map_errno(errno);
        }
        *slash = kept;
        if (kept == '\0') {
            break;
        }
    }
    free(path);
    return status;
}

int store_open_folder(int at, const char *name)
{
    if (mkdirat(at, name, 0700) != 0 && errno != EEXIST) {
        return -1;
    }
    return openat(at, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

int store_write_bytes(int fd, const void *bytes, size_t size)
{
    const unsigned char *next = bytes;

    while (size > 0) {
        ssize_t n = write(fd, next, size);

        if (n < 0 && errno != EINTR) {
            return store_map_errno(errno);
        }
        if (n > 0) {
            next += n;
            size -= (size_t)n;
        }
    }
    return STORE_OK;
}

int store_write_all(int fd, const unsigned char *bytes, size_t size)
{
    int status = store_write_bytes(fd, bytes, size);

    if (status != STORE_OK) {
        return status;
    }
    return fsync(fd) == 0 ? STORE_OK : store_map_errno(errno);
}
