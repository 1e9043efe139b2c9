/*
 * metric.c - the metric of a triangle in space, robust to slivers.
 *
 * The triangle is laid on its longest edge l; its height is at least `sliver` l and the foot of the
 * height lies on the edge; a triangle with l below floor_edge counts as equilateral of that side.
 * So no cotangent exceeds 1 / sliver in size and no area is 0, whatever the mesh. The energy then
 * measures distortion against a triangle that is at worst slightly too fat.
 */
#include "sphere_map.h"

static double distance2(const double *a, const double *b)
{
    double d[3];

    vector_subtract(a, b, d);
    return vector_dot(d, d);
}

void spherical_metric(const struct spherical *s, const double *a, const double *b, const double *c,
                      struct triangle_metric *metric)
{
    /* Squared lengths opposite to a, b, c. */
    double opposite[3] = {distance2(b, c), distance2(c, a), distance2(a, b)};
    size_t apex = 0;
    size_t left;
    size_t right;
    double l;
    double foot;
    double height;

    apex = opposite[1] > opposite[apex] ? 1 : apex;
    apex = opposite[2] > opposite[apex] ? 2 : apex;
    l = sqrt(opposite[apex]);
    if (!(l >= s->floor_edge)) {
        double cot = 1.0 / sqrt(3.0);

        *metric = (struct triangle_metric){{cot, cot, cot},
                                           0.25 * sqrt(3.0) * s->floor_edge * s->floor_edge};
        return;
    }
    left = (apex + 1) % 3;
    right = (apex + 2) % 3;
    /* The foot of the height, from the left end; |left apex|^2 is opposite to the right end. */
    foot = 0.5 * (opposite[apex] + opposite[right] - opposite[left]) / l;
    foot = larger(0.0, smaller(l, foot));
    height = sqrt(larger(0.0, opposite[right] - foot * foot));
    height = larger(height, s->sliver * l);
    metric->area = 0.5 * l * height;
    metric->cot[left] = foot / height;
    metric->cot[right] = (l - foot) / height;
    metric->cot[apex] = (height * height - foot * (l - foot)) / (l * height);
}
