/*
 * sides.h - the side of the body that a name, label or subject tells of: "L_hippocampus",
 * "Right-Thalamus", "lh.pial".
 */
#ifndef SRNFD_TOOLKIT_SIDES_H
#define SRNFD_TOOLKIT_SIDES_H

#include <stdbool.h>

#define SIDES_TEXT_MAX 200
#define SIDES_REST_MAX (2 * SIDES_TEXT_MAX) /* a space after each letter still fits */

enum side { SIDE_LEFT = -1, SIDE_NONE = 0, SIDE_RIGHT = 1 };

struct side_reading {
    enum side side;
    char rest[SIDES_REST_MAX]; /* the other words in small letters, between spaces; "" without side
                                */
};

/* text may be NULL, and has any bytes. No side where the words name both, or none, or the text is
   longer than SIDES_TEXT_MAX bytes. */
struct side_reading side_read(const char *text);

/* Whether the two tell of the left and the right one of the same: both name a side, not the same
   one, and agree otherwise. */
bool sides_opposite(const struct side_reading *a, const struct side_reading *b);

#endif
