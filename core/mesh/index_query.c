/*
 * index_query.c - questions to the spatial index: the farthest hit of a ray, the nearest point.
 *
 * Rays. A ray is turned into the z axis by a shear (S. Woop, C. Benthin, I. Wald, "Watertight
 * Ray/Triangle Intersection", JCGT 2(1), 2013): each vertex gets coordinates (x, y) across the ray
 * that depend on that vertex only, and a face is hit when the origin lies in its projection,
 * boundary included. That is decided by the signs of three edge functions a x b, and both faces of
 * an edge compute the same one but for its sign. Rounding is monotone, so a computed sign is never
 * wrong, but it may vanish without cause, and a sliver of which all three vanish would pass for
 * edge-on and leave a gap. Where products cancel, their remainders are therefore added by fma,
 * which makes the signs exact. (This relies on -ffp-contract=off, with which core/mesh is built.)
 * So the projected faces of a closed mesh cover the origin without a gap, and no ray slips through
 * an edge or vertex. Faces seen edge-on have no inside and are left to their neighbours.
 *
 * Boxes are enlarged by what rounding in the shear can move a vertex, so that no box is missed
 * whose face is hit.
 *
 * Nearest point. Each face is compared by its plane where the foot of the perpendicular falls
 * inside, and by its edges otherwise; slivers by their edges only. Boxes farther than the best so
 * far are skipped.
 *
 * Cost: O(log n) boxes, slivers or not (index.c); no more than all of them on any mesh.
 */
#include "index.h"

#include <float.h>

/* Rounding of the shear, in units of the largest coordinate difference, with room to spare. */
#define RAY_PADDING (32.0 * DBL_EPSILON)

/* Paddings that a box along axes of its own has: its coordinates are sums of three products. */
#define OWN_AXES 4.0

/* Height of a face, relative to its longest edge, below which its plane means nothing. */
#define SLIVER_HEIGHT 1e-12

/* ---- Rays ------------------------------------------------------------------------------------ */

struct ray {
    double origin[3], direction[3];
    size_t x, y, z; /* axes; z is the one along which the direction is longest */
    double shear_x, shear_y, scale;
    double padding; /* of boxes */
};

static bool ray_prepare(const struct srnf_index *index, const double origin[3],
                        const double direction[3], struct ray *ray)
{
    const struct index_node *root = &index->nodes[0];
    double reach = 0.0;

    *ray = (struct ray){.z = 0};
    for (size_t k = 0; k < 3; k++) {
        if (!(fabs(origin[k]) <= SRNF_MESH_COORDINATE_MAX &&
              fabs(direction[k]) <= SRNF_MESH_COORDINATE_MAX)) {
            return false;
        }
        ray->origin[k] = origin[k];
        ray->direction[k] = direction[k];
        reach =
            larger(reach, larger(fabs(root->low[k] - origin[k]), fabs(root->high[k] - origin[k])));
        ray->z = fabs(direction[k]) > fabs(direction[ray->z]) ? k : ray->z;
    }
    if (!(fabs(direction[ray->z]) >= 1.0 / SRNF_MESH_COORDINATE_MAX)) {
        return false;
    }
    ray->x = (ray->z + 1) % 3;
    ray->y = (ray->z + 2) % 3;
    ray->shear_x = direction[ray->x] / direction[ray->z];
    ray->shear_y = direction[ray->y] / direction[ray->z];
    ray->scale = 1.0 / direction[ray->z];
    ray->padding = RAY_PADDING * reach;
    return true;
}

/* Largest t >= 0 at which the ray is in the enlarged box; negative when it misses. */
static double ray_leaves_box(const struct srnf_index *index, const struct ray *ray,
                             const struct index_node *node)
{
    double enter = 0.0, leave = INFINITY;

    for (size_t k = 0; k < 3; k++) {
        double low = node->low[k] - ray->padding - ray->origin[k];
        double high = node->high[k] + ray->padding - ray->origin[k];
        double d = ray->direction[k];

        if (d == 0.0) {
            if (low > 0.0 || high < 0.0) {
                return -1.0;
            }
            continue;
        }
        enter = larger(enter, (d > 0.0 ? low : high) / d);
        leave = smaller(leave, (d > 0.0 ? high : low) / d);
    }
    if (node->box > 0 && enter <= leave) {
        index_box_clip(&index->boxes[node->box - 1], ray->origin, ray->direction,
                       OWN_AXES * ray->padding, &enter, &leave);
    }
    return enter <= leave ? leave : -1.0;
}

/* a[0] b[1] - a[1] b[0] with its exact sign; swapping a and b changes the sign and nothing else. */
static double edge_function(const double a[3], const double b[3])
{
    double left = a[0] * b[1], right = a[1] * b[0];
    double difference = left - right;

    if (fabs(difference) <= 4.0 * DBL_EPSILON * (fabs(left) + fabs(right))) {
        difference += fma(a[0], b[1], -left) - fma(a[1], b[0], -right);
    }
    return difference;
}

