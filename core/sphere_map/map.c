/*
 * map.c - low-distortion bijective map of a closed mesh of genus zero to the unit sphere.
 *
 * Collapse to a tetrahedron, put that on the sphere, take the vertices back one by one, and relax
 * the whole map each time their number has grown by half (relax.c). What is returned has
 * passed an exact orientation test of every face and covers the sphere once. If an attempt fails,
 * the next one of a fixed list runs: other weights of shape in the collapse, then fatter slivers;
 * if all fail the call fails, and no flipped map leaves it.
 *
 * The rotation of the map is made canonical: it depends on the shape of the mesh, not on its pose
 * or numbering. With B = integral over the sphere of f e' and B = U S V', the axes are the columns
 * of V, in the order of the singular values, the first two with the sign that makes the third
 * moment integral |x - c|^2 <x - c, u> over the surface positive. That is a number of the surface
 * alone; its counterpart on the sphere, with e for x - c, is so small that the last digits of the
 * map would choose the sign.
 *
 * Cost: about 10 us a vertex.
 */
#include "sphere_map.h"
#include "linear/linear.h"

#include <string.h>

#define GROWTH 1.5
#define SWEEPS_LEVEL 40
#define SWEEPS_END 300
#define PROGRESS_STEP 4096

static const struct {
    double quality, sliver;
} attempts[] = {{0.1, 0.02}, {0.01, 0.02}, {1.0, 0.02}, {0.1, 0.1}};

/* The four vertices left go to a regular tetrahedron. */
static int place_tetrahedron(struct spherical *s)
{
    double z = -1.0 / 3.0;
    double r = sqrt(8.0) / 3.0;
    uint32_t top = 0;
    const struct ring *ring;
    struct triangle_metric base;

    while (!s->present[top]) {
        top++;
    }
    ring = &s->rings[top];
    if (ring->count != 3) {
        return SRNF_ENUMERIC;
    }
    memcpy(s->points + 3 * (size_t)top, (double[3]){0.0, 0.0, 1.0}, 3 * sizeof(double));
    s->total_area = 0.0;
    for (uint32_t i = 0; i < 3; i++) {
        double phi = 2.0 * SRNF_PI * (double)i / 3.0;
        uint32_t v = ring->at[i];
        uint32_t w = spherical_ring_get(ring, i + 1);
        struct triangle_metric metric;

        memcpy(s->points + 3 * (size_t)v, (double[3]){r * cos(phi), r * sin(phi), z},
               3 * sizeof(double));
        spherical_metric(s, s->positions + 3 * (size_t)top, s->positions + 3 * (size_t)v,
                         s->positions + 3 * (size_t)w, &metric);
        s->total_area += metric.area;
    }
    spherical_metric(s, s->positions + 3 * (size_t)ring->at[0],
                     s->positions + 3 * (size_t)ring->at[2], s->positions + 3 * (size_t)ring->at[1],
                     &base);
    s->total_area += base.area;
    return SRNF_OK;
}

static int grow(struct spherical *s)
{
    double next = 4.0 * GROWTH;
    int status = spherical_relax(s, SWEEPS_LEVEL);

    while (status == SRNF_OK && s->n_present < s->n) {
        status = spherical_insert(s);
        if (status == SRNF_OK && (double)s->n_present >= next) {
            status = spherical_relax(s, SWEEPS_LEVEL);
            next = (double)s->n_present * GROWTH;
            srnf_report_progress(s->context, (double)s->n_present / (double)s->n,
                                 "mapping to the sphere");
        }
        if (status == SRNF_OK && s->n_present % PROGRESS_STEP == 0 &&
            srnf_is_canceled(s->context)) {
            status = SRNF_ECANCELED;
        }
    }
    return status == SRNF_OK ? spherical_relax(s, SWEEPS_END) : status;
}

static int attempt(struct spherical *s)
{
    int status = spherical_rings_build(s);

    if (status == SRNF_OK) {
        status = spherical_collapse(s);
    }
    if (status == SRNF_OK) {
        status = place_tetrahedron(s);
    }
    return status == SRNF_OK ? grow(s) : status;
}

static void clear(struct spherical *s)
{
    spherical_pool_clear(&s->pool);
    spherical_hubs_clear(s);
    srnf_free(s->record);
    srnf_free(s->star);
    s->record = NULL;
    s->record_size = 0;
    s->record_capacity = 0;
    s->star = NULL;
    s->star_capacity = 0;
    memset(s->rings, 0, s->n * sizeof *s->rings);
}

/* ---- Canonical rotation ------------------------------------------------------------------------
   */

/* B by the midpoint rule: sum over faces of solid angle times (f - mean f) e' at the centre. */
static void first_moments(const struct spherical *s, double b[9])
{
    double center[3] = {0.0, 0.0, 0.0};
    double total = 0.0;

    memset(b, 0, 9 * sizeof *b);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < s->mesh->n_faces; i++) {
            const uint32_t *face = s->mesh->faces + 3 * i;
            const double *p[3];
            double x[3] = {0.0, 0.0, 0.0};
            double e[3] = {0.0, 0.0, 0.0};
            double cross[3];
            double weight;
            double length;

            for (size_t k = 0; k < 3; k++) {
                p[k] = s->points + 3 * (size_t)face[k];
                for (size_t j = 0; j < 3; j++) {
                    x[j] += s->positions[3 * (size_t)face[k] + j] / 3.0;
                    e[j] += p[k][j];
                }
            }
            vector_cross(p[1], p[2], cross);
            weight = 2.0 * atan2(vector_dot(p[0], cross), 1.0 + vector_dot(p[0], p[1]) +
                                                              vector_dot(p[1], p[2]) +
                                                              vector_dot(p[2], p[0]));
            if (pass == 0) {
                total += weight;
                for (size_t j = 0; j < 3; j++) {
                    center[j] += weight * x[j];
                }
                continue;
            }
            length = vector_norm(e);
            vector_subtract(x, center, x);
            for (size_t j = 0; j < 3; j++) {
                e[j] /= length;
            }
            for (size_t j = 0; j < 9; j++) {
                b[j] += weight * x[j % 3] * e[j / 3];
            }
        }
        for (size_t j = 0; j < 3 && pass == 0; j++) {
            center[j] /= total;
        }
    }
}

