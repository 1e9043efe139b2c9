/*
 * handles.c - a closed mesh with handles, made a ball by way of voxels.
 *
 * Surgery on the mesh would have to find a loop around each handle, cut there and cap the ends, and
 * the caps may cross other sheets. In voxels a handle is cut, or the tunnel through it filled, by
 * changing the fewest simple voxels (ball.c), and the surface of the result is sound by its making.
 *
 * A voxel is inside where the winding number of its centre is not 0: along each row of voxels the
 * crossings of the mesh are counted with their signs. Whether a row passes an edge on the left is
 * computed alike for both faces of the edge, so that the counts of a closed mesh add up to 0 beyond
 * it, whatever rounding does.
 */
#include "mesh/mesh_geometry.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define LABEL 1
#define MARGIN 2 /* voxels around the mesh */
#define COUNT_MAX 100

struct rows {
    const struct srnf_mesh *mesh;
    const struct srnf_context *context;
    double low[3], step;
    size_t shape[3];
    int8_t *count; /* [shape[2]][shape[1]][shape[0]]: crossings just before each voxel */
};

/* ---- Voxels ---------------------------------------------------------------------------------- */

static void place_grid(struct rows *rows, size_t voxels)
{
    const struct srnf_mesh *mesh = rows->mesh;
    double high[3], widest = 0.0;

    for (size_t k = 0; k < 3; k++) {
        rows->low[k] = high[k] = mesh->vertices[k];
        for (size_t i = 0; i < mesh->n_vertices; i++) {
            rows->low[k] = smaller(rows->low[k], mesh->vertices[3 * i + k]);
            high[k] = larger(high[k], mesh->vertices[3 * i + k]);
        }
        widest = larger(widest, high[k] - rows->low[k]);
    }
    rows->step = widest / (double)voxels;
    for (size_t k = 0; k < 3; k++) {
        double extent = high[k] - rows->low[k];

        rows->shape[k] = (size_t)ceil(extent / rows->step) + 2 * MARGIN + 1;
        rows->low[k] -= ((double)(rows->shape[k] - 1) * rows->step - extent) / 2.0;
    }
}

static double centre(const struct rows *rows, size_t axis, ptrdiff_t index)
{
    return rows->low[axis] + (double)index * rows->step;
}

/* The voxels whose centres may lie between two coordinates, within the grid. */
static void range_of(const struct rows *rows, size_t axis, double low, double high,
                     ptrdiff_t range[2])
{
    ptrdiff_t last = (ptrdiff_t)rows->shape[axis] - 1;

    range[0] = (ptrdiff_t)floor((low - rows->low[axis]) / rows->step) - 1;
    range[1] = (ptrdiff_t)ceil((high - rows->low[axis]) / rows->step) + 1;
    range[0] = range[0] < 0 ? 0 : range[0];
    range[1] = range[1] > last ? last : range[1];
}

/* +1 or -1 where the edge from a to b passes the height z on the right of y, up or down; 0
   where it does not. The same numbers are computed for the edge from b to a. */
static int passes(const double *a, const double *b, double y, double z)
{
    bool up = a[2] <= z && b[2] > z, down = b[2] <= z && a[2] > z;
    const double *low = up ? a : b, *high = up ? b : a;

    if (!up && !down) {
        return 0;
    }
    if (!(low[1] + (z - low[2]) / (high[2] - low[2]) * (high[1] - low[1]) > y)) {
        return 0;
    }
    return up ? 1 : -1;
}

/* Where the row at (y, z) goes through the plane of the face; the middle of its extent where it
   lies in that plane. */
static double crossing(const double *a, const double *b, const double *c, double y, double z)
{
    double u[3], v[3], normal[3], x;
    double low = smaller(a[0], smaller(b[0], c[0])), high = larger(a[0], larger(b[0], c[0]));

    vector_subtract(b, a, u);
    vector_subtract(c, a, v);
    vector_cross(u, v, normal);
    x = a[0] - (normal[1] * (y - a[1]) + normal[2] * (z - a[2])) / normal[0];
    return x >= low && x <= high ? x : x > high ? high : x < low ? low : (low + high) / 2.0;
}

