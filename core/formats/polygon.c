/*
 * polygon.c - cuts the polygons of a file into triangles, once all its vertices are known.
 *
 * mesh_add_corner lays a polygon down as the fan around its first corner and notes where. Here each
 * one is looked at in the plane of its Newell normal
 *
 *     N = sum_i  p_i x p_(i+1)      (Sutherland, Sproull and Schumacker 1974)
 *
 * and a fan whose triangles all turn the way of N stays as it is: every convex polygon, and every
 * one that its first corner sees whole. The others are cut by clipping ears (Meisters 1975,
 * "Polygons have ears"): a corner that turns the way of N, and whose triangle with its neighbours
 * holds no corner that does not, is cut off, until a triangle is left. Where a cut touches, only
 * the two neighbours are looked at again. The next ear is sought behind the last one, so that long
 * polygons do not become fans of slivers.
 *
 * Whatever the polygon is, n corners give n - 2 triangles, and each of its edges belongs to one of
 * them. A polygon that crosses itself has no right answer and runs out of ears: then the next
 * corner that turns the right way is cut, or just the next. The result depends on nothing but the
 * corners' positions and order.
 *
 * Cost: O(n) for a fan that stays; O(n r) with r corners that turn the other way, for all others.
 * The steps of one file are counted, and one that takes more than STEPS_MAX is refused.
 */
#include "polygon.h"

#include <math.h>
#include <string.h>

/* Steps for all polygons of a file: about two seconds. */
#define STEPS_MAX 400000000
/* Rounding of a cross product of two edges, of the extent times the edges' length: positions in
   the plane have an error of a few units in the last place of the extent. */
#define CROSS_ROUNDING 4e-15

struct polygon_plane {
    const struct srnf_context *context; /* may be NULL */
    size_t n;
    double extent;
    double (*at)[2];        /* positions in the plane of the normal, from the first corner */
    uint32_t *vertex;       /* of each corner, in the mesh */
    uint32_t *next, *prior; /* corners that are left, in a ring */
    unsigned char *flags;
    size_t steps; /* left for this file */
};

enum { TURNS = 1, EAR = 2 }; /* flags of a corner */

int mesh_note_polygon(struct mesh_reader *reader, size_t corners)
{
    if (corners == 4) {
        if (reader->n_polygons == reader->polygon_capacity) {
            size_t capacity = reader->n_polygons + reader->n_polygons / 2 + 64;
            struct mesh_polygon *grown = mesh_alloc(reader, capacity, sizeof *grown);

            if (!grown) {
                return reader->status;
            }
            if (reader->polygons) {
                memcpy(grown, reader->polygons, reader->n_polygons * sizeof *grown);
            }
            mesh_release(reader, reader->polygons, reader->polygon_capacity, sizeof *grown);
            reader->polygons = grown;
            reader->polygon_capacity = capacity;
        }
        reader->polygons[reader->n_polygons++].first_face = reader->mesh.n_faces - 2;
    }
    reader->polygons[reader->n_polygons - 1].corners = corners;
    return SRNF_OK;
}

static void subtract(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++) {
        out[k] = a[k] - b[k];
    }
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Corners of the fan that a polygon was laid down as. */
static void read_fan(struct polygon_plane *plane, const uint32_t *faces)
{
    plane->vertex[0] = faces[0];
    plane->vertex[1] = faces[1];
    for (size_t i = 2; i < plane->n; i++) {
        plane->vertex[i] = faces[3 * (i - 2) + 2];
    }
}

/* Puts the corners into the plane of Newell's normal. False where there is none: all corners on a
   line, or as much area one way round as the other. */
static bool project(struct polygon_plane *plane, const double *vertices)
{
    const double *origin = vertices + 3 * (size_t)plane->vertex[0];
    double normal[3] = {0}, a[3] = {0}, b[3], turn[3], u[3] = {0}, v[3], length;
    int axis = 0;

    plane->extent = 0;
    for (size_t i = 1; i < plane->n; i++) {
        subtract(vertices + 3 * (size_t)plane->vertex[i], origin, b);
        cross(a, b, turn);
        for (int k = 0; k < 3; k++) {
            normal[k] += turn[k];
            a[k] = b[k];
        }
        plane->extent = fmax(plane->extent, sqrt(dot(b, b)));
    }
    length = sqrt(dot(normal, normal));
    if (!isfinite(length) || length <= CROSS_ROUNDING * plane->extent * plane->extent) {
        return false;
    }
    for (int k = 0; k < 3; k++) {
        normal[k] /= length;
        axis = fabs(normal[k]) < fabs(normal[axis]) ? k : axis;
    }
    u[axis] = 1;
    cross(normal, u, v);
    length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++) {
        v[k] /= length;
    }
    cross(v, normal, u);
    for (size_t i = 0; i < plane->n; i++) {
        subtract(vertices + 3 * (size_t)plane->vertex[i], origin, b);
        plane->at[i][0] = dot(b, u);
        plane->at[i][1] = dot(b, v);
    }
    return true;
}

