/*
 * mend_holes.c - closes holes: loops of edges that have one face.
 *
 * Each vertex of a fan of faces that ends has one edge in and one edge out of the boundary, so that
 * the loops are found by going round the fans. Where fans touch in a point each gets a vertex of
 * its own first. A loop is closed by triangles between its own vertices (mend_fill.c), or, where
 * every way of that needs an edge that exists already, by a fan around its middle.
 */
#include "mend.h"

#include <stdio.h>
#include <string.h>

#define NOWHERE UINT32_MAX

struct holes {
    struct mend *work;
    uint32_t *opposite;
    bool *seen;                              /* corners on loops so far */
    uint32_t *place;                         /* of each vertex in the loop, or NOWHERE */
    uint32_t loop[SRNF_MEND_HOLE_EDGES_MAX]; /* its first corners, in order */
    size_t n; /* of them; more than the loop has room for: too many */
    double perimeter, middle[3];
    uint32_t lowest; /* face beside the loop */
    double points[SRNF_MEND_HOLE_EDGES_MAX][3];
    uint32_t triangles[3 * SRNF_MEND_HOLE_EDGES_MAX];
    bool *forbidden;
    uint32_t *faces; /* new ones */
    double *vertices;
    size_t n_faces, n_vertices;
    double longest;
};

static uint32_t corner_before(uint32_t corner)
{
    return corner % 3 == 0 ? corner + 2 : corner - 1;
}

/* ---- Loops ----------------------------------------------------------------------------------- */

/* The boundary's corner after this one: round the vertex where it ends. */
static uint32_t corner_after(const struct holes *holes, uint32_t corner)
{
    uint32_t next = mend_next(corner);

    while (holes->opposite[next] != MEND_BOUNDARY) {
        next = mend_next(holes->opposite[next]);
    }
    return next;
}

static void walk(struct holes *holes, uint32_t start)
{
    const struct srnf_mesh *mesh = &holes->work->mesh;
    uint32_t corner = start;

    holes->n = 0;
    holes->perimeter = 0.0;
    holes->lowest = start / 3;
    memset(holes->middle, 0, sizeof holes->middle);
    do {
        const double *from = mesh->vertices + 3 * (size_t)mesh->faces[corner];
        const double *to = mesh->vertices + 3 * (size_t)mesh->faces[mend_next(corner)];
        double edge[3];

        vector_subtract(to, from, edge);
        holes->perimeter += vector_norm(edge);
        holes->seen[corner] = true;
        for (size_t k = 0; k < 3; k++) {
            holes->middle[k] += (from[k] - holes->middle[k]) / (double)(holes->n + 1);
        }
        if (holes->n < SRNF_MEND_HOLE_EDGES_MAX) {
            holes->loop[holes->n] = corner;
            memcpy(holes->points[holes->n], from, sizeof holes->points[0]);
        }
        holes->n++;
        holes->lowest = corner / 3 < holes->lowest ? corner / 3 : holes->lowest;
        corner = corner_after(holes, corner);
    } while (corner != start && !srnf_asks(holes->work->context, holes->n));
}

/* Chords of the loop that are edges of the mesh. */
static void mark_edges(struct holes *holes)
{
    const uint32_t *faces = holes->work->mesh.faces;
    size_t n = holes->n;

    memset(holes->forbidden, 0, n * n * sizeof *holes->forbidden);
    for (size_t i = 0; i < n; i++) {
        holes->place[faces[holes->loop[i]]] = (uint32_t)i;
    }
    for (size_t i = 0; i < n; i++) {
        for (uint32_t corner = holes->loop[i]; corner != MEND_BOUNDARY;
             corner = holes->opposite[corner_before(corner)]) {
            const uint32_t ends[2] = {faces[mend_next(corner)], faces[corner_before(corner)]};

            for (size_t e = 0; e < 2; e++) {
                uint32_t j = holes->place[ends[e]];

                if (j != NOWHERE) {
                    holes->forbidden[i * n + j] = holes->forbidden[j * n + i] = true;
                }
            }
        }
    }
    for (size_t i = 0; i < n; i++) {
        holes->place[faces[holes->loop[i]]] = NOWHERE;
    }
}

static void add_face(struct holes *holes, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *face = holes->faces + 3 * holes->n_faces++;

    face[0] = a;
    face[1] = b;
    face[2] = c;
}

