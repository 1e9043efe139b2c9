/*
 * norms_augment.c - what the members have, each left out of a model that has the new surface as
 * well.
 *
 * A new surface is judged by a model of n members, so that its members must be judged by models of
 * n, too: the n - 1 others and the surface. Then all n + 1 are treated alike, and the rank of the
 * surface is uniform whatever the data are (full conformal prediction: V. Vovk, A. Gammerman, G.
 * Shafer, "Algorithmic learning in a random world", 2005, ch. 2). By models of the n - 1 others
 * alone the members would have larger residuals than the surface, the more so the fewer they are.
 *
 * The surface is one more row of the scores, and what of it lies outside of the components one more
 * column.
 */
#include "norms.h"

#include <string.h>

struct augmented {
    struct srnf_pca pca;
    struct srnf_norm_model model;
    struct norms norms; /* of n + 1 members */
    size_t counted, *given;
    double *values, *rows; /* [SRNF_NORM_TRAITS][n + 1]; [n + 1][columns] */
};

static void close_augmented(struct augmented *a)
{
    subjects_clear(&a->norms.subjects);
    srnf_free(a->pca.scores);
    srnf_free(a->given);
    srnf_free(a->values);
    srnf_free(a->rows);
}

static int open_augmented(struct augmented *a, const struct norms *norms, const double *q,
                          const double *at, struct srnf_error *error)
{
    const struct srnf_norm_model *model = norms->model;
    size_t n = norms->n;
    size_t k = model->pca->components;
    double *last;

    a->pca = *model->pca;
    a->pca.n = n + 1;
    a->pca.components = k + 1;
    a->pca.scores = srnf_alloc(n + 1, (k + 1) * sizeof(double));
    a->given = srnf_alloc(n + 1, sizeof *a->given);
    a->values = srnf_alloc(SRNF_NORM_TRAITS, (n + 1) * sizeof(double));
    a->rows = srnf_alloc(n + 1, (model->columns + 1) * sizeof(double));
    if (!a->pca.scores || !a->given || !a->values || !a->rows) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < n; i++) {
        memcpy(a->pca.scores + i * (k + 1), model->pca->scores + i * k, k * sizeof(double));
        a->given[i] = norms->subjects.members[norms->subjects.start[norms->subjects.of[i]]];
    }
    last = a->pca.scores + n * (k + 1);
    srnf_pca_project(norms->grid, model->pca, model->mean_q, q, last, last + k);
    a->given[n] = n;
    for (size_t c = 0; c < model->columns; c++) {
        for (size_t i = 0; i <= n; i++) {
            a->rows[i * model->columns + c] = i < n ? model->values[i * model->columns + c] : at[c];
        }
    }
    a->model = *model;
    a->model.pca = &a->pca;
    a->model.values = a->rows;
    a->norms = *norms;
    a->norms.model = &a->model;
    a->norms.n = n + 1;
    a->norms.subjects = (struct subjects){0};
    return subjects_open(&a->norms.subjects, n + 1, a->given, error);
}

/* The subjects keep their numbers, the surface has the last. */
static int leave_out(void *argument, size_t subject, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct augmented *a = argument;

    (void)context;
    return norms_describe_subject(&a->norms, NORMS_NONE, subject, a->counted, a->values, error);
}

int norms_values_with(const struct norms *norms, const double *q, const double *at, size_t counted,
                      struct stats_progress progress, double *values, struct srnf_error *error)
{
    struct augmented a = {.counted = counted};
    int status = open_augmented(&a, norms, q, at, error);

    status = status
                 ? status
                 : stats_run(norms->context, norms->subjects.count, leave_out, &a, progress, error);
    for (size_t t = 0; t < SRNF_NORM_TRAITS && status == SRNF_OK; t++) {
        memcpy(values + t * norms->n, a.values + t * (norms->n + 1), norms->n * sizeof(double));
    }
    close_augmented(&a);
    return status;
}
