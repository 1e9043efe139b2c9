/*
 * field.c - registration to a field: the search alone, and a surface as a chain that was found lays
 * it.
 *
 * A search needs the field, the surface and the options, and what it finds is a rotation and a
 * chain: few numbers, from which all else follows with the same bits wherever it is computed. So
 * searches can be done on other machines (srnf_context.search).
 */
#include "landmarks.h"
#include "tournament.h"

#include <math.h>
#include <string.h>

static int check_search(const struct srnf_sht *sht, const double *field, double norm2,
                        const double *moving, const struct srnf_register_options *options,
                        struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    double square = norm2 == 0.0 ? srnf_inner_product(srnf_sht_grid(sht), field, field) : norm2;
    int status = registration_check(options, error);

    if (status == SRNF_OK && options->symmetric) {
        return srnf_fail(error, SRNF_EINVAL, -1, "a field has no registration both ways");
    }
    if (status == SRNF_OK && (!(square > 0.0) || !isfinite(square))) {
        return srnf_fail(error, SRNF_EINVAL, -1, "a field is zero or not finite");
    }
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        if (!isfinite(moving[i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "a coefficient is not finite");
        }
    }
    return status;
}

static void forget_points(struct warp *warp)
{
    srnf_free(warp->points);
    srnf_free(warp->jacobian);
    warp->points = warp->jacobian = NULL;
}

int registration_to_field(const struct srnf_sht *sht, const double *field, double norm2,
                          const double *moving, const struct srnf_register_options *options,
                          const struct srnf_landmarks *landmarks, struct tabulated_tools *tools,
                          const struct srnf_context *context, struct warp *found,
                          struct srnf_error *error)
{
    struct search_result result = {.iterations = 0};
    struct landmark_search guide = {.worst = 0};
    struct tabulated_tools *own = NULL;
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct search search;
    int status = check_search(sht, field, norm2, moving, options, error);

    *found = (struct warp){.n = 0};
    if (status) {
        return status;
    }
    if (!tools) {
        tools = own = tools_create();
    }
    status = tools ? search_create(&search, sht, field, NULL, moving, options, NULL, tools, context)
                   : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        search.chain = true;
        if (norm2 != 0.0) {
            search.full.target.norm2 = norm2;
        }
        if (landmarks) {
            guide.pairs = *landmarks;
            search.landmarks = &guide;
        }
        status = search_run(&search, &result);
        search_clear(&search);
    }
    tools_destroy(own);
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : status;
    if (status == SRNF_OK) {
        *found = result.warp;
        result.warp = (struct warp){.n = 0};
        if (!result.carried || found->n != grid->n_theta * grid->n_phi) {
            forget_points(found);
        }
    }
    search_result_clear(&result);
    if (status == SRNF_EUNMATCHED) {
        return landmarks_fail(&guide, error);
    }
    return status ? srnf_fail(error, status, -1, "%s", srnf_strerror(status)) : SRNF_OK;
}

int registration_basin(const struct srnf_sht *sht, const double *field, double norm2,
                       const double *moving, const struct srnf_register_options *options,
                       struct tabulated_tools *tools, const struct srnf_context *context,
                       struct srnf_warp *chain)
{
    struct search_result result = {.iterations = 0};
    struct search search;
    int status = search_create(&search, sht, field, NULL, moving, options, NULL, tools, context);

    *chain = (struct srnf_warp){0};
    if (status) {
        return status;
    }
    search.full.target.norm2 = norm2;
    status = tournament_run(&search, &result);
    search_clear(&search);
    if (status == SRNF_OK) {
        *chain = result.warp.chain;
        result.warp.chain = (struct srnf_warp){0};
    }
    search_result_clear(&result);
    return srnf_is_canceled(context) ? SRNF_ECANCELED : status;
}

/* Rotation and chain alone. */
static int search_chain(const struct srnf_sht *sht, const double *field, double norm2,
                        const double *moving, const struct srnf_register_options *options,
                        const struct srnf_landmarks *landmarks, const struct srnf_context *context,
                        double rotation[9], struct srnf_warp *warp, struct srnf_error *error)
{
    struct warp found;
    int status = registration_to_field(sht, field, norm2, moving, options, landmarks, NULL, context,
                                       &found, error);

    if (status == SRNF_OK) {
        memcpy(rotation, found.rotation, sizeof found.rotation);
        *warp = found.chain;
        found.chain = (struct srnf_warp){0};
    }
    warp_clear(&found);
    return status;
}

int srnf_register_to_field(const struct srnf_sht *sht, const double *field, double norm2,
                           const double *moving, const struct srnf_register_options *options,
                           const struct srnf_context *context, double rotation[9],
                           struct srnf_warp *warp, struct srnf_error *error)
{
    *warp = (struct srnf_warp){0};
    return search_chain(sht, field, norm2, moving, options, NULL, context, rotation, warp, error);
}

int srnf_register_to_field_landmarks(const struct srnf_sht *sht, const double *field, double norm2,
                                     const double *moving,
                                     const struct srnf_register_options *options,
                                     const struct srnf_landmarks *landmarks,
                                     const struct srnf_context *context, double rotation[9],
                                     struct srnf_warp *warp, struct srnf_error *error)
{
    int status = landmarks && (options->exact || !options->reparameterization)
                     ? srnf_fail(error, SRNF_EINVAL, -1, "landmarks guide warps that are sought")
                     : SRNF_OK;

    *warp = (struct srnf_warp){0};
    if (status == SRNF_OK && landmarks) {
        status = srnf_landmarks_check(landmarks, options->degree, error);
    }
    return status ? status
                  : search_chain(sht, field, norm2, moving, options, landmarks, context, rotation,
                                 warp, error);
}

/* A vector turned by O. */
static void turn(const double o[9], const double x[3], double scale, size_t n, double *out)
{
    for (size_t k = 0; k < 3; k++) {
        out[k * n] = scale * (o[3 * k] * x[0] + o[3 * k + 1] * x[1] + o[3 * k + 2] * x[2]);
    }
}

int registration_lay(const struct srnf_sht *sht, enum srnf_representation representation,
                     const double *moving, const double rotation[9], const struct srnf_warp *warp,
                     const struct srnf_context *context, double *points, double *jacobian,
                     double *q, double *f)
{
    size_t degree = srnf_sht_degree(sht);
    size_t n = srnf_sht_grid(sht)->n_theta * srnf_sht_grid(sht)->n_phi;
    struct moving m = {0};
    double *values = srnf_alloc(3 * n, sizeof(double));
    int status = values ? SRNF_OK : SRNF_ENOMEM;

    registration_nodes(srnf_sht_grid(sht), points, jacobian);
    for (size_t i = 0; i < n; i++) {
        jacobian[i] = 1.0;
    }
    status = status ? status : warp_follow(warp, context, n, points, jacobian);
    status = status ? status : moving_create(&m, degree, moving, degree, context);
    m.representation = representation;
    if (status == SRNF_OK) {
        moving_values(&m, n, points, f, values);
        for (size_t i = 0; i < n; i++) {
            turn(rotation, values + 3 * i, sqrt(jacobian[i]), n, q + i);
            if (f) {
                const double x[3] = {f[i], f[n + i], f[2 * n + i]};

                turn(rotation, x, 1.0, n, f + i);
            }
        }
    }
    moving_clear(&m);
    srnf_free(values);
    return status;
}