static int close_loop(struct holes *holes)
{
    const struct srnf_mesh *mesh = &holes->work->mesh;
    size_t n = holes->n;
    uint32_t middle;
    bool filled;
    int status;

    mark_edges(holes);
    status = mend_fill((const double(*)[3])holes->points, n, holes->forbidden, holes->work->context,
                       holes->triangles, &filled);
    if (status != SRNF_OK) {
        return status;
    }
    for (size_t t = 0; filled && t < n - 2; t++) {
        const uint32_t *v = holes->triangles + 3 * t;

        add_face(holes, mesh->faces[holes->loop[v[0]]], mesh->faces[holes->loop[v[1]]],
                 mesh->faces[holes->loop[v[2]]]);
    }
    if (!filled) {
        middle = (uint32_t)(mesh->n_vertices + holes->n_vertices);
        memcpy(holes->vertices + 3 * holes->n_vertices++, holes->middle, sizeof holes->middle);
        for (size_t i = 0; i < n; i++) {
            add_face(holes, mesh->faces[holes->loop[(i + 1) % n]], mesh->faces[holes->loop[i]],
                     middle);
        }
    }
    return SRNF_OK;
}

/* ---- Notes ----------------------------------------------------------------------------------- */

static struct srnf_mend_item *note(struct holes *holes, bool refused, const char *code)
{
    struct mend *work = holes->work;
    struct srnf_mend_item *item =
        mend_note_face(work, refused, code, 0, work->origin.faces[holes->lowest]);

    memcpy(item->position, holes->middle, sizeof item->position);
    return item;
}

static int judge(struct holes *holes, struct srnf_mend_item *items[3])
{
    double most = holes->work->options->holes;

    if (holes->perimeter > most) {
        items[1] = items[1] ? items[1] : note(holes, true, "hole-too-long");
        items[1]->count++;
        holes->longest = larger(holes->longest, holes->perimeter);
        (void)snprintf(
            items[1]->detail, sizeof items[1]->detail,
            "the longest has a perimeter of %.6g, more than the %.6g asked for; if it is "
            "meant to be closed flat, ask for as much",
            holes->longest, most);
        return SRNF_OK;
    }
    if (holes->n > SRNF_MEND_HOLE_EDGES_MAX) {
        items[2] = items[2] ? items[2] : note(holes, true, "hole-of-too-many-edges");
        items[2]->count++;
        (void)snprintf(
            items[2]->detail, sizeof items[2]->detail,
            "holes of up to %d edges are closed, and this one has %zu; simplify the mesh "
            "around it",
            SRNF_MEND_HOLE_EDGES_MAX, holes->n);
        return SRNF_OK;
    }
    items[0] = items[0] ? items[0] : note(holes, false, "holes-closed");
    items[0]->count++;
    return close_loop(holes);
}

/* ---- The whole ------------------------------------------------------------------------------- */

/* Whether the faces allow it; else that is noted. *boundary counts edges. */
static bool is_closable(struct mend *work, const uint32_t *opposite, size_t *boundary)
{
    const struct srnf_mesh *mesh = &work->mesh;
    struct srnf_mend_item *item;
    size_t troubles = 0;
    uint32_t first = 0;

    *boundary = 0;
    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        uint32_t other = opposite[c];
        bool trouble = other == MEND_CROWDED ||
                       (other != MEND_BOUNDARY && mesh->faces[c] == mesh->faces[other]);

        *boundary += other == MEND_BOUNDARY;
        if (trouble && troubles++ == 0) {
            first = work->origin.faces[c / 3];
        }
    }
    if (*boundary == 0 || troubles == 0) {
        return *boundary > 0;
    }
    item = mend_note_face(work, true, "holes-in-doubt", *boundary, first);
    (void)snprintf(item->detail, sizeof item->detail,
                   "around face %u faces disagree or an edge has more than two, so that what is a "
                   "hole is in doubt; ask for orient, duplicates and islands as well",
                   first);
    return false;
}

