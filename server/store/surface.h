/*
 * surface.h - surfaces in the store, and the scalar maps on them.
 */
#ifndef SRNFD_STORE_SURFACE_H
#define SRNFD_STORE_SURFACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "ids.h"
#include "owner.h"
#include "store_status.h"

struct store;
struct store_page; /* store/page.h */

#define STORE_MAPS_MAX 8
#define STORE_MAP_NAME_MAX 32 /* bytes of the longest name with its zero */

/* Scalar maps on a Gauss-Legendre grid of the sphere. Names: letters, digits, underscores. */
struct store_maps {
    size_t count; /* 0: none */
    int64_t n_theta, n_phi;
    char names[STORE_MAPS_MAX][STORE_MAP_NAME_MAX];
    double *values; /* [count][n_theta][n_phi], malloc */
};
void store_maps_clear(struct store_maps *maps);
size_t store_maps_values(const struct store_maps *maps);

struct store_surface {
    char id[STORE_ID_MAX]; /* surf-..., of lmax, the coefficients and scale, place and maps */
    char *name;
    char *record; /* JSON text of everything else in the record, opaque here */
    char *tags;   /* JSON array; not set for put */
    int64_t lmax, created_ms;
    double *coefficients; /* [3][(lmax+1)^2], malloc; NULL where only the record was asked for */
    size_t coefficient_count;
    char hash[65];            /* of the coefficients alone, hexadecimal; set by get */
    struct store_maps maps;   /* to be put with it; store_surface_maps reads them */
    bool alone;               /* for put: the record names all that it was made of */
    struct store_owner owner; /* to be set for put; not set by get */
};

/* Canonical content: int64 lmax, the doubles of the coefficients (-0 as 0), the double scale,
   little-endian. */
void store_surface_id(char id[STORE_ID_MAX], int64_t lmax, const double *coefficients,
                      double scale);
/* What surfaces of the same coefficients share, whatever their size and place: no surface has it
   as its id. */
void store_shape_id(char id[STORE_ID_MAX], int64_t lmax, const double *coefficients);
/* The id of a surface in a place from the id of its content: the doubles of origin and rotation,
   and the mesh whose coordinates they are in ("": none's). */
void store_surface_id_place(char id[STORE_ID_MAX], const double origin[3], const double rotation[9],
                            const char *mesh);
/* The id of a surface with maps from the id that it has without. */
void store_surface_id_maps(char id[STORE_ID_MAX], const struct store_maps *maps);
/* As store_mesh_put, damaged content included (of the coefficients); coefficient_count must be 3
   (lmax + 1)^2. On return name, record and created_ms are what the store holds. */
int store_surface_put(struct store *store, struct store_surface *surface, bool *created);
int store_surface_get(struct store *store, const char *id, bool with_coefficients,
                      struct store_surface *surface);
/* The maps of a surface; STORE_NOT_FOUND: it has none. */
int store_surface_maps(struct store *store, const char *id, struct store_maps *maps);
/* As store_mesh_get_as: name, record and time are the owner's. */
int store_surface_get_as(struct store *store, const char *owner, const char *id,
                         bool with_coefficients, struct store_surface *surface);
void store_surface_clear(struct store_surface *surface);
/* Newest first: see store_page. */
int store_surface_list(struct store *store, const struct store_page *page,
                       bool (*visit)(void *user, const struct store_surface *surface), void *user);

#endif
