/*
 * likeness.c - the figures by which members of a group repeat, stand out, are mirrored or turned
 * (srnf/likeness.h).
 *
 * The distance from the mean of the others follows from Huygens' theorem: the sum of the squared
 * distances from a point to n - 1 others is n - 1 times that from their mean, and the sum of their
 * squares about it, which is that over their pairs divided by n - 1. The sum over the others' pairs
 * is that over all pairs less those of member i, so the cost is n^2.
 */
#include "stats.h"

#include <math.h>
#include <string.h>

#include "srnf/likeness.h"

#define MIRRORED 0.8    /* of the distance as it is, below which another match is much nearer */
#define TURNED_BACK 0.5 /* the same of turning back */
#define TURNED (30.0 * 3.14159265358979323846 / 180.0)

bool srnf_match_is_mirrored(const struct srnf_match *match)
{
    return match->mirrored < MIRRORED * match->plain;
}

bool srnf_match_is_turned(const struct srnf_match *match)
{
    return match->angle > TURNED && match->plain < TURNED_BACK * match->unturned;
}

double srnf_rotation_angle(const double rotation[9])
{
    double cosine = 0.5 * (rotation[0] + rotation[4] + rotation[8] - 1.0);

    return acos(fmax(-1.0, fmin(1.0, cosine)));
}

size_t srnf_medoid(size_t n, const double *distances, const size_t *classes, size_t which,
                   const bool *taken)
{
    size_t best = n;
    double least = INFINITY;

    for (size_t i = 0; i < n; i++) {
        double sum = 0.0;

        if ((classes && classes[i] != which) || (taken && taken[i])) {
            continue;
        }
        for (size_t j = 0; j < n; j++) {
            sum += !classes || classes[j] == which ? distances[i * n + j] : 0.0;
        }
        if (sum < least) {
            least = sum;
            best = i;
        }
    }
    return best;
}

void srnf_distances_from_others(size_t n, const double *distances, double *values)
{
    double all = 0.0;

    for (size_t i = 0; i < n; i++) {
        values[i] = 0.0;
        for (size_t j = 0; j < n; j++) {
            values[i] += distances[i * n + j] * distances[i * n + j];
        }
        all += 0.5 * values[i];
    }
    for (size_t i = 0; i < n; i++) {
        double others = (double)(n - 1);
        double square = values[i] / others - (all - values[i]) / (others * others);

        values[i] = square > 0.0 ? sqrt(square) : 0.0;
    }
}

int srnf_members_judge(size_t n, const double *distances, struct srnf_typicality *verdicts)
{
    double *values, *others;
    int status = SRNF_OK;

    if (n < 4) {
        return SRNF_EINVAL;
    }
    values = srnf_alloc(n, 2 * sizeof(double));
    if (!values) {
        return SRNF_ENOMEM;
    }
    others = values + n;
    srnf_distances_from_others(n, distances, values);
    for (size_t i = 0; i < n && status == SRNF_OK; i++) {
        memcpy(others, values, i * sizeof(double));
        memcpy(others + i, values + i + 1, (n - i - 1) * sizeof(double));
        status = srnf_typicality_of(SRNF_TRAIT_DISTANCE, n - 1, others, NULL, values[i],
                                    SRNF_TYPICAL_ALPHA_GROUP, &verdicts[i]);
    }
    srnf_free(values);
    return status;
}