/* Twice the area of a triangle of corners: positive where it turns the way of the normal. */
static double turn(const struct polygon_plane *plane, size_t a, size_t b, size_t c)
{
    const double *p = plane->at[a], *q = plane->at[b], *r = plane->at[c];

    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}

/* What rounding makes of that area. */
static double rounding(const struct polygon_plane *plane, size_t a, size_t b, size_t c)
{
    const double *p = plane->at[a], *q = plane->at[b], *r = plane->at[c];
    double edges = fabs(q[0] - p[0]) + fabs(q[1] - p[1]) + fabs(r[0] - q[0]) + fabs(r[1] - q[1]);

    return CROSS_ROUNDING * plane->extent * edges;
}

static bool turns(const struct polygon_plane *plane, size_t a, size_t b, size_t c)
{
    return turn(plane, a, b, c) > rounding(plane, a, b, c);
}

/* A triangle that stands upright on the plane, as one of a bent polygon may. */
static bool upright(const struct polygon_plane *plane, const double *vertices, size_t i)
{
    const double *origin = vertices + 3 * (size_t)plane->vertex[0];
    double a[3], b[3], area[3];

    subtract(vertices + 3 * (size_t)plane->vertex[i - 1], origin, a);
    subtract(vertices + 3 * (size_t)plane->vertex[i], origin, b);
    cross(a, b, area);
    return fabs(turn(plane, 0, i - 1, i)) <= rounding(plane, 0, i - 1, i) &&
           dot(area, area) > 1e-6 * dot(a, a) * dot(b, b);
}

static bool fan_holds(const struct polygon_plane *plane, const double *vertices)
{
    for (size_t i = 2; i < plane->n; i++) {
        if (!turns(plane, 0, i - 1, i) && !upright(plane, vertices, i)) {
            return false;
        }
    }
    return true;
}

static bool same_place(const struct polygon_plane *plane, size_t a, size_t b)
{
    return plane->at[a][0] == plane->at[b][0] && plane->at[a][1] == plane->at[b][1];
}

/* Is corner p in triangle a b c, its edges taken in? One at the place of a corner is not. */
static bool holds(const struct polygon_plane *plane, size_t a, size_t b, size_t c, size_t p)
{
    return turn(plane, a, b, p) >= 0 && turn(plane, b, c, p) >= 0 && turn(plane, c, a, p) >= 0 &&
           !same_place(plane, a, p) && !same_place(plane, b, p) && !same_place(plane, c, p);
}

static void look_at_turn(struct polygon_plane *plane, size_t corner)
{
    bool is = turns(plane, plane->prior[corner], corner, plane->next[corner]);

    plane->flags[corner] = is ? TURNS : 0;
}

/* Counts a step. False when they are used up, or cutting is to stop. */
static bool step(struct polygon_plane *plane)
{
    return plane->steps-- > 0 && !srnf_asks(plane->context, plane->steps);
}

/* Sets EAR of a corner. False when the steps are used up. */
static bool look_for_ear(struct polygon_plane *plane, size_t corner)
{
    size_t a = plane->prior[corner], c = plane->next[corner], p;

    if (!(plane->flags[corner] & TURNS)) {
        return true;
    }
    plane->flags[corner] |= EAR;
    for (p = plane->next[c]; p != a; p = plane->next[p]) {
        if (!step(plane)) {
            return false;
        }
        if (!(plane->flags[p] & TURNS) && holds(plane, a, corner, c, p)) {
            plane->flags[corner] &= (unsigned char)~EAR;
            break;
        }
    }
    return true;
}

/* The next ear from a corner on; without one, the next corner that turns, or the corner itself.
   SIZE_MAX when the steps are used up. */
