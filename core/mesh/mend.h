/*
 * mend.h - the steps of a repair on request: mend.c calls them in turn.
 *
 * Each step changes work->mesh, with work->origin for what is left of it, and notes what it did.
 * They return SRNF_OK, SRNF_ENOMEM or SRNF_ECANCELED.
 */
#ifndef SRNF_MESH_MEND_H
#define SRNF_MESH_MEND_H

#include "mesh_geometry.h"

/* In opposite[]: a corner whose edge has no second face, or more than two. */
#define MEND_BOUNDARY UINT32_MAX
#define MEND_CROWDED (UINT32_MAX - 1)

struct mend {
    const struct srnf_mesh *input;
    const struct srnf_mend_options *options;
    const struct srnf_context *context;
    struct srnf_mesh mesh;
    struct srnf_mesh_origin origin;
    bool *turned; /* of each face of the input: it goes the other way round now */
    bool judged;  /* one-sided patches were noted */
    struct srnf_mended *mended;
    size_t lossless; /* changes of mended that preparing would make as well */
};

static inline uint32_t mend_next(uint32_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/* ---- Notes (mend.c) -------------------------------------------------------------------------- */

/* A change, or a refusal where that is asked for, at a face or vertex of the input. */
struct srnf_mend_item *mend_note_face(struct mend *work, bool refused, const char *code,
                                      size_t count, uint32_t face);
struct srnf_mend_item *mend_note_vertex(struct mend *work, const char *code, size_t count,
                                        uint32_t vertex);
/* Keeps the faces with keep[f]. */
void mend_keep_faces(struct mend *work, const bool *keep);

/* ---- Steps ----------------------------------------------------------------------------------- */

SRNF_CHECKED int mend_merge(struct mend *work);      /* within the tolerance (mend_merge.c) */
SRNF_CHECKED int mend_degenerate(struct mend *work); /* mend_faces.c, and the three below */
SRNF_CHECKED int mend_duplicates(struct mend *work);
SRNF_CHECKED int mend_islands(struct mend *work);
SRNF_CHECKED int mend_orient(struct mend *work);
SRNF_CHECKED int mend_holes(struct mend *work); /* mend_holes.c */

/* The shortest way to close a loop of n points without vertices of its own (mend_fill.c):
   triangles[3 (n - 2)] of places in the loop. forbidden[n][n]: chords that are edges already.
   *filled is false where every way needs one of these. */
SRNF_CHECKED int mend_fill(const double (*points)[3], size_t n, const bool *forbidden,
                           const struct srnf_context *context, uint32_t *triangles, bool *filled);

#endif
