/*
 * sample.c - a mesh with a spherical parameterization, sampled on the grid.
 *
 * Every spherical triangle (a, b, c) is rasterized: of the nodes inside a cap that holds it, those
 * with
 *   l_a = s . (b x c), l_b = s . (c x a), l_c = s . (a x b) all >= 0
 * lie in it, and the point of the surface is (l_a x_a + l_b x_b + l_c x_c) / (l_a + l_b + l_c):
 * central projection to the flat triangle, then linear. Each node keeps the triangle in which its
 * least normalized l is largest, so that rounding on an edge leaves no gap and the order of the
 * faces does not matter beyond ties, which go to the lower index. Cost: a few tests for each node
 * and face.
 */
#include "sphere_map.h"

/* A node whose best triangle misses it by more than this share is not covered by the map. */
#define GAP 1e-9

/* Of an l, whose rounding is some units of 2^-53, and of an angle. */
#define CLIP_ROUNDING 1e-14
#define ANGLE_ROUNDING 1e-7

/* From so many nodes of a row on it is worth computing which of them a triangle covers. */
#define NODES_CLIPPED ((size_t)12)

/* Faces between two looks at cancellation. */
#define FACES_ASKED ((size_t)64)

struct raster {
    const struct srnf_mesh *mesh;
    const struct srnf_grid *grid;
    const double *points;
    double *values; /* [3][n_theta n_phi] */
    double *score;  /* [n_theta n_phi], best so far */
};

struct triangle {
    const double *corners[3]; /* in space */
    double faces[3][3];       /* b x c, c x a, a x b */
};

static void test_node(struct raster *r, const struct triangle *t, size_t row, size_t column)
{
    const struct srnf_grid *grid = r->grid;
    size_t nodes = grid->n_theta * grid->n_phi;
    size_t node = row * grid->n_phi + column;
    double phi = 2.0 * SRNF_PI * (double)column / (double)grid->n_phi;
    double s[3] = {grid->sin_theta[row] * cos(phi), grid->sin_theta[row] * sin(phi),
                   grid->cos_theta[row]};
    double l[3];
    double sum = 0.0;
    double least;

    for (size_t k = 0; k < 3; k++) {
        l[k] = vector_dot(s, t->faces[k]);
        sum += l[k];
    }
    least = smaller(l[0], smaller(l[1], l[2]));
    if (!(sum > 0.0) || !(least / sum > r->score[node])) {
        return;
    }
    r->score[node] = least / sum;
    for (size_t k = 0; k < 3; k++) {
        r->values[k * nodes + node] =
            (l[0] * t->corners[0][k] + l[1] * t->corners[1][k] + l[2] * t->corners[2][k]) / sum;
    }
}

/* Longitudes [low, high]; empty where low > high. */
struct arc {
    double low, high;
};

/*
 * Cuts the arc down to where the triangle is: along a row each l is A cos(phi - phi_0) + B, which
 * is not negative within acos(-B / A) of phi_0. What is cut off has an l below -GAP times the sum
 * of the three, and so is not covered by this triangle. Where the nonnegative part of an l meets
 * the arc in two pieces, nothing is cut.
 */
static struct arc clip_arc(const struct triangle *t, double sine, double cosine, struct arc arc)
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        sum += vector_norm(t->faces[k]);
    }
    for (size_t k = 0; k < 3; k++) {
        const double *n = t->faces[k];
        double amplitude = sine * sqrt(n[0] * n[0] + n[1] * n[1]);
        double offset = cosine * n[2] + 2.0 * GAP * sum + CLIP_ROUNDING;
        double center, half, turns, low, high;

        if (offset >= amplitude) {
            continue;
        }
        if (offset <= -amplitude) {
            return (struct arc){0.0, -1.0};
        }
        half = acos(-offset / amplitude) + ANGLE_ROUNDING;
        center = atan2(n[1], n[0]);
        /* The turn of it whose centre is nearest to that of the arc. */
        turns = round((0.5 * (arc.low + arc.high) - center) / (2.0 * SRNF_PI));
        low = center + 2.0 * SRNF_PI * turns - half;
        high = center + 2.0 * SRNF_PI * turns + half;
        if (high - 2.0 * SRNF_PI < arc.low && low + 2.0 * SRNF_PI > arc.high) {
            arc.low = larger(arc.low, low);
            arc.high = smaller(arc.high, high);
        }
    }
    return arc;
}

