/*
 * triangulations.c - triangulations for tests; see triangulations.h.
 */
#include "support/triangulations.h"

#include "support/meshes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TWO_PI 6.28318530717958647693

static void require(bool condition, const char *what)
{
    if (!condition) {
        fprintf(stderr, "triangulations: %s\n", what);
        abort();
    }
}

static void set_face(struct srnf_mesh *mesh, size_t face, size_t a, size_t b, size_t c)
{
    mesh->faces[3 * face] = (uint32_t)a;
    mesh->faces[3 * face + 1] = (uint32_t)b;
    mesh->faces[3 * face + 2] = (uint32_t)c;
}

static void set_vertex(struct srnf_mesh *mesh, size_t v, double x, double y, double z)
{
    mesh->vertices[3 * v] = x;
    mesh->vertices[3 * v + 1] = y;
    mesh->vertices[3 * v + 2] = z;
}

/* ---- Large and small valences ---------------------------------------------------------------- */

static void set_rim(struct srnf_mesh *mesh, size_t first, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        double phi = TWO_PI * (double)i / (double)count;

        set_vertex(mesh, first + i, cos(phi), sin(phi), 0.0);
    }
}

struct srnf_mesh triangulations_bipyramid(size_t rim)
{
    struct srnf_mesh mesh = meshes_blank(rim + 2, 2 * rim);

    set_vertex(&mesh, 0, 0.0, 0.0, 1.0);
    set_vertex(&mesh, 1, 0.0, 0.0, -1.0);
    set_rim(&mesh, 2, rim);
    for (size_t i = 0; i < rim; i++) {
        size_t next = (i + 1) % rim;

        set_face(&mesh, 2 * i, 0, 2 + i, 2 + next);
        set_face(&mesh, 2 * i + 1, 1, 2 + next, 2 + i);
    }
    return mesh;
}

struct srnf_mesh triangulations_fan(size_t valence)
{
    struct srnf_mesh mesh = meshes_blank(valence + 1, 2 * valence - 2);
    size_t low = 0;
    size_t high = valence - 1;
    size_t face = valence;

    set_vertex(&mesh, 0, 0.0, 0.0, 0.5);
    set_rim(&mesh, 1, valence);
    for (size_t i = 0; i < valence; i++) {
        set_face(&mesh, i, 0, 1 + i, 1 + (i + 1) % valence);
    }
    for (bool left = true; high - low > 1; left = !left) {
        set_face(&mesh, face++, 1 + low, 1 + high, left ? 2 + low : high);
        low += left;
        high -= !left;
    }
    require(face == mesh.n_faces, "a fan whose faces do not add up");
    return mesh;
}

struct srnf_mesh triangulations_stacked(size_t n, bool newest, struct test_random *random)
{
    const double a = sqrt(1.0 / 3.0);
    struct srnf_mesh mesh = meshes_blank(n, 2 * n - 4);
    size_t faces = 4;

    set_vertex(&mesh, 0, a, a, a);
    set_vertex(&mesh, 1, a, -a, -a);
    set_vertex(&mesh, 2, -a, a, -a);
    set_vertex(&mesh, 3, -a, -a, a);
    set_face(&mesh, 0, 0, 1, 2);
    set_face(&mesh, 1, 0, 2, 3);
    set_face(&mesh, 2, 0, 3, 1);
    set_face(&mesh, 3, 1, 3, 2);
    for (size_t v = 4; v < n; v++) {
        size_t f = newest && v > 4 ? faces - 1 - test_random_below(random, 2)
                                   : test_random_below(random, faces);
        const uint32_t corner[3] = {mesh.faces[3 * f], mesh.faces[3 * f + 1],
                                    mesh.faces[3 * f + 2]};
        double x[3];

        for (size_t k = 0; k < 3; k++) {
            x[k] = mesh.vertices[3 * corner[0] + k] + mesh.vertices[3 * corner[1] + k] +
                   mesh.vertices[3 * corner[2] + k];
        }
        double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);

        set_vertex(&mesh, v, x[0] / length, x[1] / length, x[2] / length);
        set_face(&mesh, f, corner[0], corner[1], v);
        set_face(&mesh, faces++, corner[1], corner[2], v);
        set_face(&mesh, faces++, corner[2], corner[0], v);
    }
    return mesh;
}

/* ---- Tubes ----------------------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Makes normal a unit vector at right angles to the unit vector tangent, turning it little. */
static void transport(const double tangent[3], double normal[3])
{
    double along = dot(tangent, normal);
    double length;

    for (size_t k = 0; k < 3; k++) {
        normal[k] -= along * tangent[k];
    }
    length = sqrt(dot(normal, normal));
    for (size_t k = 0; k < 3; k++) {
        normal[k] /= length;
    }
}

