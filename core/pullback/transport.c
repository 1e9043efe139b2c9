/*
 * transport.c - tangent spaces of the image of Q, and parallel transport along a path.
 *
 * The tangent space at Q(f) is { J a }: P w = J (J' W J)^-1 J' W w is the orthogonal projection of
 * a field to it, one linear system by conjugate gradients. Transport in a submanifold of L2 is what
 * projecting from each tangent space to the next tends to; that is of first order in the number of
 * segments (the paper, Algorithm 3). A reflection in the tangent space midway, w' = 2 P_k+1 w - w,
 * keeps the norm exactly and turns twice as far; the projection at k + 2 then takes away only what
 * is left, of third order a step. Error of second order for the same two systems per two segments.
 *
 * Cost: 80 to 300 products of two transforms a segment.
 */
#include "pullback.h"

#include <math.h>

#define SOLVE_TOLERANCE 1e-10 /* well below the error of the transport itself */
#define SOLVE_CAP ((size_t)2000)

int pullback_tangent_create(struct pullback_tangent *t, const struct srnf_sht *sht,
                            const struct srnf_context *context)
{
    size_t field = 3 * srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    size_t n = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    int status;

    t->memory = srnf_alloc(field + n, sizeof(double));
    if (!t->memory) {
        return SRNF_ENOMEM;
    }
    t->pulled = t->memory + field;
    status = gauss_newton_create(&t->system, sht, t->memory);
    status = status ? status : normal_equations_create(&t->conjugate, t->system);
    t->conjugate.context = context;
    return status;
}

void pullback_tangent_destroy(struct pullback_tangent *t)
{
    normal_equations_destroy(&t->conjugate);
    gauss_newton_destroy(t->system);
    srnf_free(t->memory);
}

void pullback_tangent_at(struct pullback_tangent *t, const double *f)
{
    (void)gauss_newton_try(t->system, f);
    gauss_newton_accept(t->system);
}

void pullback_tangent_image(struct pullback_tangent *t, const double *vector, double *field)
{
    gauss_newton_differential(t->system, &t->system->state, vector, field);
}

void pullback_tangent_project(struct pullback_tangent *t, const double *field, double *vector,
                              double *image)
{
    gauss_newton_pull_back(t->system, field, t->pulled);
    (void)normal_equations_solve(&t->conjugate, t->system, t->pulled, 0.0, SOLVE_TOLERANCE,
                                 SOLVE_CAP, vector);
    pullback_tangent_image(t, vector, image);
}

double pullback_tangent_norm(const struct pullback_tangent *t, const double *field)
{
    return sqrt(pointwise_norm2(t->system->points, t->system->weight, field));
}

/* ---- Transport ------------------------------------------------------------------------------- */

static int walk(struct pullback_tangent *t, size_t segments, const double *path,
                const double *vector, const struct srnf_context *context, double *w,
                struct srnf_pullback_transported *result)
{
    size_t field = 3 * t->system->points;
    size_t n = t->system->count;
    double *image = w + field;

    pullback_tangent_at(t, path);
    pullback_tangent_image(t, vector, w);
    result->norm_from = pullback_tangent_norm(t, w);
    if (!isfinite(result->norm_from)) {
        return SRNF_ENUMERIC;
    }
    for (size_t k = 0; k < segments; k += 2) {
        if (srnf_is_canceled(context)) {
            return SRNF_ECANCELED;
        }
        pullback_tangent_at(t, path + (k + 1) * n);
        pullback_tangent_project(t, w, result->vector, image);
        for (size_t i = 0; i < field; i++) {
            w[i] = 2.0 * image[i] - w[i];
        }
        pullback_tangent_at(t, path + (k + 2) * n);
        pullback_tangent_project(t, w, result->vector, image);
        linear_copy(field, image, w);
        srnf_report_progress(context, (double)(k + 2) / (double)segments, "transporting");
    }
    if (srnf_is_canceled(context)) {
        return SRNF_ECANCELED;
    }
    result->norm = pullback_tangent_norm(t, w);
    result->transforms = t->system->transforms;
    for (size_t c = 0; c < 3; c++) {
        result->vector[c * n / 3] = vector[c * n / 3];
    }
    return isfinite(result->norm) ? SRNF_OK : SRNF_ENUMERIC;
}

int srnf_pullback_transport(const struct srnf_sht *sht, size_t segments, const double *path,
                            const double *vector, const struct srnf_context *context,
                            struct srnf_pullback_transported *result, struct srnf_error *error)
{
    size_t field = 3 * srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    size_t n = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    struct pullback_tangent t = {0};
    double *w = NULL;
    int status;

    *result = (struct srnf_pullback_transported){0};
    status = pullback_check_even(segments, error);
    for (size_t k = 0; k <= segments && status == SRNF_OK; k++) {
        status = pullback_check_surface(sht, path + k * n, "the path", error);
    }
    status = status ? status : pullback_check_surface(sht, vector, "the vector", error);
    if (status) {
        return status;
    }
    w = srnf_alloc(2 * field, sizeof(double));
    result->vector = srnf_alloc(n, sizeof(double));
    status = w && result->vector ? pullback_tangent_create(&t, sht, context) : SRNF_ENOMEM;
    status = status ? status : walk(&t, segments, path, vector, context, w, result);
    pullback_tangent_destroy(&t);
    srnf_free(w);
    if (status) {
        srnf_free(result->vector);
        *result = (struct srnf_pullback_transported){0};
        return pullback_fail(status, error);
    }
    return SRNF_OK;
}
