/*
 * predict_mirrored.c - mirror images of what a classifier is asked about, asked like the surfaces
 * themselves: where one is nearer to a training member, left and right may be mixed. Those of all
 * structures of a subject are tried together.
 */
#include "processes/predict.h"

#include <string.h>

struct images {
    size_t n;                /* subjects */
    size_t *of;              /* [n] which */
    double *coefficients;    /* [parts][n][3][(L+1)^2] */
    const double **surfaces; /* [parts][n] */
    double *features;        /* [n][numbers beside shape] */
    double *positions;       /* [n][parts][3], or NULL */
    double *evidence, *probabilities;
    struct srnf_class_prediction *found; /* [n] */
};

static void images_clear(struct images *images)
{
    srnf_free(images->of);
    srnf_free(images->coefficients);
    srnf_free(images->surfaces);
    srnf_free(images->features);
    srnf_free(images->positions);
    srnf_free(images->evidence);
    srnf_free(images->found);
}

/* Mirrored as the surfaces are, x to -x. */
static int place_images(struct images *images, size_t n_parts, const double *positions)
{
    size_t each = 3 * n_parts;

    images->positions = srnf_alloc(images->n * each + 1, sizeof(double));
    for (size_t k = 0; images->positions && k < images->n * each; k++) {
        double x = positions[images->of[k / each] * each + k % each];

        images->positions[k] = k % 3 == 0 ? 0.0 - x : x;
    }
    return images->positions ? SRNF_OK : SRNF_ENOMEM;
}

/* Of all but training members, of every structure. */
static int images_open(struct images *images, const struct kept *kept,
                       const struct predict_answer *answer)
{
    const struct compute_group *group = &answer->group;
    size_t count = 3 * srnf_coefficient_count(group->degree), beside = kept->classifier.features;
    size_t n = answer->n, k = kept->classes;

    *images = (struct images){.of = srnf_alloc(n, sizeof *images->of),
                              .coefficients = srnf_alloc(group->n, count * sizeof(double)),
                              .surfaces = srnf_alloc(group->n, sizeof *images->surfaces),
                              .features = srnf_alloc(n * beside + 1, sizeof(double)),
                              .evidence = srnf_alloc(n, 2 * k * sizeof(double)),
                              .found = srnf_alloc(n, sizeof *images->found)};
    if (!images->of || !images->coefficients || !images->surfaces || !images->features ||
        !images->evidence || !images->found) {
        return SRNF_ENOMEM;
    }
    images->probabilities = images->evidence + n * k;
    for (size_t i = 0; i < n; i++) {
        if (predict_member(kept, answer, i) == kept->model.pca.n) {
            memcpy(images->features + images->n * beside, answer->numbers + i * beside,
                   beside * sizeof(double));
            images->of[images->n++] = i;
        }
    }
    for (size_t at = 0; at < kept->model.joint.n_parts * images->n; at++) {
        size_t part = at / images->n, i = images->of[at % images->n];

        images->surfaces[at] = images->coefficients + at * count;
        memcpy(images->coefficients + at * count, group->surfaces[part * n + i],
               count * sizeof(double));
        srnf_surface_mirror(group->degree, images->coefficients + at * count);
    }
    return answer->positions ? place_images(images, kept->model.joint.n_parts, answer->positions)
                             : SRNF_OK;
}

int predict_mirrored(struct jobs_run *run, const struct srnf_sht *sht,
                     const struct srnf_frozen *frozen, const struct kept *kept,
                     struct predict_answer *answer, struct srnf_error *error)
{
    struct srnf_context context = *jobs_run_context(run);
    struct images images;
    int status = images_open(&images, kept, answer);

    context.progress = NULL;
    if (status == SRNF_OK && images.n > 0) {
        status = srnf_predict(sht, frozen, images.n, images.surfaces, images.positions,
                              images.features, &kept->registration, answer->priors, &context,
                              images.found, images.evidence, images.probabilities, error);
    }
    for (size_t a = 0; a < images.n && status == SRNF_OK; a++) {
        answer->mirrored[images.of[a]] = images.found[a].nearest;
    }
    images_clear(&images);
    return status;
}