static void tube_ring(struct srnf_mesh *mesh, size_t first, size_t sides, const double center[3],
                      const double tangent[3], const double normal[3], double radius)
{
    for (size_t j = 0; j < sides; j++) {
        double phi = TWO_PI * (double)j / (double)sides;

        for (size_t k = 0; k < 3; k++) {
            size_t k1 = (k + 1) % 3;
            size_t k2 = (k + 2) % 3;
            double binormal = tangent[k1] * normal[k2] - tangent[k2] * normal[k1];

            mesh->vertices[3 * (first + j) + k] =
                center[k] + radius * (cos(phi) * normal[k] + sin(phi) * binormal);
        }
    }
}

static void tube_faces(struct srnf_mesh *mesh, size_t rings, size_t sides)
{
    size_t start = rings * sides;
    size_t end = start + 1;
    size_t face = 0;

    for (size_t j = 0; j < sides; j++) {
        size_t next = (j + 1) % sides;

        set_face(mesh, face++, start, next, j);
        set_face(mesh, face++, end, (rings - 1) * sides + j, (rings - 1) * sides + next);
        for (size_t i = 0; i + 1 < rings; i++) {
            size_t p = i * sides;

            set_face(mesh, face++, p + j, p + next, p + sides + j);
            set_face(mesh, face++, p + next, p + sides + next, p + sides + j);
        }
    }
}

struct srnf_mesh triangulations_tube(void (*path)(double t, double x[3]),
                                     double (*radius)(double t), size_t rings, size_t sides)
{
    struct srnf_mesh mesh = meshes_blank(rings * sides + 2, 2 * rings * sides);
    double normal[3] = {0.3, 0.5, 0.8};

    for (size_t i = 0; i < rings; i++) {
        double t = (double)i / (double)(rings - 1);
        double before[3];
        double center[3];
        double after[3];
        double tangent[3];
        double length;

        path(t, center);
        path(t - 1e-4, before);
        path(t + 1e-4, after);
        for (size_t k = 0; k < 3; k++) {
            tangent[k] = after[k] - before[k];
        }
        length = sqrt(dot(tangent, tangent));
        for (size_t k = 0; k < 3; k++) {
            tangent[k] /= length;
        }
        transport(tangent, normal);
        tube_ring(&mesh, i * sides, sides, center, tangent, normal, radius(t));
    }
    path(0.0, mesh.vertices + 3 * rings * sides);
    path(1.0, mesh.vertices + 3 * (rings * sides + 1));
    tube_faces(&mesh, rings, sides);
    return mesh;
}

/* ---- Changes at random ----------------------------------------------------------------------- */

static uint32_t next_corner(uint32_t corner)
{
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}

static uint32_t previous_corner(uint32_t corner)
{
    return corner % 3 == 0 ? corner + 2 : corner - 1;
}

/* Corner c stands for the edge from its vertex to the next; mate[c] is the corner of the same edge
   run the other way. To be freed with srnf_free. */
static uint32_t *mates(const struct srnf_mesh *mesh)
{
    size_t n = 3 * mesh->n_faces;
    uint32_t *first = srnf_alloc(mesh->n_vertices + 2, sizeof *first);
    uint32_t *from = srnf_alloc(n, sizeof *from);
    uint32_t *mate = srnf_alloc(n, sizeof *mate);

    require(first && from && mate, "no memory");
    for (size_t c = 0; c < n; c++) {
        first[mesh->faces[c] + 2]++;
    }
    for (size_t v = 1; v < mesh->n_vertices + 2; v++) {
        first[v] += first[v - 1];
    }
    for (uint32_t c = 0; c < n; c++) {
        from[first[mesh->faces[c] + 1]++] = c;
    }
    for (uint32_t c = 0; c < n; c++) {
        uint32_t a = mesh->faces[c];
        uint32_t b = mesh->faces[next_corner(c)];
        uint32_t i = first[b];

        while (i < first[b + 1] && mesh->faces[next_corner(from[i])] != a) {
            i++;
        }
        require(i < first[b + 1], "a mesh that is not closed");
        mate[c] = from[i];
    }
    srnf_free(from);
    srnf_free(first);
    return mate;
}

struct srnf_mesh triangulations_subdivided(const struct srnf_mesh *mesh)
{
    struct srnf_mesh fine =
        meshes_blank(mesh->n_vertices + 3 * mesh->n_faces / 2, 4 * mesh->n_faces);
    uint32_t *mate = mates(mesh);
    uint32_t *middle = srnf_alloc(3 * mesh->n_faces, sizeof *middle);
    uint32_t next = (uint32_t)mesh->n_vertices;

