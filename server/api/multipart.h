/*
 * multipart.h - the parts of a multipart/form-data body (RFC 7578), as slices of it.
 */
#ifndef SRNFD_API_MULTIPART_H
#define SRNFD_API_MULTIPART_H

#include <stdbool.h>
#include <stddef.h>

#define MULTIPART_TEXT_MAX 1024 /* bytes of a name or file name, with its zero */

struct multipart {
    const unsigned char *at, *end;
    char delimiter[80]; /* CRLF, two hyphens and the boundary */
};

struct multipart_part {
    char name[128];
    char file[MULTIPART_TEXT_MAX]; /* "" where the part is a field */
    char type[96];                 /* its media type without parameters, or "" */
    const unsigned char *bytes;
    size_t size;
};

enum multipart_status {
    MULTIPART_PART,
    MULTIPART_END,
    MULTIPART_WRONG, /* not what a form is sent as, or cut off */
};

/* Begins with a body; type is its Content-Type. False where that names no usable boundary. */
bool multipart_open(struct multipart *form, const char *type, const void *body, size_t size);
/* The next part; problem gets a sentence where it is MULTIPART_WRONG. */
enum multipart_status multipart_next(struct multipart *form, struct multipart_part *part,
                                     char problem[160]);

#endif
