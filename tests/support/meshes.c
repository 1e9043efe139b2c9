/*
 * meshes.c - meshes for tests; see meshes.h.
 */
#include "support/meshes.h"

#include "support/compare.h"
#include "support/random.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TWO_PI 6.28318530717958647693

static void require(bool condition, const char *what)
{
    if (!condition) {
        fprintf(stderr, "meshes: %s\n", what);
        abort();
    }
}

struct srnf_mesh meshes_blank(size_t n_vertices, size_t n_faces)
{
    struct srnf_mesh mesh = {.n_vertices = n_vertices, .n_faces = n_faces};

    mesh.vertices = srnf_alloc(n_vertices, 3 * sizeof *mesh.vertices);
    mesh.faces = srnf_alloc(n_faces, 3 * sizeof *mesh.faces);
    require(mesh.vertices && mesh.faces, "no memory");
    return mesh;
}

static struct srnf_mesh from_tables(size_t n_vertices, const double (*vertices)[3], size_t n_faces,
                                    const uint32_t (*faces)[3])
{
    struct srnf_mesh mesh = meshes_blank(n_vertices, n_faces);

    memcpy(mesh.vertices, vertices, n_vertices * sizeof *vertices);
    memcpy(mesh.faces, faces, n_faces * sizeof *faces);
    return mesh;
}

struct srnf_mesh meshes_copy(const struct srnf_mesh *mesh)
{
    struct srnf_mesh copy = meshes_blank(mesh->n_vertices, mesh->n_faces);

    memcpy(copy.vertices, mesh->vertices, 3 * mesh->n_vertices * sizeof(double));
    memcpy(copy.faces, mesh->faces, 3 * mesh->n_faces * sizeof(uint32_t));
    return copy;
}

struct srnf_mesh meshes_join(const struct srnf_mesh *a, const struct srnf_mesh *b)
{
    struct srnf_mesh mesh = meshes_blank(a->n_vertices + b->n_vertices, a->n_faces + b->n_faces);

    memcpy(mesh.vertices, a->vertices, 3 * a->n_vertices * sizeof(double));
    memcpy(mesh.vertices + 3 * a->n_vertices, b->vertices, 3 * b->n_vertices * sizeof(double));
    memcpy(mesh.faces, a->faces, 3 * a->n_faces * sizeof(uint32_t));
    for (size_t c = 0; c < 3 * b->n_faces; c++) {
        mesh.faces[3 * a->n_faces + c] = b->faces[c] + (uint32_t)a->n_vertices;
    }
    return mesh;
}

struct srnf_mesh meshes_without_faces(const struct srnf_mesh *mesh, const bool *drop)
{
    struct srnf_mesh copy = meshes_copy(mesh);

    copy.n_faces = 0;
    for (size_t f = 0; f < mesh->n_faces; f++) {
        if (!drop[f]) {
            memcpy(copy.faces + 3 * copy.n_faces++, mesh->faces + 3 * f, 3 * sizeof(uint32_t));
        }
    }
    return copy;
}

struct srnf_mesh meshes_soup(const struct srnf_mesh *mesh)
{
    struct srnf_mesh soup = meshes_blank(3 * mesh->n_faces, mesh->n_faces);

    for (size_t c = 0; c < 3 * mesh->n_faces; c++) {
        memcpy(soup.vertices + 3 * c, mesh->vertices + 3 * (size_t)mesh->faces[c],
               3 * sizeof(double));
        soup.faces[c] = (uint32_t)c;
    }
    return soup;
}

/* ---- Transformations ------------------------------------------------------------------------- */

void meshes_stretch(struct srnf_mesh *mesh, double x, double y, double z)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        mesh->vertices[3 * i] *= x;
        mesh->vertices[3 * i + 1] *= y;
        mesh->vertices[3 * i + 2] *= z;
    }
}

void meshes_scale(struct srnf_mesh *mesh, double factor)
{
    meshes_stretch(mesh, factor, factor, factor);
}

void meshes_move(struct srnf_mesh *mesh, double x, double y, double z)
{
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        mesh->vertices[3 * i] += x;
        mesh->vertices[3 * i + 1] += y;
        mesh->vertices[3 * i + 2] += z;
    }
}

