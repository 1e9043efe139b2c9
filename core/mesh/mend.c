/*
 * mend.c - repairs on request: what they are made of, and where they were.
 *
 * Preparing a mesh (prepare.c) does what loses nothing and leaves everything else to the one who
 * knows the data. Here it is asked for. The order matters: joining points makes faces degenerate
 * and equal; what is left of those hides neither islands nor holes; and a hole can be closed only
 * where the faces around it agree.
 */
#include "mend.h"

#include <string.h>

void srnf_mended_clear(struct srnf_mended *mended)
{
    srnf_mesh_clear(&mended->mesh);
    *mended = (struct srnf_mended){.n_changes = 0};
}

/* ---- Notes ----------------------------------------------------------------------------------- */

static struct srnf_mend_item *note(struct mend *work, bool refused, const char *code, size_t count,
                                   int64_t first)
{
    struct srnf_mended *mended = work->mended;
    size_t *n = refused ? &mended->n_refused : &mended->n_changes;
    struct srnf_mend_item *items = refused ? mended->refused : mended->changes;
    struct srnf_mend_item *item = &items[*n];

    *n += *n + 1 < SRNF_MEND_ITEMS_MAX; /* the last place is written over; no mesh comes so far */
    *item = (struct srnf_mend_item){.code = code, .count = count, .first = first};
    return item;
}

struct srnf_mend_item *mend_note_face(struct mend *work, bool refused, const char *code,
                                      size_t count, uint32_t face)
{
    struct srnf_mend_item *item = note(work, refused, code, count, face);

    for (size_t c = 0; c < 3; c++) {
        const double *p = mesh_corner(work->input, face, c);

        for (size_t k = 0; k < 3; k++) {
            item->position[k] += p[k] / 3.0;
        }
    }
    return item;
}

struct srnf_mend_item *mend_note_vertex(struct mend *work, const char *code, size_t count,
                                        uint32_t vertex)
{
    struct srnf_mend_item *item = note(work, false, code, count, vertex);

    item->of_vertex = true;
    memcpy(item->position, work->input->vertices + 3 * (size_t)vertex, sizeof item->position);
    return item;
}

void mend_keep_faces(struct mend *work, const bool *keep)
{
    size_t kept = 0;

    for (size_t f = 0; f < work->mesh.n_faces; f++) {
        if (keep[f]) {
            memmove(work->mesh.faces + 3 * kept, work->mesh.faces + 3 * f,
                    3 * sizeof *work->mesh.faces);
            work->origin.faces[kept++] = work->origin.faces[f];
        }
    }
    work->mesh.n_faces = kept;
}

/* ---- The whole ------------------------------------------------------------------------------- */

static int start(struct mend *work)
{
    const struct srnf_mesh *from = work->input;
    struct srnf_mesh *to = &work->mesh;

    to->vertices = srnf_alloc(from->n_vertices, 3 * sizeof *to->vertices);
    to->faces = srnf_alloc(from->n_faces, 3 * sizeof *to->faces);
    work->origin.vertices = srnf_alloc(from->n_vertices, sizeof *work->origin.vertices);
    work->origin.faces = srnf_alloc(from->n_faces, sizeof *work->origin.faces);
    work->turned = srnf_alloc(from->n_faces, sizeof *work->turned);
    if (!to->vertices || !to->faces || !work->origin.vertices || !work->origin.faces ||
        !work->turned) {
        return SRNF_ENOMEM;
    }
    to->n_vertices = from->n_vertices;
    to->n_faces = from->n_faces;
    if (from->n_vertices > 0) {
        memcpy(to->vertices, from->vertices, 3 * from->n_vertices * sizeof *to->vertices);
    }
    if (from->n_faces > 0) {
        memcpy(to->faces, from->faces, 3 * from->n_faces * sizeof *to->faces);
    }
    for (size_t i = 0; i < from->n_vertices; i++) {
        work->origin.vertices[i] = (uint32_t)i;
    }
    for (size_t f = 0; f < from->n_faces; f++) {
        work->origin.faces[f] = (uint32_t)f;
    }
    return SRNF_OK;
}

/* What preparing makes of the mesh. */
static int examine(struct mend *work, struct srnf_mesh_report *report)
{
    struct mend copy = {.input = work->input};
    int status = start(&copy);

    if (status == SRNF_OK) {
        status = srnf_mesh_prepare_within(&copy.mesh, true, work->context, report);
    }
    srnf_mesh_clear(&copy.mesh);
    srnf_free(copy.origin.vertices);
    srnf_free(copy.origin.faces);
    srnf_free(copy.turned);
    return status;
}