static bool ray_hits_face(const struct ray *ray, const struct srnf_mesh *mesh, size_t face,
                          double *t)
{
    double corner[3][3], edge[3], sum = 0.0, depth = 0.0, nearest = INFINITY, farthest = -INFINITY;
    bool positive = false, negative = false;

    for (size_t i = 0; i < 3; i++) {
        const double *vertex = mesh_corner(mesh, face, i);
        double z = vertex[ray->z] - ray->origin[ray->z];

        corner[i][0] = vertex[ray->x] - ray->origin[ray->x] - ray->shear_x * z;
        corner[i][1] = vertex[ray->y] - ray->origin[ray->y] - ray->shear_y * z;
        corner[i][2] = ray->scale * z;
        nearest = smaller(nearest, corner[i][2]);
        farthest = larger(farthest, corner[i][2]);
    }
    for (size_t i = 0; i < 3; i++) {
        edge[i] = edge_function(corner[(i + 1) % 3], corner[(i + 2) % 3]);
        positive |= edge[i] > 0.0;
        negative |= edge[i] < 0.0;
        sum += edge[i];
    }
    if (positive == negative) { /* outside, or edge-on */
        return false;
    }
    for (size_t i = 0; i < 3; i++) {
        depth += edge[i] / sum * corner[i][2];
    }
    *t = smaller(larger(depth, nearest), farthest);
    return *t >= 0.0;
}

bool srnf_index_ray(const struct srnf_index *index, const double origin[3],
                    const double direction[3], double *t, uint32_t *face)
{
    struct waiting {
        uint32_t node;
        double leave;
    } stack[INDEX_DEPTH_MAX];
    struct ray ray;
    double best = -1.0;
    uint32_t best_face = 0;
    size_t depth = 0;

    if (!ray_prepare(index, origin, direction, &ray)) {
        return false;
    }
    stack[depth++] = (struct waiting){0, ray_leaves_box(index, &ray, &index->nodes[0])};
    while (depth > 0) {
        struct waiting top = stack[--depth];
        const struct index_node *node = &index->nodes[top.node];

        if (top.leave < 0.0 || top.leave < best) {
            continue;
        }
        for (size_t i = 0; i < node->count; i++) {
            uint32_t candidate = index->order[node->start + i];
            double hit;

            if (ray_hits_face(&ray, index->mesh, candidate, &hit) &&
                (hit > best || (hit == best && candidate < best_face))) {
                best = hit;
                best_face = candidate;
            }
        }
        if (node->count == 0) {
            struct waiting a = {top.node + 1, ray_leaves_box(index, &ray, node + 1)};
            struct waiting b = {node->second,
                                ray_leaves_box(index, &ray, &index->nodes[node->second])};
            bool b_last = b.leave > a.leave; /* the farther one is looked at first */

            stack[depth++] = b_last ? a : b;
            stack[depth++] = b_last ? b : a;
        }
    }
    if (best < 0.0) {
        return false;
    }
    *t = best;
    if (face) {
        *face = best_face;
    }
    return true;
}

/* ---- Nearest point --------------------------------------------------------------------------- */

static double box_distance2(const struct srnf_index *index, const struct index_node *node,
                            const double point[3])
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double outside = point[k] - larger(node->low[k], smaller(point[k], node->high[k]));

        sum += outside * outside;
    }
    if (node->box > 0) {
        sum = larger(sum, index_box_distance2(&index->boxes[node->box - 1], point));
    }
    return sum;
}

/* Takes candidate as the nearest point when it is nearer than what *best says. */
static void consider(const double candidate[3], const double point[3], double *best,
                     double nearest[3])
{
    double difference[3], distance2;

    vector_subtract(candidate, point, difference);
    distance2 = vector_dot(difference, difference);
    if (distance2 < *best) {
        *best = distance2;
        nearest[0] = candidate[0];
        nearest[1] = candidate[1];
        nearest[2] = candidate[2];
    }
}

static void consider_segment(const double a[3], const double b[3], const double point[3],
                             double *best, double nearest[3])
{
    double along[3], from[3], candidate[3], length2, share = 0.0;

    vector_subtract(b, a, along);
    vector_subtract(point, a, from);
    length2 = vector_dot(along, along);
    if (length2 > 0.0) {
        share = smaller(larger(vector_dot(along, from) / length2, 0.0), 1.0);
    }
    for (size_t k = 0; k < 3; k++) {
        candidate[k] = share < 1.0 ? a[k] + share * along[k] : b[k];
    }
    consider(candidate, point, best, nearest);
}

