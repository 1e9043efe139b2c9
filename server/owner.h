/*
 * owner.h - for whom something is stored, and who asks. An owner is the name of a token; "" is the
 * one owner of a service without tokens.
 */
#ifndef SRNFD_OWNER_H
#define SRNFD_OWNER_H

#include <stdbool.h>
#include <stdint.h>

/* For whom something is stored. */
struct store_owner {
    const char *name;  /* borrowed; NULL: "" */
    int64_t bytes_max; /* that the owner may hold with it, otherwise STORE_QUOTA; 0: no limit;
                          STORE_BYTES_KEPT: as was said the last time */
};
#define STORE_BYTES_KEPT INT64_C(-1)

/* Who asks: what belongs to the owner is seen, with `all` what belongs to anyone. */
struct store_view {
    const char *owner; /* NULL: "" */
    bool all;
};

#endif