static int add_crossing(struct rows *rows, size_t face, ptrdiff_t j, ptrdiff_t k)
{
    const double *a = mesh_corner(rows->mesh, face, 0), *b = mesh_corner(rows->mesh, face, 1),
                 *c = mesh_corner(rows->mesh, face, 2);
    double y = centre(rows, 1, j), z = centre(rows, 2, k), at;
    int winding = passes(a, b, y, z) + passes(b, c, y, z) + passes(c, a, y, z);
    int8_t *count;
    size_t i;

    if (winding == 0) {
        return SRNF_OK;
    }
    at = ceil((crossing(a, b, c, y, z) - rows->low[0]) / rows->step);
    i = at > 0.0 ? (size_t)at : 0;
    i = i < rows->shape[0] ? i : rows->shape[0] - 1;
    count = &rows->count[((size_t)k * rows->shape[1] + (size_t)j) * rows->shape[0] + i];
    *count = (int8_t)(*count + winding);
    return *count >= -COUNT_MAX && *count <= COUNT_MAX ? SRNF_OK : SRNF_ENUMERIC;
}

static int count_crossings(struct rows *rows)
{
    const struct srnf_mesh *mesh = rows->mesh;
    ptrdiff_t range[2][2];
    int status = SRNF_OK;

    for (size_t f = 0; f < mesh->n_faces && status == SRNF_OK; f++) {
        if (f % 64 == 0 && srnf_is_canceled(rows->context)) {
            return SRNF_ECANCELED;
        }
        for (size_t k = 0; k < 2; k++) {
            double a = mesh_corner(mesh, f, 0)[k + 1], b = mesh_corner(mesh, f, 1)[k + 1],
                   c = mesh_corner(mesh, f, 2)[k + 1];

            range_of(rows, k + 1, smaller(a, smaller(b, c)), larger(a, larger(b, c)), range[k]);
        }
        for (ptrdiff_t k = range[1][0]; k <= range[1][1]; k++) {
            for (ptrdiff_t j = range[0][0]; j <= range[0][1] && status == SRNF_OK; j++) {
                status = add_crossing(rows, f, j, k);
            }
        }
    }
    return status;
}

/* From crossings to voxels; how many are inside. */
static size_t fill(const struct rows *rows, uint16_t *voxels)
{
    size_t inside = 0, at = 0;

    for (size_t row = 0; row < rows->shape[1] * rows->shape[2]; row++) {
        int winding = 0;

        for (size_t i = 0; i < rows->shape[0]; i++, at++) {
            winding += rows->count[at];
            voxels[at] = winding != 0;
            inside += winding != 0;
        }
    }
    return inside;
}

static int voxelize(struct rows *rows, struct srnf_volume *volume)
{
    size_t n = rows->shape[0] * rows->shape[1] * rows->shape[2];
    int status = SRNF_ENOMEM;

    *volume = (struct srnf_volume){.format = SRNF_VOLUME_UNKNOWN, .units = "unknown"};
    rows->count = srnf_alloc(n, sizeof *rows->count);
    volume->voxels = srnf_alloc(n, sizeof *volume->voxels);
    volume->labels = srnf_alloc(1, sizeof *volume->labels);
    if (rows->count && volume->voxels && volume->labels) {
        status = count_crossings(rows);
    }
    if (status == SRNF_OK) {
        volume->n_labels = 1;
        volume->labels[0].value = LABEL;
        volume->labels[0].voxels = fill(rows, volume->voxels);
        volume->background = n - volume->labels[0].voxels;
        status = volume->labels[0].voxels > 0 ? SRNF_OK : SRNF_ENUMERIC;
    }
    for (size_t k = 0; k < 3; k++) {
        volume->shape[k] = rows->shape[k];
        volume->spacing[k] = rows->step;
        volume->affine[4 * k + k] = rows->step;
        volume->affine[4 * k + 3] = rows->low[k];
    }
    srnf_free(rows->count);
    return status;
}

/* ---- What was done --------------------------------------------------------------------------- */

static struct srnf_mend_item *item_of(struct srnf_mended *mended, const char *code)
{
    struct srnf_mend_item *item;

    for (size_t i = 0; i < mended->n_changes; i++) {
        if (strcmp(mended->changes[i].code, code) == 0) {
            return &mended->changes[i];
        }
    }
    item = &mended->changes[mended->n_changes];
    mended->n_changes += mended->n_changes + 1 < SRNF_MEND_ITEMS_MAX;
    *item = (struct srnf_mend_item){.code = code, .first = -1};
    return item;
}