/* The edges of the face on which what is nearest may lie, as bits; edge k goes from corner k to the
   next. It lies on one that the foot of the perpendicular is beyond. None: that foot was tried, for
   it is in the face. All: the face is a sliver. */
static unsigned consider_plane(const double *const corner[3], const double point[3], double *best,
                               double nearest[3])
{
    double ab[3], ac[3], ap[3], normal[3], cross[3], candidate[3], normal2, longest2, v, w;

    vector_subtract(corner[1], corner[0], ab);
    vector_subtract(corner[2], corner[0], ac);
    vector_subtract(point, corner[0], ap);
    vector_cross(ab, ac, normal);
    normal2 = vector_dot(normal, normal);
    longest2 = larger(vector_dot(ab, ab), vector_dot(ac, ac));
    if (!(normal2 > SLIVER_HEIGHT * SLIVER_HEIGHT * longest2 * longest2)) {
        return 7;
    }
    vector_cross(ap, ac, cross);
    v = vector_dot(cross, normal) / normal2;
    vector_cross(ab, ap, cross);
    w = vector_dot(cross, normal) / normal2;
    if (!(v >= 0.0 && w >= 0.0 && v + w <= 1.0)) {
        return (w >= 0.0 ? 0U : 1U) | (v + w <= 1.0 ? 0U : 2U) | (v >= 0.0 ? 0U : 4U);
    }
    for (size_t k = 0; k < 3; k++) {
        candidate[k] = corner[0][k] + v * ab[k] + w * ac[k];
    }
    consider(candidate, point, best, nearest);
    return 0;
}

/* At most the squared distance of the point from the face. */
static double bound_distance2(const double *const corner[3], const double point[3])
{
    double sum = 0.0;

    for (size_t k = 0; k < 3; k++) {
        double low = smaller(corner[0][k], smaller(corner[1][k], corner[2][k]));
        double high = larger(corner[0][k], larger(corner[1][k], corner[2][k]));
        double outside = point[k] - larger(low, smaller(point[k], high));

        sum += outside * outside;
    }
    return sum;
}

static void consider_face(const struct srnf_mesh *mesh, uint32_t face, const double point[3],
                          double *best, double nearest[3])
{
    const double *const corner[3] = {mesh_corner(mesh, face, 0), mesh_corner(mesh, face, 1),
                                     mesh_corner(mesh, face, 2)};

    unsigned edges;

    if (bound_distance2(corner, point) >= *best) {
        return;
    }
    edges = consider_plane(corner, point, best, nearest);
    for (size_t k = 0; k < 3; k++) {
        if (edges >> k & 1U) {
            consider_segment(corner[k], corner[(k + 1) % 3], point, best, nearest);
        }
    }
}

struct waiting {
    uint32_t node;
    double distance2;
};

/* What is pushed lies nearer than *best. */
static size_t push(struct waiting *stack, size_t depth, struct waiting one, double best)
{
    if (one.distance2 < best) {
        stack[depth++] = one;
    }
    return depth;
}

/* Looks for what is nearer than *best says. */
static void look_nearer(const struct srnf_index *index, const double point[3], double *best,
                        double nearest[3], uint32_t *face)
{
    struct waiting stack[INDEX_DEPTH_MAX];
    size_t depth = 0;

    stack[depth++] = (struct waiting){0, 0.0};
    while (depth > 0) {
        struct waiting top = stack[--depth];
        const struct index_node *node = &index->nodes[top.node];

        if (top.distance2 >= *best) {
            continue;
        }
        for (size_t i = 0; i < node->count; i++) {
            double before = *best;

            consider_face(index->mesh, index->order[node->start + i], point, best, nearest);
            *face = *best < before ? index->order[node->start + i] : *face;
        }
        if (node->count == 0) {
            struct waiting a = {top.node + 1, box_distance2(index, node + 1, point)};
            struct waiting b = {node->second,
                                box_distance2(index, &index->nodes[node->second], point)};
            bool b_last = b.distance2 < a.distance2; /* the nearer one is looked at first */

            depth = push(stack, depth, b_last ? a : b, *best);
            depth = push(stack, depth, b_last ? b : a, *best);
        }
    }
}

double srnf_index_distance2(const struct srnf_index *index, const double point[3],
                            double nearest[3], uint32_t *face)
{
    double best = INFINITY, found[3] = {0.0, 0.0, 0.0};
    uint32_t best_face = 0;

    look_nearer(index, point, &best, found, &best_face);
    for (size_t k = 0; nearest && k < 3; k++) {
        nearest[k] = found[k];
    }
    if (face) {
        *face = best_face;
    }
    return best;
}

double index_distance2_from(const struct srnf_index *index, const double point[3],
                            double nearest[3], uint32_t *face)
{
    double best = INFINITY;

    consider_face(index->mesh, *face, point, &best, nearest);
    look_nearer(index, point, &best, nearest, face);
    return best;
}
