/*
 * mend_faces.c - drops degenerate and duplicate faces and islands, and turns faces.
 */
#include "mend.h"

#include <stdio.h>
#include <string.h>

static bool is_degenerate(const struct srnf_mesh *mesh, size_t face)
{
    const uint32_t *v = mesh->faces + 3 * face;

    return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

int mend_degenerate(struct mend *work)
{
    size_t n = work->mesh.n_faces, dropped = 0;
    bool *keep = srnf_alloc(n, sizeof *keep);
    uint32_t first = 0;

    if (!keep) {
        return SRNF_ENOMEM;
    }
    for (size_t f = 0; f < n; f++) {
        keep[f] = !is_degenerate(&work->mesh, f);
        if (!keep[f] && dropped++ == 0) {
            first = work->origin.faces[f];
        }
    }
    if (dropped > 0) {
        mend_keep_faces(work, keep);
        (void)mend_note_face(work, false, "degenerate-faces-dropped", dropped, first);
    }
    srnf_free(keep);
    return srnf_is_canceled(work->context) ? SRNF_ECANCELED : SRNF_OK;
}

int mend_duplicates(struct mend *work)
{
    size_t n = work->mesh.n_faces, first = 0;
    uint32_t *before = srnf_alloc(n, sizeof *before);
    struct srnf_mesh_repairs repairs = {.duplicate_faces_dropped = 0};
    int status;

    if (!before) {
        return SRNF_ENOMEM;
    }
    if (n > 0) {
        memcpy(before, work->origin.faces, n * sizeof *before);
    }
    status = srnf_repair_drop_faces(&work->mesh, &work->origin, work->context, &repairs);
    if (status == SRNF_OK && work->mesh.n_faces < n) {
        while (first < work->mesh.n_faces && work->origin.faces[first] == before[first]) {
            first++;
        }
        (void)mend_note_face(work, false, "duplicate-faces-dropped", n - work->mesh.n_faces,
                             before[first]);
    }
    srnf_free(before);
    return status;
}

/* ---- Islands --------------------------------------------------------------------------------- */

/* The root of a set of corners; halves the path for the next time. */
static uint32_t find(uint32_t *link, uint32_t x)
{
    while (link[x] != x) {
        link[x] = link[link[x]];
        x = link[x];
    }
    return x;
}

static void join(uint32_t *link, uint32_t a, uint32_t b)
{
    a = find(link, a);
    b = find(link, b);
    if (a < b) {
        link[b] = a;
    } else {
        link[a] = b;
    }
}

static double face_area(const struct srnf_mesh *mesh, size_t face)
{
    const double *a = mesh_corner(mesh, face, 0);
    double u[3], v[3], n[3];

    vector_subtract(mesh_corner(mesh, face, 1), a, u);
    vector_subtract(mesh_corner(mesh, face, 2), a, v);
    vector_cross(u, v, n);
    return vector_norm(n) / 2.0;
}

/* Drops the faces of all components but that of `best`, the lowest face of one. */
static void drop_others(struct mend *work, uint32_t *link, uint32_t best, bool *keep)
{
    const struct srnf_mesh *mesh = &work->mesh;
    size_t islands = 0, first = SIZE_MAX;
    uint32_t face;

    for (size_t f = 0; f < mesh->n_faces; f++) {
        uint32_t root = find(link, (uint32_t)(3 * f)) / 3;

        keep[f] = root == best;
        islands += root == f && !keep[f];
        first = keep[f] || first != SIZE_MAX ? first : f;
    }
    if (islands > 0) {
        face = work->origin.faces[first];
        mend_keep_faces(work, keep);
        (void)mend_note_face(work, false, "islands-removed", islands, face);
    }
}

/* Components are those of faces that share an edge; solids that touch in a point are two. */
int mend_islands(struct mend *work)
{
    const struct srnf_mesh *mesh = &work->mesh;
    size_t corners = 3 * mesh->n_faces;
    uint32_t *fans = srnf_alloc(corners, sizeof *fans);
    uint32_t *link = srnf_alloc(corners, sizeof *link), best = 0;
    double *area = srnf_alloc(mesh->n_faces, sizeof *area);
    bool *keep = srnf_alloc(mesh->n_faces, sizeof *keep);
    int status = !fans || !link || !area || !keep ? SRNF_ENOMEM
                                                  : srnf_topology_fans(mesh, work->context, fans);

    if (status != SRNF_OK || corners == 0) {
        goto out;
    }
    for (size_t c = 0; c < corners; c++) {
        link[c] = (uint32_t)c;
    }
    for (size_t c = 0; c < corners && !srnf_asks(work->context, c); c++) {
        join(link, (uint32_t)c, (uint32_t)(c - c % 3));
        join(link, (uint32_t)c, fans[c]);
    }
    for (size_t f = 0; f < mesh->n_faces && !srnf_asks(work->context, f); f++) {
        area[find(link, (uint32_t)(3 * f)) / 3] += face_area(mesh, f);
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        best = area[f] > area[best] ? (uint32_t)f : best;
    }
    best = find(link, 3 * best) / 3;
    status = srnf_is_canceled(work->context) ? SRNF_ECANCELED : SRNF_OK;
    if (status == SRNF_OK) {
        drop_others(work, link, best, keep);
    }
out:
    srnf_free(keep);
    srnf_free(area);
    srnf_free(link);
    srnf_free(fans);
    return status;
}

/* ---- Orientation ----------------------------------------------------------------------------- */

enum { UNSEEN, AS_IT_IS, TURNED };

/* One component over edges of two faces. */
struct patch {
    size_t begin, end; /* its faces in queue */
    bool closed, two_sided;
};

/* Goes over a component from queue[begin] on and says of each face whether it has to be turned to
   agree with that one. */
static void spread(const struct mend *work, const uint32_t *opposite, uint8_t *state,
                   uint32_t *queue, struct patch *patch)
{
    const uint32_t *faces = work->mesh.faces;

    for (size_t i = patch->begin; i < patch->end && !srnf_asks(work->context, i); i++) {
        for (uint32_t c = 3 * queue[i]; c < 3 * queue[i] + 3; c++) {
            uint8_t own = state[queue[i]], wanted;
            uint32_t other = opposite[c];

            if (other == MEND_BOUNDARY || other == MEND_CROWDED) {
                patch->closed = false;
                continue;
            }
            wanted = faces[c] == faces[other] ? (own == TURNED ? AS_IT_IS : TURNED) : own;
            if (state[other / 3] == UNSEEN) {
                state[other / 3] = wanted;
                queue[patch->end++] = other / 3;
            } else if (state[other / 3] != wanted) {
                patch->two_sided = false;
            }
        }
    }
}

/* Whether the others are the ones to turn: where the patch is closed, those that make it look
   outwards, and else the smaller area. */
static bool is_inverted(const struct mend *work, const uint8_t *state, const uint32_t *queue,
                        const struct patch *patch)
{
    const struct srnf_mesh *mesh = &work->mesh;
    const double *base = mesh_corner(mesh, queue[patch->begin], 0);
    double volume = 0.0, area[3] = {0.0, 0.0, 0.0};

    for (size_t i = patch->begin; i < patch->end && !srnf_asks(work->context, i); i++) {
        double p[3][3], cross[3], own;

        for (size_t k = 0; k < 3; k++) {
            vector_subtract(mesh_corner(mesh, queue[i], k), base, p[k]);
        }
        vector_cross(p[1], p[2], cross);
        own = vector_dot(p[0], cross);
        volume += state[queue[i]] == TURNED ? -own : own;
        area[state[queue[i]]] += face_area(mesh, queue[i]);
    }
    return patch->closed ? volume < 0.0 : area[TURNED] > area[AS_IT_IS];
}

static void turn(struct mend *work, uint32_t face)
{
    uint32_t *v = work->mesh.faces + 3 * (size_t)face, second = v[1];
    uint32_t origin = work->origin.faces[face];

    v[1] = v[2];
    v[2] = second;
    if (origin < work->input->n_faces) {
        work->turned[origin] = !work->turned[origin];
    }
}

/* Judges all patches by the mesh as it is, and only then turns: opposite[] is of that mesh. */
static void orient_patches(struct mend *work, const uint32_t *opposite, uint8_t *state,
                           uint32_t *queue)
{
    size_t n = work->mesh.n_faces, end = 0, one_sided = 0;
    uint32_t first = 0;

    for (size_t f = 0; f < n && !srnf_asks(work->context, f); f++) {
        struct patch patch = {end, end + 1, true, true};
        bool inverted;

        if (state[f] != UNSEEN) {
            continue;
        }
        state[f] = AS_IT_IS;
        queue[end] = (uint32_t)f;
        spread(work, opposite, state, queue, &patch);
        end = patch.end;
        inverted = patch.two_sided && is_inverted(work, state, queue, &patch);
        if (!patch.two_sided && one_sided++ == 0) {
            first = work->origin.faces[f];
        }
        for (size_t i = patch.begin; i < patch.end; i++) {
            uint8_t *own = &state[queue[i]];

            *own = !patch.two_sided ? AS_IT_IS
                   : !inverted      ? *own
                   : *own == TURNED ? AS_IT_IS
                                    : TURNED;
        }
    }
    for (size_t f = 0; f < n; f++) {
        if (state[f] == TURNED) {
            turn(work, (uint32_t)f);
        }
    }
    if (one_sided > 0 && first < work->input->n_faces && !work->judged) {
        struct srnf_mend_item *item = mend_note_face(work, true, "one-sided", one_sided, first);

        (void)snprintf(item->detail, sizeof item->detail,
                       "the surface of face %u is one-sided: no way of turning faces makes them "
                       "agree; remove what joins its two sides",
                       first);
    }
}

int mend_orient(struct mend *work)
{
    size_t n = work->mesh.n_faces;
    uint32_t *opposite = srnf_alloc(3 * n, sizeof *opposite);
    uint32_t *queue = srnf_alloc(n, sizeof *queue);
    uint8_t *state = srnf_alloc(n, sizeof *state);
    int status = SRNF_ENOMEM;

    if (opposite && queue && state) {
        status = srnf_topology_opposites(&work->mesh, work->context, MEND_BOUNDARY, MEND_CROWDED,
                                         opposite);
    }
    if (status == SRNF_OK) {
        orient_patches(work, opposite, state, queue);
        work->judged = true;
        status = srnf_is_canceled(work->context) ? SRNF_ECANCELED : SRNF_OK;
    }
    srnf_free(state);
    srnf_free(queue);
    srnf_free(opposite);
    return status;
}
