/*
 * classify_nearest.c - the class of the nearest training member, by shape or by shape, size and
 * other numbers.
 *
 * With size the squared distance is d_ij^2 + (w s (z_i - z_j) / r)^2: z the log scales, s the rms
 * distance between two training members of the fold and r the rms difference of their z. Both
 * terms then have the same mean square over pairs of training members at w = 1. Members of the
 * subject left out are in no pair and nobody's neighbours.
 */
#include "classify.h"

#include <math.h>
#include <string.h>

/* rms difference of z between two members of all but one subject: twice the variance. Taken about
   the first of them: where z is the same in all it is 0, to the last bit. stride: of the numbers of
   consecutive members. */
static double size_spread(const struct subjects *subjects, size_t left_out, const double *z,
                          size_t stride)
{
    size_t t = subjects->n - subjects->size[left_out];
    size_t first = 0;
    double mean = 0.0;
    double sum = 0.0;

    while (subjects->of[first] == left_out) {
        first++;
    }
    for (size_t i = 0; i < subjects->n; i++) {
        double d = z[i * stride] - z[first * stride];

        mean += subjects->of[i] == left_out ? 0.0 : d / (double)t;
    }
    for (size_t i = 0; i < subjects->n; i++) {
        double d = z[i * stride] - z[first * stride] - mean;

        sum += subjects->of[i] == left_out ? 0.0 : d * d;
    }
    return sqrt(2.0 * sum / (double)(t - 1));
}

/* The term of one number. */
static void add_number(const struct study *study, const double *z, size_t stride, double *rows)
{
    const struct srnf_folds *c = study->comparison;

    for (size_t i = 0; i < c->n; i++) {
        double spread = size_spread(&study->subjects, study->subjects.of[i], z, stride);
        double factor = spread > 0.0 ? study->options->size_weight * c->spread[i] / spread : 0.0;

        for (size_t j = 0; j < c->n; j++) {
            double *d = &rows[i * c->n + j];

            *d = hypot(*d, factor * (z[i * stride] - z[j * stride]));
        }
    }
}

static void add_numbers(const struct study *study, double *rows)
{
    const struct srnf_folds *c = study->comparison;
    const struct srnf_classify_options *options = study->options;

    memcpy(rows, c->distances, c->n * c->n * sizeof *rows);
    if (options->log_scale) {
        add_number(study, options->log_scale, 1, rows);
    }
    for (size_t k = 0; k < options->n_features; k++) {
        add_number(study, options->features + k, options->n_features, rows);
    }
}

static int predict(const struct study *study, const size_t *labels, const struct outcome *outcome,
                   struct srnf_error *error)
{
    const size_t *of = study->subjects.of;
    size_t n = study->comparison->n;

    (void)error;
    for (size_t i = 0; i < n; i++) {
        size_t nearest = SIZE_MAX; /* of three subjects or more there is one */

        for (size_t k = 0; outcome->evidence && k < study->n_classes; k++) {
            outcome->evidence[i * study->n_classes + k] = -INFINITY;
        }
        for (size_t j = 0; j < n; j++) {
            double d = study->rows[i * n + j];

            if (of[j] == of[i]) {
                continue;
            }
            nearest = nearest == SIZE_MAX || d < study->rows[i * n + nearest] ? j : nearest;
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
    struct study study;
    double *rows = NULL;
    int status;

    *result = (struct srnf_classification){0};
    status =
        study_open(&study, comparison, labels, n_classes, options ? options : &defaults, error);
    study.rows = comparison->distances;
    study.predict = predict;
    if (status == SRNF_OK && (study.options->log_scale || study.options->n_features > 0)) {
        rows = srnf_alloc(comparison->n, comparison->n * sizeof(double));
        if (rows) {
            add_numbers(&study, rows);
            study.rows = rows;
        } else {
            status = srnf_fail(error, SRNF_ENOMEM, -1, "%s", srnf_strerror(SRNF_ENOMEM));
        }
    }
    status = status ? status : study_assess(&study, labels, false, context, result, error);
    study_close(&study);
    srnf_free(rows);
    return status;
}
