/*
 * mend_distance.c - how far two meshes are from each other where they stand.
 *
 * Squared distances are integrated over each face by the rule with a twelfth of its area at each
 * corner and three quarters in the middle, which is exact for polynomials of degree 2 (Strang and
 * Fix 1973).
 */
#include "index.h"
#include "mesh_geometry.h"

struct one_way {
    double square, area, most; /* integral of the squared distance, area, largest distance */
};

/* squares: of the distances of the vertices. */
static void add_face(const struct srnf_mesh *mesh, const struct srnf_index *index,
                     const double *squares, size_t face, struct one_way *way)
{
    const uint32_t *v = mesh->faces + 3 * face;
    const double *a = mesh_corner(mesh, face, 0), *b = mesh_corner(mesh, face, 1),
                 *c = mesh_corner(mesh, face, 2);
    double u[3], w[3], normal[3], middle[3], area, square;

    vector_subtract(b, a, u);
    vector_subtract(c, a, w);
    vector_cross(u, w, normal);
    area = vector_norm(normal) / 2.0;
    for (size_t k = 0; k < 3; k++) {
        middle[k] = a[k] / 3.0 + b[k] / 3.0 + c[k] / 3.0;
    }
    square = srnf_index_distance2(index, middle, NULL, NULL);
    way->area += area;
    way->square += area * (0.75 * square + (squares[v[0]] + squares[v[1]] + squares[v[2]]) / 12.0);
    way->most = larger(way->most, square);
    for (size_t k = 0; k < 3; k++) {
        way->most = larger(way->most, squares[v[k]]);
    }
}

static int measure(const struct srnf_mesh *from, const struct srnf_mesh *to,
                   const struct srnf_context *context, struct one_way *way)
{
    struct srnf_index *index = NULL;
    double *squares = srnf_alloc(from->n_vertices, sizeof *squares);
    int status = squares ? index_create(&index, to, context) : SRNF_ENOMEM;

    for (size_t i = 0; status == SRNF_OK && i < from->n_vertices; i++) {
        if (i % 64 == 0 && srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
        }
        squares[i] = srnf_index_distance2(index, from->vertices + 3 * i, NULL, NULL);
    }
    for (size_t f = 0; status == SRNF_OK && f < from->n_faces; f++) {
        if (f % 64 == 0 && srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
        }
        add_face(from, index, squares, f, way);
    }
    srnf_index_destroy(index);
    srnf_free(squares);
    return status;
}

int srnf_mesh_distance(const struct srnf_mesh *a, const struct srnf_mesh *b,
                       const struct srnf_context *context, struct srnf_mesh_distance *distance)
{
    struct one_way there = {0.0, 0.0, 0.0}, back = {0.0, 0.0, 0.0};
    int status;

    *distance = (struct srnf_mesh_distance){0.0, 0.0};
    if (!mesh_is_finite(a) || !mesh_is_finite(b)) {
        return SRNF_EINVAL;
    }
    if (a->n_faces == 0 || b->n_faces == 0) {
        return SRNF_EDEGENERATE;
    }
    status = measure(a, b, context, &there);
    status = status == SRNF_OK ? measure(b, a, context, &back) : status;
    if (status == SRNF_OK && !(there.area > 0.0 && back.area > 0.0)) {
        status = SRNF_EDEGENERATE;
    }
    if (status == SRNF_OK) {
        distance->rms = sqrt((there.square / there.area + back.square / back.area) / 2.0);
        distance->max = sqrt(larger(there.most, back.most));
    }
    return status;
}
