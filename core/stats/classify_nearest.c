/*
 * classify_nearest.c - the class of the nearest training subject, by shape or by shape and size.
 *
 * With size the squared distance is d_ij^2 + (w s (z_i - z_j) / r)^2: z the log scales, s the rms
 * distance between two training subjects of the fold and r the rms difference of their z. Both
 * terms then have the same mean square over pairs of training subjects at w = 1.
 */
#include "classify.h"

#include <math.h>

/* rms difference of z between two of all but one subject: twice the variance. */
static double size_spread(size_t n, size_t left_out, const double *z)
{
    double mean = 0.0;
    double sum = 0.0;

    for (size_t i = 0; i < n; i++) {
        mean += i == left_out ? 0.0 : z[i] / (double)(n - 1);
    }
    for (size_t i = 0; i < n; i++) {
        sum += i == left_out ? 0.0 : (z[i] - mean) * (z[i] - mean);
    }
    return sqrt(2.0 * sum / (double)(n - 2));
}

static void add_size(const struct srnf_folds *c, const struct srnf_classify_options *options,
                     double *rows)
{
    const double *z = options->log_scale;

    for (size_t i = 0; i < c->n; i++) {
        double spread = size_spread(c->n, i, z);
        double factor = spread > 0.0 ? options->size_weight * c->spread[i] / spread : 0.0;

        for (size_t j = 0; j < c->n; j++) {
            double d = c->distances[i * c->n + j];

            rows[i * c->n + j] = hypot(d, factor * (z[i] - z[j]));
        }
    }
}

static int predict(const struct study *study, const size_t *labels, const struct outcome *outcome,
                   struct srnf_error *error)
{
    size_t n = study->comparison->n;

    (void)error;
    for (size_t i = 0; i < n; i++) {
        size_t nearest = i == 0 ? 1 : 0;

        for (size_t k = 0; outcome->evidence && k < study->n_classes; k++) {
            outcome->evidence[i * study->n_classes + k] = -INFINITY;
        }
        for (size_t j = 0; j < n; j++) {
            double d = study->rows[i * n + j];

            if (j == i) {
                continue;
            }
            nearest = d < study->rows[i * n + nearest] ? j : nearest;
            if (outcome->evidence) {
                double *e = &outcome->evidence[i * study->n_classes + labels[j]];

                *e = fmax(*e, -d);
            }
        }
        outcome->predicted[i] = labels[nearest];
    }
    return SRNF_OK;
}

int srnf_classify_nearest(const struct srnf_folds *comparison, const size_t *labels,
                          size_t n_classes, const struct srnf_classify_options *options,
                          const struct srnf_context *context, struct srnf_classification *result,
                          struct srnf_error *error)
{
    struct srnf_classify_options defaults = srnf_classify_options_defaults();
    struct study study = {.comparison = comparison,
                          .options = options ? options : &defaults,
                          .n_classes = n_classes,
                          .rows = comparison->distances,
                          .predict = predict};
    double *rows = NULL;
    size_t smallest;
    int status;

    *result = (struct srnf_classification){0};
    status = study_check(comparison, labels, n_classes, study.options, &smallest, error);
    if (status) {
        return status;
    }
    if (study.options->log_scale) {
        rows = srnf_alloc(comparison->n, comparison->n * sizeof(double));
        if (!rows) {
            return srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
        }
        add_size(comparison, study.options, rows);
        study.rows = rows;
    }
    status = study_assess(&study, labels, false, context, result, error);
    srnf_free(rows);
    return status;
}