void meshes_turn(struct srnf_mesh *mesh, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double axis[3], angle = test_random_uniform(&random, 0.0, TWO_PI), c = cos(angle),
                    s = sin(angle);

    test_random_direction(&random, axis);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        double *p = mesh->vertices + 3 * i, q[3];
        double along = axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2];

        for (size_t k = 0; k < 3; k++) {
            size_t k1 = (k + 1) % 3, k2 = (k + 2) % 3;

            q[k] =
                c * p[k] + s * (axis[k1] * p[k2] - axis[k2] * p[k1]) + (1.0 - c) * along * axis[k];
        }
        memcpy(p, q, sizeof q);
    }
}

void meshes_flip(struct srnf_mesh *mesh)
{
    for (size_t f = 0; f < mesh->n_faces; f++) {
        uint32_t *face = mesh->faces + 3 * f, first = face[0];

        face[0] = face[1];
        face[1] = first;
    }
}

/* ---- Closed, of genus zero ------------------------------------------------------------------- */

struct srnf_mesh meshes_sphere(size_t frequency)
{
    struct srnf_mesh mesh;

    require(srnf_mesh_icosphere(frequency, &mesh) == SRNF_OK, "no geodesic sphere");
    return mesh;
}

static void set_radius(double *vertex, double radius)
{
    for (size_t k = 0; k < 3; k++) {
        vertex[k] *= radius;
    }
}

struct srnf_mesh meshes_star(size_t frequency)
{
    struct srnf_mesh mesh = meshes_sphere(frequency);

    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *e = mesh.vertices + 3 * i, x = e[0], y = e[1], z = e[2];

        set_radius(e, 1.0 + 0.2 * (x * x - y * y) + 0.15 * z * z * z +
                          0.1 * (3.0 * x * x * y - y * y * y));
    }
    return mesh;
}

struct srnf_mesh meshes_bumpy(size_t frequency, uint64_t seed)
{
    enum { BUMPS = 6 };
    struct srnf_mesh mesh = meshes_sphere(frequency);
    struct test_random random = test_random_seed(seed);
    double direction[BUMPS][3], height[BUMPS];

    for (size_t b = 0; b < BUMPS; b++) {
        test_random_direction(&random, direction[b]);
        height[b] = test_random_uniform(&random, -0.15, 0.35);
    }
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *e = mesh.vertices + 3 * i, radius = 1.0;

        for (size_t b = 0; b < BUMPS; b++) {
            double *d = direction[b];

            radius += height[b] * exp(4.0 * (e[0] * d[0] + e[1] * d[1] + e[2] * d[2] - 1.0));
        }
        set_radius(e, radius);
    }
    return mesh;
}