/* One change for each reason, where most of its voxels are. Places come largest first. */
static void note_places(struct srnf_mended *mended, const struct srnf_extracted *extracted)
{
    struct srnf_mend_item *item;
    size_t listed = extracted->n_places < SRNF_PLACES_MAX ? extracted->n_places : SRNF_PLACES_MAX;

    item = item_of(mended, "made-anew-from-voxels");
    item->count = extracted->mesh.n_vertices;
    item->position[0] = NAN;
    for (size_t i = 0; i < listed; i++) {
        const struct srnf_changed_place *place = &extracted->places[i];

        item = item_of(mended, srnf_change_name(place->change));
        if (item->count == 0) {
            memcpy(item->position, place->position, sizeof item->position);
        }
        item->count += place->voxels;
    }
}

static void refuse(struct srnf_mended *mended, const struct srnf_mesh_problem *problem)
{
    struct srnf_mend_item *item = &mended->refused[mended->n_refused];

    mended->n_refused += mended->n_refused + 1 < SRNF_MEND_ITEMS_MAX;
    *item = (struct srnf_mend_item){.code = "handles-in-doubt",
                                    .count = problem->count,
                                    .first = -1,
                                    .position = {NAN, 0.0, 0.0}};
    (void)snprintf(item->detail, sizeof item->detail,
                   "handles are told only of a surface that is closed, manifold, oriented and in "
                   "one piece; mend that first: %.90s",
                   problem->detail);
}

/* ---- The whole ------------------------------------------------------------------------------- */

static int copy(const struct srnf_mesh *from, struct srnf_mesh *to)
{
    *to = (struct srnf_mesh){.n_vertices = from->n_vertices, .n_faces = from->n_faces};
    to->vertices = srnf_alloc(from->n_vertices, 3 * sizeof *to->vertices);
    to->faces = srnf_alloc(from->n_faces, 3 * sizeof *to->faces);
    if (!to->vertices || !to->faces) {
        srnf_mesh_clear(to);
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < 3 * from->n_vertices; i++) {
        to->vertices[i] = from->vertices[i];
    }
    for (size_t c = 0; c < 3 * from->n_faces; c++) {
        to->faces[c] = from->faces[c];
    }
    return SRNF_OK;
}

static int remake(const struct srnf_mesh *mesh, size_t voxels, const struct srnf_context *context,
                  struct srnf_mended *mended, struct srnf_error *error)
{
    static const int64_t label = LABEL;
    struct rows rows = {.mesh = mesh, .context = context};
    struct srnf_extracted extracted = {.voxels = 0};
    struct srnf_volume volume;
    int status;

    place_grid(&rows, voxels);
    status = voxelize(&rows, &volume);
    if (status == SRNF_OK) {
        status = srnf_extract(&volume, &label, 1, NULL, context, &extracted, error);
    } else {
        (void)srnf_fail(error, status, -1,
                        status == SRNF_ENUMERIC
                            ? "the mesh is too thin for %zu voxels along it; ask for more"
                            : "the mesh was not put into %zu voxels",
                        voxels);
    }
    srnf_volume_clear(&volume);
    if (status == SRNF_OK) {
        note_places(mended, &extracted);
        srnf_mesh_clear(&mended->mesh);
        mended->mesh = extracted.mesh;
        extracted.mesh = (struct srnf_mesh){.n_vertices = 0};
    }
    srnf_extracted_clear(&extracted);
    return status;
}

int srnf_mend_handles(const struct srnf_mesh *mesh, size_t voxels,
                      const struct srnf_context *context, struct srnf_mended *mended,
                      struct srnf_error *error)
{
    struct srnf_mesh prepared;
    struct srnf_mesh_report report = {.n_problems = 0};
    int status;

    if (voxels < SRNF_HANDLES_VOXELS_MIN || voxels > SRNF_HANDLES_VOXELS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu voxels along the mesh are not %d to %d",
                         voxels, SRNF_HANDLES_VOXELS_MIN, SRNF_HANDLES_VOXELS_MAX);
    }
    status = copy(mesh ? mesh : &mended->mesh, &prepared);
    if (status == SRNF_OK) {
        status = srnf_mesh_prepare_within(&prepared, true, context, &report);
    }
    if (status != SRNF_OK) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    } else if (report.n_problems > 0 && report.problems[0].status != SRNF_EGENUS) {
        refuse(mended, &report.problems[0]);
    } else if (report.n_problems > 0 && report.genus > 0) {
        status = remake(&prepared, voxels, context, mended, error);
    }
    srnf_mesh_clear(&prepared);
    return status;
}