/* Integral over the surface of |x - c|^2 (x - c), c its area centroid, by the midpoint rule. */
static void third_moment(const struct spherical *s, double third[3])
{
    double center[3] = {0.0, 0.0, 0.0};
    double total = 0.0;

    memset(third, 0, 3 * sizeof *third);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < s->mesh->n_faces; i++) {
            const double *p[3];
            double x[3];
            double first[3];
            double second[3];
            double normal[3];
            double weight; /* twice the area */

            for (size_t k = 0; k < 3; k++) {
                p[k] = s->positions + 3 * (size_t)s->mesh->faces[3 * i + k];
            }
            vector_subtract(p[1], p[0], first);
            vector_subtract(p[2], p[0], second);
            vector_cross(first, second, normal);
            weight = vector_norm(normal);
            total += pass == 0 ? weight : 0.0;
            for (size_t j = 0; j < 3; j++) {
                x[j] = (p[0][j] + p[1][j] + p[2][j]) / 3.0 - center[j];
            }
            for (size_t j = 0; j < 3; j++) {
                third[j] += weight * (pass == 0 ? x[j] : vector_dot(x, x) * x[j]);
            }
        }
        for (size_t j = 0; j < 3 && pass == 0; j++) {
            center[j] = third[j] / total;
            third[j] = 0.0;
        }
    }
}

static int make_canonical(struct spherical *s)
{
    double b[9];
    double third[3];
    double singular[3];
    double u[9];
    double vt[9];
    double axes[3][3];

    first_moments(s, b);
    third_moment(s, third);
    if (linear_singular(b, singular, u, vt) != SRNF_OK) {
        return SRNF_ENUMERIC;
    }
    for (size_t k = 0; k < 2; k++) {
        double sign;

        for (size_t j = 0; j < 3; j++) {
            axes[k][j] = vt[k + 3 * j];
        }
        sign = vector_dot(u + 3 * k, third) < 0.0 ? -1.0 : 1.0;
        for (size_t j = 0; j < 3; j++) {
            axes[k][j] *= sign;
        }
    }
    vector_cross(axes[0], axes[1], axes[2]);
    for (size_t i = 0; i < s->n; i++) {
        double *p = s->points + 3 * i;
        double e[3] = {vector_dot(p, axes[0]), vector_dot(p, axes[1]), vector_dot(p, axes[2])};
        double length = vector_norm(e);

        for (size_t j = 0; j < 3; j++) {
            p[j] = e[j] / length;
        }
    }
    return SRNF_OK;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

static int create(struct spherical *s, const struct srnf_mesh *mesh,
                  const struct srnf_context *context)
{
    *s = (struct spherical){.mesh = mesh, .n = mesh->n_vertices, .context = context};
    s->positions = srnf_alloc(3 * s->n, sizeof(double));
    s->points = srnf_alloc(3 * s->n, sizeof(double));
    s->rings = srnf_alloc(s->n, sizeof *s->rings);
    s->present = srnf_alloc(s->n, sizeof *s->present);
    if (!s->positions || !s->points || !s->rings || !s->present) {
        return SRNF_ENOMEM;
    }
    return spherical_normalize(s);
}

static void destroy(struct spherical *s)
{
    if (s->rings) {
        clear(s);
    }
    srnf_free(s->positions);
    srnf_free(s->points);
    srnf_free(s->rings);
    srnf_free(s->present);
}

int srnf_spherical_map(const struct srnf_mesh *mesh, const struct srnf_context *context,
                       struct srnf_spherical_map *map, struct srnf_error *error)
{
    struct spherical s = {0};
    size_t flipped = 0;
    int status;

    *map = (struct srnf_spherical_map){0};
    status = spherical_accept(mesh, error);
    if (status != SRNF_OK) {
        return status;
    }
    status = create(&s, mesh, context);
    for (size_t k = 0; status == SRNF_OK && k < sizeof attempts / sizeof attempts[0]; k++) {
        s.quality = attempts[k].quality;
        s.sliver = attempts[k].sliver;
        status = attempt(&s);
        map->attempts = k + 1;
        if (status == SRNF_OK && !spherical_verify(mesh, s.points, &flipped)) {
            status = SRNF_ENUMERIC;
        }
        if (status != SRNF_ENUMERIC) {
            break;
        }
        clear(&s);
        status = k + 1 < sizeof attempts / sizeof attempts[0] ? SRNF_OK : SRNF_ENUMERIC;
    }
    if (status == SRNF_OK) {
        status = make_canonical(&s);
    }
    /* The rotation rounds: look again. */
    if (status == SRNF_OK && !spherical_verify(mesh, s.points, &map->flipped)) {
        status = SRNF_ENUMERIC;
    }
    if (status == SRNF_OK) {
        struct srnf_distortion distortion;

        spherical_measure(&s, s.points, &distortion);
        map->symmetric_dirichlet = distortion.symmetric_dirichlet;
        map->log_area_deviation = distortion.log_area_deviation;
        map->points = s.points;
        s.points = NULL;
    } else {
        (void)srnf_fail(error, status, -1, "%s",
                        status == SRNF_ENUMERIC
                            ? "no map to the sphere without flipped faces was found"
                            : srnf_strerror(status));
    }
    destroy(&s);
    return status;
}
