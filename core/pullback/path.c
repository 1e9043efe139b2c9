/*
 * path.c - figures of a path, and the small parts that several files of the pulled-back
 * metric need.
 */
#include "pullback.h"

#include <math.h>

int pullback_chain(size_t nodes, size_t **parents, bool **fixed)
{
    *parents = srnf_alloc(nodes, sizeof **parents);
    *fixed = srnf_alloc(nodes, sizeof **fixed);
    if (!*parents || !*fixed) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < nodes; i++) {
        (*parents)[i] = i + 1 < nodes ? i + 1 : PULLBACK_ROOT;
        (*fixed)[i] = i == 0 || i + 1 == nodes;
    }
    return SRNF_OK;
}

void pullback_mix(size_t n, double t, const double *a, const double *b, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = (1.0 - t) * a[i] + t * b[i];
    }
}

double pullback_distance(const struct srnf_grid *grid, const double *a, const double *b,
                         double *difference)
{
    for (size_t i = 0; i < 3 * grid->n_theta * grid->n_phi; i++) {
        difference[i] = a[i] - b[i];
    }
    return sqrt(srnf_inner_product(grid, difference, difference));
}

/* From the lengths of the segments. */
static void summarize(size_t segments, const double *lengths, struct srnf_path_figures *figures)
{
    double m = (double)segments;
    double square = 0.0;
    double deviation = 0.0;

    *figures = (struct srnf_path_figures){0};
    for (size_t k = 0; k < segments; k++) {
        figures->length += lengths[k];
        square += lengths[k] * lengths[k];
    }
    for (size_t k = 0; k < segments; k++) {
        double d = lengths[k] - figures->length / m;

        deviation += d * d;
    }
    figures->energy = m * square;
    figures->speed_variation =
        figures->length > 0.0 ? sqrt(deviation / m) * m / figures->length : 0.0;
}

int pullback_measure(const struct srnf_sht *sht, const struct srnf_context *context,
                     size_t segments, const double *path, double *speeds,
                     struct srnf_path_figures *figures)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t field = 3 * grid->n_theta * grid->n_phi;
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    double *memory = srnf_alloc(3 * field + segments, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    double *here = memory;
    double *next;
    double *lengths;
    int status = SRNF_OK;

    if (!memory || !workspace) {
        srnf_free(memory);
        srnf_free(workspace);
        return SRNF_ENOMEM;
    }
    next = memory + field;
    lengths = memory + 3 * field;
    srnf_field(sht, path, here, workspace);
    for (size_t k = 0; k < segments; k++) {
        double *swap = here;

        if (srnf_is_canceled(context)) {
            status = SRNF_ECANCELED;
            break;
        }
        srnf_field(sht, path + (k + 1) * count, next, workspace);
        lengths[k] = pullback_distance(grid, here, next, memory + 2 * field);
        if (speeds) {
            speeds[k] = (double)segments * lengths[k];
        }
        here = next;
        next = swap;
    }
    if (status == SRNF_OK) {
        summarize(segments, lengths, figures);
        status = isfinite(figures->energy) ? SRNF_OK : SRNF_ENUMERIC;
    }
    srnf_free(memory);
    srnf_free(workspace);
    return status;
}

int pullback_check_surface(const struct srnf_sht *sht, const double *surface, const char *name,
                           struct srnf_error *error)
{
    for (size_t i = 0; i < 3 * srnf_coefficient_count(srnf_sht_degree(sht)); i++) {
        if (!isfinite(surface[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "a coefficient of %s is not finite",
                             name);
        }
    }
    return SRNF_OK;
}

int pullback_check_segments(size_t segments, struct srnf_error *error)
{
    return segments >= 2 && segments <= SRNF_PULLBACK_SEGMENTS_MAX
               ? SRNF_OK
               : srnf_fail(error, SRNF_EINVAL, -1, "segments is %zu, not 2 to %zu", segments,
                           SRNF_PULLBACK_SEGMENTS_MAX);
}

int pullback_check_even(size_t segments, struct srnf_error *error)
{
    int status = pullback_check_segments(segments, error);

    return status || segments % 2 == 0
               ? status
               : srnf_fail(error, SRNF_EINVAL, -1, "segments is %zu, which is odd", segments);
}

int pullback_fail(int status, struct srnf_error *error)
{
    if (status < 0 && status != SRNF_EINVAL) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    }
    return status;
}