struct srnf_mesh meshes_box(double x, double y, double z)
{
    static const double vertices[8][3] = {{-.5, -.5, -.5}, {.5, -.5, -.5}, {-.5, .5, -.5},
                                          {.5, .5, -.5},   {-.5, -.5, .5}, {.5, -.5, .5},
                                          {-.5, .5, .5},   {.5, .5, .5}};
    static const uint32_t faces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                          {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                          {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    struct srnf_mesh mesh = from_tables(8, vertices, 12, faces);

    meshes_stretch(&mesh, x, y, z);
    return mesh;
}

struct srnf_mesh meshes_tetrahedron(void)
{
    static const double vertices[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const uint32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

    return from_tables(4, vertices, 4, faces);
}

/* A tube around the x axis: pole, rings, pole; x[i] and radius[i] for i = 0 .. rings + 1. */
static struct srnf_mesh tube(size_t rings, size_t sides, const double *x, const double *radius)
{
    struct srnf_mesh mesh = meshes_blank(rings * sides + 2, 2 * rings * sides);
    uint32_t south = (uint32_t)(rings * sides), north = south + 1, *face = mesh.faces;

    mesh.vertices[3 * (size_t)south] = x[0];
    mesh.vertices[3 * (size_t)north] = x[rings + 1];
    for (size_t i = 0; i < rings; i++) {
        for (size_t j = 0; j < sides; j++) {
            double *vertex = mesh.vertices + 3 * (i * sides + j);
            double phi = TWO_PI * (double)j / (double)sides;
            uint32_t a = (uint32_t)(i * sides + j), b = (uint32_t)(i * sides + (j + 1) % sides);
            uint32_t a_up = i + 1 < rings ? a + (uint32_t)sides : north;
            uint32_t b_up = i + 1 < rings ? b + (uint32_t)sides : north;

            vertex[0] = x[i + 1];
            vertex[1] = radius[i + 1] * cos(phi);
            vertex[2] = radius[i + 1] * sin(phi);
            if (i == 0) {
                memcpy(face, ((const uint32_t[3]){south, b, a}), 3 * sizeof *face);
                face += 3;
            }
            memcpy(face, ((const uint32_t[3]){a, b, a_up}), 3 * sizeof *face);
            face += 3;
            if (i + 1 < rings) {
                memcpy(face, ((const uint32_t[3]){b, b_up, a_up}), 3 * sizeof *face);
                face += 3;
            }
        }
    }
    return mesh;
}

struct srnf_mesh meshes_capsule(double length, double radius, size_t rings, size_t sides)
{
    double *x = calloc(rings + 2, sizeof *x), *r = calloc(rings + 2, sizeof *r);
    double cap = TWO_PI / 4.0 * radius, whole = 2.0 * cap + length;
    struct srnf_mesh mesh;

    require(x && r, "no memory");
    for (size_t i = 0; i <= rings + 1; i++) {
        double s =
            whole * (double)i / (double)(rings + 1) - cap; /* arc length from the first cap's rim */

        x[i] = compare_min(compare_max(s, 0.0), length) - 0.5 * length;
        r[i] = radius;
        if (s < 0.0 || s > length) {
            double angle = (s < 0.0 ? -s : s - length) / radius;

            x[i] += (s < 0.0 ? -1.0 : 1.0) * radius * sin(angle);
            r[i] = radius * cos(angle);
        }
    }
    mesh = tube(rings, sides, x, r);
    free(r);
    free(x);
    return mesh;
}

struct srnf_mesh meshes_bent_capsule(double length, double radius, double angle, size_t rings,
                                     size_t sides)
{
    struct srnf_mesh mesh = meshes_capsule(length, radius, rings, sides);
    double bend = length / angle; /* radius of the axis */

    require(bend > radius, "the capsule is too thick to be bent so far");
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        double *p = mesh.vertices + 3 * i, turn = p[0] / bend, from_middle = bend - p[2];

        p[0] = from_middle * sin(turn);
        p[2] = bend - from_middle * cos(turn);
    }
    return mesh;
}

struct srnf_mesh meshes_inside_out_sphere(size_t frequency)
{
    struct srnf_mesh mesh = meshes_sphere(frequency);

    meshes_flip(&mesh);
    return mesh;
}

/* ---- With a fault ---------------------------------------------------------------------------- */

/* Two faces for each cell of a grid that closes on itself; where the rings close, side j meets side
   -j if twisted. */
static void wrap_grid(struct srnf_mesh *mesh, size_t rings, size_t sides, bool twisted)
{
    uint32_t *face = mesh->faces;

    for (size_t i = 0; i < rings; i++) {
        for (size_t j = 0; j < sides; j++) {
            size_t i1 = (i + 1) % rings, j1 = (j + 1) % sides;
            bool crossing = twisted && i1 == 0;
            size_t up = crossing ? (sides - j) % sides : j,
                   up1 = crossing ? (sides - j1) % sides : j1;
            uint32_t a = (uint32_t)(i * sides + j), b = (uint32_t)(i * sides + j1);
            uint32_t a_up = (uint32_t)(i1 * sides + up), b_up = (uint32_t)(i1 * sides + up1);

            memcpy(face, ((const uint32_t[6]){a, a_up, b, b, a_up, b_up}), 6 * sizeof *face);
            face += 6;
        }
    }
}

struct srnf_mesh meshes_torus(double major, double minor, size_t rings, size_t sides)
{
    struct srnf_mesh mesh = meshes_blank(rings * sides, 2 * rings * sides);

    for (size_t i = 0; i < rings; i++) {
        for (size_t j = 0; j < sides; j++) {
            double u = TWO_PI * (double)i / (double)rings, v = TWO_PI * (double)j / (double)sides;
            double *p = mesh.vertices + 3 * (i * sides + j);

            p[0] = (major + minor * cos(v)) * cos(u);
            p[1] = (major + minor * cos(v)) * sin(u);
            p[2] = minor * sin(v);
        }
    }
    wrap_grid(&mesh, rings, sides, false);
    return mesh;
}

struct srnf_mesh meshes_klein_bottle(size_t rings, size_t sides)
{
    struct srnf_mesh mesh = meshes_blank(rings * sides, 2 * rings * sides);

    for (size_t i = 0; i < rings; i++) {
        for (size_t j = 0; j < sides;
             j++) { /* a figure of eight that makes half a turn on its way round */
            double u = TWO_PI * (double)i / (double)rings, v = TWO_PI * (double)j / (double)sides;
            double *p = mesh.vertices + 3 * (i * sides + j);
            double across = 2.0 + cos(u / 2) * sin(v) - sin(u / 2) * sin(2 * v);

            p[0] = across * cos(u);
            p[1] = across * sin(u);
            p[2] = sin(u / 2) * sin(v) + cos(u / 2) * sin(2 * v);
        }
    }
    wrap_grid(&mesh, rings, sides, true);
    return mesh;
}

struct srnf_mesh meshes_projective_plane(void)
{
    static const double vertices[6][3] = {{0, 0, 1},      {1, 0, 0},       {0.3, 1, 0.1},
                                          {-0.8, 0.6, 0}, {-0.8, -0.6, 0}, {0.3, -1, -0.2}};
    static const uint32_t faces[10][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1},
                                          {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}};

    return from_tables(6, vertices, 10, faces);
}

struct srnf_mesh meshes_sphere_with_hole(size_t frequency)
{
    struct srnf_mesh mesh = meshes_sphere(frequency);