static size_t choose_corner(struct polygon_plane *plane, size_t from)
{
    size_t turning = SIZE_MAX, corner = from;

    do {
        if (!step(plane)) {
            return SIZE_MAX;
        }
        if (plane->flags[corner] & EAR) {
            return corner;
        }
        if (turning == SIZE_MAX && (plane->flags[corner] & TURNS)) {
            turning = corner;
        }
        corner = plane->next[corner];
    } while (corner != from);
    return turning == SIZE_MAX ? from : turning;
}

/* Cuts a polygon into the triangles of faces. False when the steps are used up. */
static bool clip_ears(struct polygon_plane *plane, uint32_t *faces)
{
    size_t n = plane->n, corner = 0;

    if (n > plane->steps) { /* so many would not fit next and prior either */
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        plane->next[i] = (uint32_t)((i + 1) % n);
        plane->prior[i] = (uint32_t)((i + n - 1) % n);
    }
    for (size_t i = 0; i < n; i++) {
        look_at_turn(plane, i);
    }
    for (size_t i = 0; i < n; i++) {
        if (!look_for_ear(plane, i)) {
            return false;
        }
    }
    for (size_t left = n; left >= 3; left--) {
        size_t a, c;

        corner = choose_corner(plane, corner);
        if (corner == SIZE_MAX) {
            return false;
        }
        a = plane->prior[corner];
        c = plane->next[corner];
        faces[0] = plane->vertex[a];
        faces[1] = plane->vertex[corner];
        faces[2] = plane->vertex[c];
        faces += 3;
        plane->next[a] = (uint32_t)c;
        plane->prior[c] = (uint32_t)a;
        look_at_turn(plane, a);
        look_at_turn(plane, c);
        if (!look_for_ear(plane, a) || !look_for_ear(plane, c)) {
            return false;
        }
        corner = plane->next[c];
    }
    return true;
}

static size_t most_corners(const struct mesh_reader *reader)
{
    size_t most = 0;

    for (size_t i = 0; i < reader->n_polygons; i++) {
        most = reader->polygons[i].corners > most ? reader->polygons[i].corners : most;
    }
    return most;
}

static int cut_all(struct mesh_reader *reader, struct polygon_plane *plane)
{
    for (size_t i = 0; i < reader->n_polygons; i++) {
        const struct mesh_polygon *polygon = &reader->polygons[i];
        uint32_t *faces = reader->mesh.faces + 3 * polygon->first_face;

        int status = mesh_step(reader);

        if (status != SRNF_OK) {
            return status;
        }
        plane->n = polygon->corners;
        read_fan(plane, faces);
        if (project(plane, reader->mesh.vertices) && !fan_holds(plane, reader->mesh.vertices) &&
            !clip_ears(plane, faces)) {
            return srnf_fail(reader->error, SRNF_ELIMIT, (int64_t)polygon->first_face,
                             "the concave polygons have too many corners to be cut into "
                             "triangles here (one has %zu); triangulate the mesh first",
                             polygon->corners);
        }
    }
    return SRNF_OK;
}

int mesh_cut_polygons(struct mesh_reader *reader)
{
    struct polygon_plane plane = {.context = reader->limits.context, .steps = STEPS_MAX};
    size_t most = most_corners(reader);
    int status = SRNF_OK;

    if (most > 0) {
        plane.at = mesh_alloc(reader, most, sizeof *plane.at);
        plane.vertex = plane.at ? mesh_alloc(reader, most, sizeof *plane.vertex) : NULL;
        plane.next = plane.vertex ? mesh_alloc(reader, most, sizeof *plane.next) : NULL;
        plane.prior = plane.next ? mesh_alloc(reader, most, sizeof *plane.prior) : NULL;
        plane.flags = plane.prior ? mesh_alloc(reader, most, sizeof *plane.flags) : NULL;
        status = plane.flags ? cut_all(reader, &plane) : reader->status;
    }
    mesh_release(reader, plane.flags, most, sizeof *plane.flags);
    mesh_release(reader, plane.prior, most, sizeof *plane.prior);
    mesh_release(reader, plane.next, most, sizeof *plane.next);
    mesh_release(reader, plane.vertex, most, sizeof *plane.vertex);
    mesh_release(reader, plane.at, most, sizeof *plane.at);
    return status;
}