/* Joins equal points, unless the mesh means them to be several, which preparing has found out. */
static int weld(struct mend *work, const struct srnf_mesh_report *report)
{
    const struct srnf_mesh_repairs *repairs = &report->repairs;
    size_t merged, n = work->mesh.n_vertices;
    uint32_t first = 0;
    int status;

    if (repairs->touching_vertices_kept_apart > 0 && repairs->duplicate_vertices_merged == 0) {
        return SRNF_OK;
    }
    status = srnf_repair_merge_vertices(&work->mesh, &work->origin, work->context, &merged);
    while (status == SRNF_OK && merged > 0 && first < n - merged &&
           work->origin.vertices[first] == first) {
        first++;
    }
    if (status == SRNF_OK && merged > 0) {
        (void)mend_note_vertex(work, "equal-vertices-merged", merged, first);
        work->lossless++;
    }
    return status;
}

static int run_steps(struct mend *work)
{
    const struct srnf_mend_options *options = work->options;
    int status = SRNF_OK;

    if (options->merge > 0.0) {
        status = mend_merge(work);
    }
    if (status == SRNF_OK && (options->degenerate || options->duplicates || options->merge > 0.0 ||
                              options->holes > 0.0)) {
        status = mend_degenerate(work);
    }
    if (status == SRNF_OK && options->duplicates) {
        status = mend_duplicates(work);
    }
    if (status == SRNF_OK && options->islands) {
        status = mend_islands(work);
    }
    if (status == SRNF_OK && options->orient) {
        status = mend_orient(work);
    }
    if (status == SRNF_OK && options->holes > 0.0) {
        status = mend_holes(work);
        status = status == SRNF_OK && options->orient ? mend_orient(work) : status; /* outwards */
    }
    return status;
}

static void note_turned(struct mend *work)
{
    size_t turned = 0;
    uint32_t first = 0;

    for (size_t f = work->input->n_faces; f-- > 0;) {
        if (work->turned[f]) {
            turned++;
            first = (uint32_t)f;
        }
    }
    if (turned > 0) {
        (void)mend_note_face(work, false, "faces-turned", turned, first);
    }
}

static int finish(struct mend *work, struct srnf_error *error)
{
    size_t dropped;
    int status;

    note_turned(work);
    if (work->mended->n_changes == work->lossless) {
        work->mended->n_changes = 0;
        return SRNF_OK;
    }
    if (work->mesh.n_faces == 0) {
        return srnf_fail(error, SRNF_EDEGENERATE, -1,
                         "no face is left; a merge of %g may be more than the mesh is wide",
                         work->options->merge);
    }
    status = srnf_repair_drop_unreferenced(&work->mesh, &work->origin, work->context, &dropped);
    if (status == SRNF_OK) {
        work->mended->mesh = work->mesh;
        work->mesh = (struct srnf_mesh){.n_vertices = 0};
    }
    return status;
}

int srnf_mend(const struct srnf_mesh *mesh, const struct srnf_mend_options *options,
              const struct srnf_context *context, struct srnf_mended *mended,
              struct srnf_error *error)
{
    struct mend work = {.input = mesh, .options = options, .context = context, .mended = mended};
    struct srnf_mesh_report report;
    int status;

    *mended = (struct srnf_mended){.n_changes = 0};
    if (!(options->merge >= 0.0) || !(options->holes >= 0.0) || !isfinite(options->merge) ||
        !isfinite(options->holes)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "merge and holes are lengths, from 0 on");
    }
    status = examine(&work, &report);
    if (status == SRNF_OK && report.n_problems > 0) {
        status = start(&work);
        status = status == SRNF_OK ? weld(&work, &report) : status;
        status = status == SRNF_OK ? run_steps(&work) : status;
        status = status == SRNF_OK ? finish(&work, error) : status;
    }
    srnf_mesh_clear(&work.mesh);
    srnf_free(work.origin.vertices);
    srnf_free(work.origin.faces);
    srnf_free(work.turned);
    if (status != SRNF_OK) {
        srnf_mended_clear(mended);
        if (status != SRNF_EDEGENERATE) {
            (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
        }
    }
    return status;
}