    mesh.n_faces--;
    return mesh;
}

struct srnf_mesh meshes_two_spheres(size_t frequency)
{
    struct srnf_mesh a = meshes_sphere(frequency), b = meshes_sphere(frequency), both;

    meshes_move(&b, 3.0, 0.0, 0.0);
    both = meshes_join(&a, &b);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
    return both;
}

struct srnf_mesh meshes_bowtie(void)
{
    static const double vertices[7][3] = {{0, 0, 0},  {1, 0, 0},  {0, 1, 0}, {0, 0, 1},
                                          {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    static const uint32_t faces[8][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3},
                                         {0, 4, 5}, {0, 6, 4}, {0, 5, 6}, {4, 6, 5}};

    return from_tables(7, vertices, 8, faces);
}

struct srnf_mesh meshes_shared_edge(void)
{
    static const double vertices[6][3] = {{0, 0, 0}, {0, 0, 1},  {1, 0, 0},
                                          {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
    static const uint32_t faces[8][3] = {{0, 1, 3}, {0, 2, 1}, {0, 3, 2}, {1, 2, 3},
                                         {0, 1, 5}, {0, 4, 1}, {0, 5, 4}, {1, 4, 5}};

    return from_tables(6, vertices, 8, faces);
}

struct srnf_mesh meshes_fin(void)
{
    static const double vertices[5][3] = {
        {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, -1, -1}};
    static const uint32_t faces[5][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}, {0, 1, 4}};

    return from_tables(5, vertices, 5, faces);
}

struct srnf_mesh meshes_one_face_turned(size_t frequency)
{
    struct srnf_mesh mesh = meshes_sphere(frequency);
    uint32_t *face = mesh.faces + 21, first = face[0];

    face[0] = face[1];
    face[1] = first;
    return mesh;
}

struct srnf_mesh meshes_flat(void)
{
    static const double vertices[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    static const uint32_t faces[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};

    return from_tables(4, vertices, 4, faces);
}

/* ---- Files ----------------------------------------------------------------------------------- */

bool meshes_load(const char *path, struct srnf_mesh *mesh)
{
    enum { FILE_MAX = 64 << 20 };
    FILE *file = fopen(path, "rb");
    struct srnf_error error = {0};
    unsigned char *bytes;
    size_t size;

    if (!file) {
        return false;
    }
    bytes = malloc(FILE_MAX);
    require(bytes != NULL, "no memory");
    size = fread(bytes, 1, FILE_MAX, file);
    fclose(file);
    if (srnf_mesh_read(bytes, size, SRNF_MESH_UNKNOWN, NULL, mesh, NULL, &error) != SRNF_OK) {
        fprintf(stderr, "%s: ", path);
        require(false, error.message);
    }
    free(bytes);
    return true;
}
