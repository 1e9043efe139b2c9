/*
 * mend_merge.c - joins vertices that are nearer to each other than a tolerance.
 *
 * Vertices are taken in their order. One that has a vertex taken before within the tolerance
 * becomes the nearest of these; any other stays, where it is. So chains of near points stay apart,
 * and what stays is farther apart than the tolerance. Such points are found by cells as wide as the
 * tolerance, which hold at most a few of them; cells are sorted, not hashed, so that no input makes
 * it slow. O(n log n).
 */
#include "mend.h"

#include <string.h>

#define NOTHING UINT32_MAX
#define CELLS_MAX 4503599627370496.0 /* 2^52: beyond it cells are finer than coordinates */

struct cells {
    const struct mend *work;
    double low[3], width;
    int64_t (*key)[3];     /* of each vertex */
    uint32_t *order;       /* vertices, by key */
    uint32_t *start;       /* [n_cells]: the first of each cell in order */
    uint32_t *cell;        /* of each vertex */
    uint32_t *kept;        /* [n_cells]: the vertex that was kept last there, or NOTHING */
    uint32_t *kept_before; /* of each kept vertex: the one kept before in its cell */
    size_t n_cells;
};

static int compare_keys(const int64_t a[3], const int64_t b[3])
{
    for (size_t k = 0; k < 3; k++) {
        if (a[k] != b[k]) {
            return a[k] < b[k] ? -1 : 1;
        }
    }
    return 0;
}

static bool key_less(const void *context, uint32_t a, uint32_t b)
{
    const struct cells *cells = context;

    return compare_keys(cells->key[a], cells->key[b]) < 0;
}

static void cells_clear(struct cells *cells)
{
    srnf_free(cells->key);
    srnf_free(cells->order);
    srnf_free(cells->start);
    srnf_free(cells->cell);
    srnf_free(cells->kept);
    srnf_free(cells->kept_before);
}

/* Widens the cells where there would be too many to count; then they hold all that is near. */
static void measure(struct cells *cells)
{
    const struct srnf_mesh *mesh = &cells->work->mesh;
    double extent = 0.0, high;

    for (size_t k = 0; k < 3; k++) {
        cells->low[k] = high = mesh->vertices[k];
        for (size_t i = 0; i < mesh->n_vertices; i++) {
            cells->low[k] = smaller(cells->low[k], mesh->vertices[3 * i + k]);
            high = larger(high, mesh->vertices[3 * i + k]);
        }
        extent = larger(extent, high / 2.0 - cells->low[k] / 2.0);
    }
    cells->width = larger(cells->work->options->merge, extent / CELLS_MAX * 2.0);
}

static int cells_make(struct cells *cells)
{
    const struct srnf_mesh *mesh = &cells->work->mesh;
    size_t n = mesh->n_vertices;

    cells->key = srnf_alloc(n, sizeof *cells->key);
    cells->order = srnf_alloc(n, sizeof *cells->order);
    cells->start = srnf_alloc(n, sizeof *cells->start);
    cells->cell = srnf_alloc(n, sizeof *cells->cell);
    cells->kept = srnf_alloc(n, sizeof *cells->kept);
    cells->kept_before = srnf_alloc(n, sizeof *cells->kept_before);
    if (!cells->key || !cells->order || !cells->start || !cells->cell || !cells->kept ||
        !cells->kept_before) {
        return SRNF_ENOMEM;
    }
    measure(cells);
    for (size_t i = 0; i < n; i++) {
        cells->order[i] = (uint32_t)i;
        for (size_t k = 0; k < 3; k++) {
            cells->key[i][k] = (int64_t)floor(mesh->vertices[3 * i + k] / cells->width -
                                              cells->low[k] / cells->width);
        }
    }
    /* start is room for the sort before it is filled. */
    srnf_sort_order(cells->order, cells->start, n, key_less, cells, cells->work->context);
    if (srnf_is_canceled(cells->work->context)) {
        return SRNF_ECANCELED;
    }
    for (size_t i = 0; i < n; i++) {
        if (i == 0 || key_less(cells, cells->order[i - 1], cells->order[i])) {
            cells->kept[cells->n_cells] = NOTHING;
            cells->start[cells->n_cells++] = (uint32_t)i;
        }
        cells->cell[cells->order[i]] = (uint32_t)(cells->n_cells - 1);
    }
    return SRNF_OK;
}

/* The first cell whose key is not below this one. */
static size_t find_cell(const struct cells *cells, const int64_t key[3])
{
    size_t low = 0, high = cells->n_cells;

    while (low < high) {
        size_t middle = low + (high - low) / 2;

        if (compare_keys(cells->key[cells->order[cells->start[middle]]], key) < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* The nearest kept vertex within the tolerance of this one, or NOTHING. */
static uint32_t find_kept(const struct cells *cells, uint32_t vertex)
{
    const double *vertices = cells->work->mesh.vertices, *p = vertices + 3 * (size_t)vertex;
    double least = cells->work->options->merge;
    uint32_t best = NOTHING;

    for (int64_t row = 0; row < 9; row++) {
        const int64_t *own = cells->key[vertex];
        int64_t key[3] = {own[0] + row / 3 - 1, own[1] + row % 3 - 1, own[2] - 1};
        const int64_t last[3] = {key[0], key[1], own[2] + 1};

        for (size_t cell = find_cell(cells, key);
             cell < cells->n_cells &&
             compare_keys(cells->key[cells->order[cells->start[cell]]], last) <= 0;
             cell++) {
            for (uint32_t i = cells->kept[cell]; i != NOTHING; i = cells->kept_before[i]) {
                double difference[3], distance;

                vector_subtract(vertices + 3 * (size_t)i, p, difference);
                distance = vector_norm(difference);
                if (distance < least || (distance <= least && (best == NOTHING || i < best))) {
                    least = distance;
                    best = i;
                }
            }
        }
    }
    return best;
}

int mend_merge(struct mend *work)
{
    struct cells cells = {.work = work};
    size_t n = work->mesh.n_vertices, merged = 0;
    uint32_t *rename = srnf_alloc(n, sizeof *rename), first = 0;
    bool *keep = srnf_alloc(n, sizeof *keep);
    int status = !rename || !keep ? SRNF_ENOMEM : n > 0 ? cells_make(&cells) : SRNF_OK;

    for (size_t i = 0; status == SRNF_OK && i < n && !srnf_asks(work->context, i); i++) {
        uint32_t near = find_kept(&cells, (uint32_t)i);

        keep[i] = near == NOTHING;
        rename[i] = keep[i] ? (uint32_t)i : near;
        if (keep[i]) {
            cells.kept_before[i] = cells.kept[cells.cell[i]];
            cells.kept[cells.cell[i]] = (uint32_t)i;
        } else if (merged++ == 0) {
            first = work->origin.vertices[i];
        }
    }
    if (status == SRNF_OK && srnf_is_canceled(work->context)) {
        status = SRNF_ECANCELED;
    }
    if (status == SRNF_OK && merged > 0) {
        srnf_repair_compact(&work->mesh, &work->origin, work->context, keep, rename);
        (void)mend_note_vertex(work, "near-vertices-merged", merged, first);
        status = srnf_is_canceled(work->context) ? SRNF_ECANCELED : SRNF_OK;
    }
    cells_clear(&cells);
    srnf_free(keep);
    srnf_free(rename);
    return status;
}
