/*
 * files.h - the few lines around the file system that several files of store/ need.
 */
#ifndef SRNFD_STORE_FILES_H
#define SRNFD_STORE_FILES_H

#include <stddef.h>

/* STORE_FULL where errno says that there is no room, otherwise STORE_IO. */
int store_map_errno(int error);
/* Makes the directory, with its parents, and leaves it open only to its owner. */
int store_make_directory(const char *directory);
/* Opens the folder, making it if it is not there; -1 with errno. */
int store_open_folder(int at, const char *name);
int store_write_bytes(int fd, const void *bytes, size_t size);
/* Writes all bytes and syncs them. */
int store_write_all(int fd, const unsigned char *bytes, size_t size);

#endif