    require(middle != NULL, "no memory");
    memcpy(fine.vertices, mesh->vertices, 3 * mesh->n_vertices * sizeof(double));
    for (uint32_t c = 0; c < 3 * mesh->n_faces; c++) {
        const double *a = mesh->vertices + 3 * (size_t)mesh->faces[c];
        const double *b = mesh->vertices + 3 * (size_t)mesh->faces[next_corner(c)];

        if (mate[c] < c) {
            middle[c] = middle[mate[c]];
            continue;
        }
        set_vertex(&fine, next, 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]));
        middle[c] = next++;
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const uint32_t *v = mesh->faces + 3 * f;
        const uint32_t *m = middle + 3 * f;

        for (size_t k = 0; k < 3; k++) {
            set_face(&fine, 4 * f + k, v[k], m[k], m[(k + 2) % 3]);
        }
        set_face(&fine, 4 * f + 3, m[0], m[1], m[2]);
    }
    srnf_free(middle);
    srnf_free(mate);
    return fine;
}

/* Is there an edge from the vertex of this corner to `other`? Walks once around it. */
static bool is_neighbor(const struct srnf_mesh *mesh, const uint32_t *mate, uint32_t corner,
                        uint32_t other)
{
    uint32_t at = corner;

    do {
        if (mesh->faces[next_corner(at)] == other) {
            return true;
        }
        at = mate[previous_corner(at)];
    } while (at != corner);
    return false;
}

static void join(uint32_t *mate, uint32_t a, uint32_t b)
{
    mate[a] = b;
    mate[b] = a;
}

/* The edge a b of the faces (a, b, p) and (b, a, q) gives way to p q, if that is a new edge. */
static void flip(struct srnf_mesh *mesh, uint32_t *mate, uint32_t corner)
{
    uint32_t other = mate[corner];
    uint32_t a = mesh->faces[corner];
    uint32_t b = mesh->faces[other];
    uint32_t p = mesh->faces[previous_corner(corner)];
    uint32_t q = mesh->faces[previous_corner(other)];
    uint32_t beyond_bp = mate[next_corner(corner)];
    uint32_t beyond_pa = mate[previous_corner(corner)];
    uint32_t beyond_aq = mate[next_corner(other)];
    uint32_t beyond_qb = mate[previous_corner(other)];

    if (is_neighbor(mesh, mate, previous_corner(corner), q)) {
        return;
    }
    mesh->faces[corner] = a;
    mesh->faces[next_corner(corner)] = q;
    mesh->faces[previous_corner(corner)] = p;
    mesh->faces[other] = b;
    mesh->faces[next_corner(other)] = p;
    mesh->faces[previous_corner(other)] = q;
    join(mate, corner, beyond_aq);
    join(mate, next_corner(corner), next_corner(other));
    join(mate, previous_corner(corner), beyond_pa);
    join(mate, other, beyond_bp);
    join(mate, previous_corner(other), beyond_qb);
}

void triangulations_flip_edges(struct srnf_mesh *mesh, size_t tries, struct test_random *random)
{
    uint32_t *mate = mates(mesh);

    for (size_t i = 0; i < tries; i++) {
        flip(mesh, mate, (uint32_t)test_random_below(random, 3 * mesh->n_faces));
    }
    srnf_free(mate);
}

/* A permutation of 0 .. n - 1, to be freed with srnf_free. */
static uint32_t *permutation(size_t n, struct test_random *random)
{
    uint32_t *order = srnf_alloc(n, sizeof *order);

    require(order != NULL, "no memory");
    for (size_t i = 0; i < n; i++) {
        size_t j = test_random_below(random, i + 1);

        order[i] = order[j];
        order[j] = (uint32_t)i;
    }
    return order;
}

void triangulations_renumber(struct srnf_mesh *mesh, uint32_t *new_index,
                             struct test_random *random)
{
    struct srnf_mesh old = meshes_copy(mesh);
    uint32_t *vertex = permutation(mesh->n_vertices, random);
    uint32_t *face = permutation(mesh->n_faces, random);

    for (size_t v = 0; v < mesh->n_vertices; v++) {
        memcpy(mesh->vertices + 3 * (size_t)vertex[v], old.vertices + 3 * v, 3 * sizeof(double));
    }
    for (size_t f = 0; f < mesh->n_faces; f++) {
        size_t turn = test_random_below(random, 3);

        for (size_t k = 0; k < 3; k++) {
            mesh->faces[3 * (size_t)face[f] + k] = vertex[old.faces[3 * f + (k + turn) % 3]];
        }
    }
    if (new_index) {
        memcpy(new_index, vertex, mesh->n_vertices * sizeof *vertex);
    }
    srnf_free(face);
    srnf_free(vertex);
    srnf_mesh_clear(&old);
}

void triangulations_jitter(struct srnf_mesh *mesh, double deviation, struct test_random *random)
{
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        mesh->vertices[i] += deviation * test_random_normal(random);
    }
}
