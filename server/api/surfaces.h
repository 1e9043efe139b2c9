/*
 * surfaces.h - surfaces in the api layer: what a record says, and how a surface that was made comes
 * into the store.
 */
#ifndef SRNFD_API_SURFACES_H
#define SRNFD_API_SURFACES_H

#include "api/handler.h"

struct store_maps;    /* store/surface.h */
struct store_surface; /* store/surface.h */
struct store_owner;   /* owner.h */

/* The degree of a surface where none is asked for. */
#define SURFACE_DEGREE_DEFAULT 31
/* Numbers in one JSON answer; larger fields are asked for as .npy. */
#define SURFACE_JSON_NUMBERS_MAX ((size_t)300000)
/* Rows of a grid that can be asked for or sent. */
#define SURFACE_ROWS_MAX 512
/* Edge divisions of the icosahedron in /mesh, and the limit on vertices times harmonics. */
#define SURFACE_RESOLUTION_DEFAULT 32
#define SURFACE_RESOLUTION_MAX 100
#define SURFACE_MESH_WORK_MAX 3e8

/* A surface to be kept. source, fit, star, warnings, frame, origin and rotation may be NULL; the
   JSON values are taken over. */
struct surface_description {
    const char *name;
    size_t degree;
    const double *coefficients; /* [3][(degree+1)^2] */
    double scale;
    const struct srnf_surface_measures *measures;
    /* "star", "area", "given", or "inherited" from what it was made of. */
    const char *parameterization;
    const char *route; /* "star", "area" or "given"; NULL: not known (toolkit/routes.h) */
    json_t *source, *fit, *star;
    json_t *warnings;        /* an array, taken over; NULL: the record has none */
    const double *smoothing; /* of surfaces that encode made; NULL: the record has none */
    /* Where it was: x = scale R' f + origin in the frame of the input, with R the rotation (rows;
       NULL: none). NULL: it never was anywhere. */
    const double *origin, *rotation;
    json_t *frame;                 /* of origin: surface_frame_json, taken over; or NULL */
    const char *frame_mesh;        /* mesh of surface_place; "" or NULL: none, or not known */
    bool mirrored;                 /* the mirror image of what was uploaded */
    const struct store_maps *maps; /* scalar maps on it, or NULL; borrowed */
    bool of_mesh_alone;            /* the source's mesh is all that it was made of */
};

/*
 * Stores the surface for its owner unless the owner has it, and gives the full record of what the
 * store holds: the owner's first description of a surface stays. Where a source is given, which a
 * job does, the record given is the description's own all the same, but for the time.
 *   record  [out] new reference; NULL on failure
 *   created [out] optional
 * Returns an enum store_status.
 */
int surface_save(struct store *store, const struct store_owner *owner,
                 struct surface_description *description, json_t **record, bool *created);

/* Whose coordinates a surface is in where it is shown in its place, {"of", "detail"}: of, an id,
   and a sentence. New reference. */
json_t *surface_frame_json(const char *of, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* The sentence of a stored surface in detail[size], "" where it has none. */
void surface_record_frame(const struct store_surface *surface, char *detail, size_t size);

/* A number or string member of a stored surface's record; fallback where it has none. */
double surface_record_number(const struct store_surface *surface, const char *name,
                             double fallback);
/* Where a surface was before it was centred, scaled and turned: x = scale R' f + origin. */
struct surface_place {
    bool known;           /* otherwise origin is 0, rotation the identity */
    bool told, reflected; /* whether it lies where the mirror image of that does, if that is told */
    double scale, origin[3], rotation[9];
    double centroid[3]; /* of f: 0 but for rounding where it was centred; 0 where none is told */
    char mesh[STORE_ID_MAX]; /* whose coordinates x is in, through whatever surfaces; "": none's */
};
/* As the record of a stored surface has it. */
struct surface_place surface_record_place(const struct store_surface *surface);
/*
 * The id of a surface from its content, its maps and the place in its record. older: without the
 * place, as ids were before it was a part of them. Surfaces that were stored or exported then keep
 * their ids, so whoever checks an id tries both. Without a known place both are the same.
 *   surface [in] with lmax, coefficients, maps and record
 */
void surface_record_id(const struct store_surface *surface, bool older, char id[STORE_ID_MAX]);
/* Whether the record of a stored surface says that it is a mirror image. */
bool surface_record_mirrored(const struct store_surface *surface);

/* What a map of this name is: its unit, and a sentence. Both stay as they are where it is not
   known. */
void surface_map_meaning(const char *name, const char **unit, const char **meaning);

/* Members of records and results. */
json_t *surface_fit_json(const struct srnf_fit *fit);
json_t *surface_star_json(const struct srnf_star *star);
json_t *surface_distortion_json(const struct srnf_distortion *distortion);

#endif