static int append(struct holes *holes)
{
    struct mend *work = holes->work;
    struct srnf_mesh *mesh = &work->mesh;
    size_t n_vertices = mesh->n_vertices + holes->n_vertices;
    size_t n_faces = mesh->n_faces + holes->n_faces;
    struct srnf_mesh grown = {.n_vertices = n_vertices, .n_faces = n_faces};
    struct srnf_mesh_origin origin;

    grown.vertices = srnf_alloc(n_vertices, 3 * sizeof *grown.vertices);
    grown.faces = srnf_alloc(n_faces, 3 * sizeof *grown.faces);
    origin.vertices = srnf_alloc(n_vertices, sizeof *origin.vertices);
    origin.faces = srnf_alloc(n_faces, sizeof *origin.faces);
    if (!grown.vertices || !grown.faces || !origin.vertices || !origin.faces) {
        srnf_mesh_clear(&grown);
        srnf_free(origin.vertices);
        srnf_free(origin.faces);
        return SRNF_ENOMEM;
    }
    memcpy(grown.vertices, mesh->vertices, 3 * mesh->n_vertices * sizeof *grown.vertices);
    memcpy(grown.vertices + 3 * mesh->n_vertices, holes->vertices,
           3 * holes->n_vertices * sizeof *grown.vertices);
    memcpy(grown.faces, mesh->faces, 3 * mesh->n_faces * sizeof *grown.faces);
    memcpy(grown.faces + 3 * mesh->n_faces, holes->faces, 3 * holes->n_faces * sizeof *grown.faces);
    memset(origin.vertices, 0xff, n_vertices * sizeof *origin.vertices);
    memset(origin.faces, 0xff, n_faces * sizeof *origin.faces);
    memcpy(origin.vertices, work->origin.vertices, mesh->n_vertices * sizeof *origin.vertices);
    memcpy(origin.faces, work->origin.faces, mesh->n_faces * sizeof *origin.faces);
    srnf_mesh_clear(mesh);
    srnf_free(work->origin.vertices);
    srnf_free(work->origin.faces);
    *mesh = grown;
    work->origin = origin;
    return SRNF_OK;
}

static int close_all(struct holes *holes, size_t boundary)
{
    struct mend *work = holes->work;
    struct srnf_mend_item *items[3] = {NULL, NULL, NULL};
    size_t n = work->mesh.n_vertices;
    int status = SRNF_OK;

    holes->seen = srnf_alloc(3 * work->mesh.n_faces, sizeof *holes->seen);
    holes->place = srnf_alloc(n, sizeof *holes->place);
    holes->forbidden = srnf_alloc((size_t)SRNF_MEND_HOLE_EDGES_MAX * SRNF_MEND_HOLE_EDGES_MAX,
                                  sizeof *holes->forbidden);
    holes->faces = srnf_alloc(boundary, 3 * sizeof *holes->faces);
    holes->vertices = srnf_alloc(boundary / 3 + 1, 3 * sizeof *holes->vertices);
    if (!holes->seen || !holes->place || !holes->forbidden || !holes->faces || !holes->vertices) {
        return SRNF_ENOMEM;
    }
    memset(holes->place, 0xff, n * sizeof *holes->place);
    for (size_t c = 0; status == SRNF_OK && c < 3 * work->mesh.n_faces; c++) {
        if (srnf_asks(work->context, c)) {
            return SRNF_ECANCELED;
        }
        if (holes->opposite[c] == MEND_BOUNDARY && !holes->seen[c]) {
            walk(holes, (uint32_t)c);
            status = judge(holes, items);
        }
    }
    if (status == SRNF_OK && srnf_is_canceled(work->context)) {
        status = SRNF_ECANCELED;
    }
    return status == SRNF_OK && holes->n_faces > 0 ? append(holes) : status;
}

int mend_holes(struct mend *work)
{
    struct holes *holes = srnf_alloc(1, sizeof *holes);
    size_t boundary = 0, split;
    int status = SRNF_ENOMEM;

    if (!holes) {
        return status;
    }
    holes->work = work;
    holes->opposite = srnf_alloc(3 * work->mesh.n_faces, sizeof *holes->opposite);
    if (holes->opposite) {
        status = srnf_topology_opposites(&work->mesh, work->context, MEND_BOUNDARY, MEND_CROWDED,
                                         holes->opposite);
    }
    if (status == SRNF_OK && is_closable(work, holes->opposite, &boundary)) {
        status = srnf_repair_split_fans(&work->mesh, &work->origin, work->context, &split);
        status = status == SRNF_OK ? close_all(holes, boundary) : status;
    }
    srnf_free(holes->vertices);
    srnf_free(holes->faces);
    srnf_free(holes->forbidden);
    srnf_free(holes->place);
    srnf_free(holes->seen);
    srnf_free(holes->opposite);
    srnf_free(holes);
    return status;
}
