/*
 * icosphere.c - the geodesic sphere: each face of the icosahedron cut into frequency^2 triangles by
 * lines parallel to its sides, and the corners projected to the unit sphere.
 *
 * Vertices: the 12 corners, then frequency - 1 on each of the 30 edges, from its lower corner to
 * its higher one, then those inside the 20 faces, row by row. Points on an edge are computed once,
 * so that neighbouring faces share them exactly.
 */
#include "mesh_geometry.h"

#define FREQUENCY_MAX 400
#define GOLDEN 1.6180339887498948482

static const double corners[12][3] = {
    {-1, GOLDEN, 0}, {1, GOLDEN, 0}, {-1, -GOLDEN, 0}, {1, -GOLDEN, 0},
    {0, -1, GOLDEN}, {0, 1, GOLDEN}, {0, -1, -GOLDEN}, {0, 1, -GOLDEN},
    {GOLDEN, 0, -1}, {GOLDEN, 0, 1}, {-GOLDEN, 0, -1}, {-GOLDEN, 0, 1},
};

static const uint8_t triangles[20][3] = {
    {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1},
};

/* Frequency, and the number of each edge of the icosahedron by its two corners. */
struct lattice {
    size_t frequency;
    uint8_t edge[12][12];
};

static void number_edges(struct lattice *lattice)
{
    uint8_t next = 0;

    for (size_t t = 0; t < 20; t++) {
        for (size_t k = 0; k < 3; k++) {
            uint8_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];

            if (a < b) { /* each edge runs upwards in exactly one of its two faces */
                lattice->edge[a][b] = next;
                lattice->edge[b][a] = next++;
            }
        }
    }
}

/* Vertex at step steps from corner a towards corner b, 0 <= step <= frequency. */
static size_t edge_vertex(const struct lattice *lattice, uint8_t a, uint8_t b, size_t step)
{
    size_t inner = lattice->frequency - 1;

    if (step == 0) {
        return a;
    }
    if (step == lattice->frequency) {
        return b;
    }
    return 12 + lattice->edge[a][b] * inner + (a < b ? step : lattice->frequency - step) - 1;
}

/* Vertex of triangle t at i steps from its first corner towards the line of the other two, and j
   steps along that line: 0 <= j <= i <= frequency. */
static size_t lattice_vertex(const struct lattice *lattice, size_t t, size_t i, size_t j)
{
    const uint8_t *corner = triangles[t];
    size_t inner = lattice->frequency - 1;

    if (j == 0) {
        return edge_vertex(lattice, corner[0], corner[1], i);
    }
    if (j == i) {
        return edge_vertex(lattice, corner[0], corner[2], i);
    }
    if (i == lattice->frequency) {
        return edge_vertex(lattice, corner[1], corner[2], j);
    }
    return 12 + 30 * inner + t * (inner * (inner - 1) / 2) + (i - 1) * (i - 2) / 2 + j - 1;
}

static void place(double vertex[3], const double point[3])
{
    double length = vector_norm(point);

    for (size_t k = 0; k < 3; k++) {
        vertex[k] = point[k] / length;
    }
}

static void place_vertices(const struct lattice *lattice, double *vertices)
{
    size_t frequency = lattice->frequency;

    for (size_t t = 0; t < 20; t++) {
        const double *a = corners[triangles[t][0]], *b = corners[triangles[t][1]];
        const double *c = corners[triangles[t][2]];

        for (size_t i = 2; i < frequency; i++) {
            for (size_t j = 1; j < i; j++) {
                double point[3];

                for (size_t k = 0; k < 3; k++) {
                    point[k] =
                        (double)(frequency - i) * a[k] + (double)(i - j) * b[k] + (double)j * c[k];
                }
                place(vertices + 3 * lattice_vertex(lattice, t, i, j), point);
            }
        }
        for (size_t e = 0; e < 3; e++) {
            uint8_t from = triangles[t][e], to = triangles[t][(e + 1) % 3];

            for (size_t i = 0; from < to && i <= frequency; i++) {
                double point[3];

                for (size_t k = 0; k < 3; k++) {
                    point[k] =
                        (double)(frequency - i) * corners[from][k] + (double)i * corners[to][k];
                }
                place(vertices + 3 * edge_vertex(lattice, from, to, i), point);
            }
        }
    }
}

static void place_faces(const struct lattice *lattice, uint32_t *faces)
{
    size_t next = 0;

    for (size_t t = 0; t < 20; t++) {
        for (size_t i = 0; i < lattice->frequency; i++) {
            for (size_t j = 0; j <= i; j++) {
                uint32_t above = (uint32_t)lattice_vertex(lattice, t, i, j);
                uint32_t left = (uint32_t)lattice_vertex(lattice, t, i + 1, j);
                uint32_t right = (uint32_t)lattice_vertex(lattice, t, i + 1, j + 1);

                faces[next++] = above;
                faces[next++] = left;
                faces[next++] = right;
                if (j < i) { /* the triangle that hangs between this one and the next */
                    faces[next++] = above;
                    faces[next++] = right;
                    faces[next++] = (uint32_t)lattice_vertex(lattice, t, i, j + 1);
                }
            }
        }
    }
}

int srnf_mesh_icosphere(size_t frequency, struct srnf_mesh *mesh)
{
    struct lattice lattice = {.frequency = frequency};
    double *vertices = NULL;
    uint32_t *faces = NULL;
    int status = SRNF_EINVAL;

    if (frequency == 0 || frequency > FREQUENCY_MAX) {
        goto out;
    }
    status = SRNF_ENOMEM;
    vertices = srnf_alloc(10 * frequency * frequency + 2, 3 * sizeof *vertices);
    faces = srnf_alloc(20 * frequency * frequency, 3 * sizeof *faces);
    if (!vertices || !faces) {
        goto out;
    }
    number_edges(&lattice);
    place_vertices(&lattice, vertices);
    place_faces(&lattice, faces);
    *mesh = (struct srnf_mesh){.n_vertices = 10 * frequency * frequency + 2,
                               .n_faces = 20 * frequency * frequency,
                               .vertices = vertices,
                               .faces = faces};
    vertices = NULL;
    faces = NULL;
    status = SRNF_OK;
out:
    srnf_free(faces);
    srnf_free(vertices);
    return status;
}
