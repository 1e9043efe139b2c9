/*
 * zip.h - a zip that is written to a stream.
 */
#ifndef SRNFD_API_ZIP_H
#define SRNFD_API_ZIP_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

struct zip_writer {
    struct archive *archive;
    FILE *out;
    bool failed;
    /* Asked for room before more is written, in steps of 64 KiB; false: there is none, and the zip
       fails. NULL, as zip_open leaves it: there is. */
    bool (*take)(void *user, size_t bytes);
    void *user;
    size_t room; /* that was taken and is not used yet */
};

/* Begins; out is borrowed, and the writer stays where it is, until it is closed. deflate: whether
   what is added is compressed. */
bool zip_open(struct zip_writer *zip, FILE *out, bool deflate);
/* Adds a file. All files have one time, so that the same content is the same zip. */
void zip_add(struct zip_writer *zip, const char *path, const void *bytes, size_t size);
/* The text of a document (taken over) as a file of a zip: free; NULL without memory. */
char *zip_json(json_t *document);
/* Ends; false where anything has failed. */
bool zip_close(struct zip_writer *zip);

#endif