/* Nodes of one row within half_width of the longitude; all of them when that is pi or more. Long
   rows are cut down to what the triangle covers: of a sliver that is next to nothing. */
static void test_row(struct raster *r, const struct triangle *t, size_t row, double longitude,
                     double half_width)
{
    size_t n = r->grid->n_phi;
    double step = 2.0 * SRNF_PI / (double)n;
    struct arc arc = {longitude - half_width, longitude + half_width};
    double first;
    size_t count;

    if (half_width >= SRNF_PI) {
        arc = (struct arc){0.0, 2.0 * SRNF_PI - 0.5 * step};
    }
    if (arc.high - arc.low > (double)NODES_CLIPPED * step) {
        arc = clip_arc(t, r->grid->sin_theta[row], r->grid->cos_theta[row], arc);
    }
    first = ceil(arc.low / step);
    count = (size_t)larger(0.0, floor(arc.high / step) - first + 1.0);
    count = count < n ? count : n;
    for (size_t k = 0; k < count; k++) {
        double wrapped = fmod(first + (double)k, (double)n);

        test_node(r, t, row, (size_t)(wrapped < 0.0 ? wrapped + (double)n : wrapped));
    }
}

/* The cap that holds the triangle: axis and radius; a radius of pi where there is none below 90
   degrees. */
static double bounding_cap(const double *const p[3], double axis[3])
{
    double radius = 0.0;
    double length;

    for (size_t k = 0; k < 3; k++) {
        axis[k] = p[0][k] + p[1][k] + p[2][k];
    }
    length = vector_norm(axis);
    if (!(length > 0.1)) {
        return SRNF_PI;
    }
    for (size_t k = 0; k < 3; k++) {
        axis[k] /= length;
    }
    for (size_t k = 0; k < 3; k++) {
        double difference[3];

        /* 2 asin(|chord| / 2) keeps its digits for small angles. */
        vector_subtract(p[k], axis, difference);
        radius = larger(radius, 2.0 * asin(smaller(1.0, 0.5 * vector_norm(difference))));
    }
    return radius < 0.45 * SRNF_PI ? radius * (1.0 + 1e-9) + 1e-12 : SRNF_PI;
}

static void raster_face(struct raster *r, size_t face)
{
    const uint32_t *v = r->mesh->faces + 3 * face;
    const double *p[3];
    struct triangle t;
    double axis[3] = {0.0, 0.0, 1.0};
    double radius;
    double theta;
    double half_width;

    for (size_t k = 0; k < 3; k++) {
        p[k] = r->points + 3 * (size_t)v[k];
        t.corners[k] = r->mesh->vertices + 3 * (size_t)v[k];
    }
    for (size_t k = 0; k < 3; k++) {
        vector_cross(p[(k + 1) % 3], p[(k + 2) % 3], t.faces[k]);
    }
    radius = bounding_cap(p, axis);
    theta = acos(larger(-1.0, smaller(1.0, axis[2])));
    half_width = radius < theta && radius < SRNF_PI - theta
                     ? asin(smaller(1.0, sin(radius) / sin(theta))) * (1.0 + 1e-9)
                     : SRNF_PI;
    for (size_t row = 0; row < r->grid->n_theta; row++) {
        if (fabs(r->grid->theta[row] - theta) <= radius + 1e-9) {
            test_row(r, &t, row, atan2(axis[1], axis[0]), half_width);
        }
    }
}

int spherical_sample(const struct srnf_mesh *mesh, const double *points,
                     const struct srnf_grid *grid, const struct srnf_context *context,
                     double *values)
{
    size_t nodes = grid->n_theta * grid->n_phi;
    struct raster raster = {mesh, grid, points, values, srnf_alloc(nodes, sizeof(double))};
    int status = SRNF_OK;

    if (!raster.score) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < nodes; i++) {
        raster.score[i] = -INFINITY;
    }
    for (size_t face = 0; face < mesh->n_faces && status == SRNF_OK; face++) {
        raster_face(&raster, face);
        if (face % FACES_ASKED == 0 && srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
        }
    }
    for (size_t i = 0; i < nodes && status == SRNF_OK; i++) {
        status = raster.score[i] > -GAP ? SRNF_OK : SRNF_ENUMERIC;
    }
    srnf_free(raster.score);
    return status;
}
