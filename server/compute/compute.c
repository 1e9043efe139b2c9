/*
 * compute.c - the shared steps of the computations: problems of failed jobs, loading of surfaces
 * and measuring.
 *
 * Runs on worker threads; holds no lock and no state.
 */
#include "compute/compute.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compute/encode.h"
#include "store/surface.h"

static const struct {
    int status;
    const char *code;
} codes[] = {
    {SRNF_ENOMEM, "out-of-memory"},
    {SRNF_EINVAL, "invalid-input"},
    {SRNF_ELIMIT, "limit-exceeded"},
    {SRNF_EFORMAT, "unparsable-mesh"},
    {SRNF_EPARSE, "unparsable-mesh"},
    {SRNF_ENOT_CLOSED, "mesh-not-closed"},
    {SRNF_ENOT_MANIFOLD, "mesh-not-manifold"},
    {SRNF_ENOT_ORIENTED, "mesh-not-oriented"},
    {SRNF_ECOMPONENTS, "multiple-components"},
    {SRNF_EGENUS, "not-genus-zero"},
    {SRNF_EDEGENERATE, "mesh-degenerate"},
    {SRNF_ENOT_STAR, "not-star-shaped"},
    {SRNF_ENUMERIC, "numerical-failure"},
    {SRNF_EUNMATCHED, "landmarks-not-matched"},
    {SRNF_EIO, "storage-unavailable"},
    {SRNF_WNOT_CONVERGED, "not-converged"},
    {STORE_FULL, "storage-full"},
    {STORE_IO, "storage-unavailable"},
    {STORE_CORRUPT, "data-damaged"},
    {STORE_NOMEM, "out-of-memory"},
};

const char *compute_problem_code(int status)
{
    for (size_t i = 0; i < sizeof codes / sizeof codes[0]; i++) {
        if (codes[i].status == status) {
            return codes[i].code;
        }
    }
    return "internal-error";
}

int compute_fail(struct jobs_result *result, int status, const struct srnf_error *error,
                 const char *what)
{
    bool detailed = error && error->message[0];

    if (status == SRNF_ECANCELED) {
        return status;
    }
    result->problem_code = compute_problem_code(status);
    (void)snprintf(result->problem_detail, sizeof result->problem_detail, "%s: %s", what,
                   detailed                    ? error->message
                   : status <= STORE_NOT_FOUND ? store_strerror(status)
                                               : srnf_strerror(status));
    return status;
}

int compute_fail_alike(struct jobs_result *result, const char *what)
{
    result->problem_code = compute_problem_code(SRNF_ENUMERIC);
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "The %s do not differ, so there are no principal components of them.", what);
    return SRNF_ENUMERIC;
}

bool compute_is_mesh(const char *id)
{
    return strncmp(id, "mesh-", 5) == 0;
}

int compute_fail_store(struct jobs_result *result, int status, const char *id)
{
    bool mesh = compute_is_mesh(id), model = strncmp(id, "model-", 6) == 0;
    bool volume = strncmp(id, "vol-", 4) == 0;

    result->problem_code = compute_problem_code(status);
    if (status == STORE_NOT_FOUND) {
        result->problem_code = mesh     ? "no-such-mesh"
                               : model  ? "no-such-model"
                               : volume ? "no-such-volume"
                                        : "no-such-surface";
    }
    (void)snprintf(result->problem_detail, sizeof result->problem_detail, "%s: %s", id,
                   store_strerror(status));
    return status;
}

int compute_fail_kept(struct jobs_run *run, struct jobs_result *result, int status,
                      const char *what)
{
    if (status != STORE_QUOTA) {
        return compute_fail_store(result, status, what);
    }
    result->problem_code = "storage-quota-exceeded";
    jobs_run_quota_detail(run, what, result->problem_detail);
    return status;
}

void compute_surface_clear(struct compute_surface *surface)
{
    srnf_free(surface->coefficients);
    *surface = (struct compute_surface){0};
}

/* A mesh where a surface is wanted: its encoding with the default options, by this route and at
   this degree (0: the default one). */
static int load_mesh(struct jobs_run *run, const struct srnf_context *context, const char *id,
                     enum srnf_parameterization route, bool mirror, size_t degree,
                     struct compute_surface *surface, struct jobs_result *result)
{
    static const double upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct compute_encode_inputs inputs = {.options = srnf_encode_options_defaults(),
                                           .mirror = mirror};
    struct srnf_encoded encoded = {0};
    int status;

    inputs.options.parameterization = route;
    inputs.options.degree = degree ? degree : inputs.options.degree;
    (void)snprintf(inputs.mesh, sizeof inputs.mesh, "%s", id);
    status = compute_encode(run, context, &inputs, &encoded, result);
    if (status == 0) {
        surface->degree = encoded.degree;
        surface->coefficients = encoded.coefficients;
        surface->scale = encoded.scale;
        memcpy(surface->origin, encoded.origin, sizeof surface->origin);
        surface->route = srnf_parameterization_name(encoded.route);
        store_shape_id(surface->content, (int64_t)encoded.degree, encoded.coefficients);
        store_surface_id(surface->older, (int64_t)encoded.degree, encoded.coefficients,
                         encoded.scale);
        memcpy(surface->surface, surface->older, sizeof surface->surface);
        store_surface_id_place(surface->surface, encoded.origin, upright, id);
    }
    return status;
}

static int load(struct jobs_run *run, const struct srnf_context *context, const char *id,
                enum srnf_parameterization route, bool mirror, size_t mesh_degree,
                struct compute_surface *surface, struct jobs_result *result)
{
    struct store_surface stored = {0};
    int status;

    *surface = (struct compute_surface){0};
    (void)snprintf(surface->id, sizeof surface->id, "%s", id);
    if (compute_is_mesh(id)) {
        return load_mesh(run, context, id, route, mirror, mesh_degree, surface, result);
    }
    status = store_surface_get(jobs_run_store(run), id, true, &stored);
    if (status) {
        return compute_fail_store(result, status, id);
    }
    (void)snprintf(surface->surface, sizeof surface->surface, "%s", id);
    surface->degree = (size_t)stored.lmax;
    surface->coefficients = srnf_alloc(stored.coefficient_count, sizeof(double));
    if (!surface->coefficients) {
        status = compute_fail(result, SRNF_ENOMEM, NULL, id);
    } else {
        memcpy(surface->coefficients, stored.coefficients,
               stored.coefficient_count * sizeof(double));
        if (mirror) {
            srnf_surface_mirror(surface->degree, surface->coefficients);
        }
        store_shape_id(surface->content, stored.lmax, surface->coefficients);
        memcpy(surface->older, surface->surface, sizeof surface->older);
        if (mirror) {
            memcpy(surface->surface, surface->content, sizeof surface->surface);
            store_surface_id(surface->older, stored.lmax, surface->coefficients, 0.0);
        }
    }
    store_surface_clear(&stored);
    return status;
}

int compute_surface_load(struct jobs_run *run, const char *id, double share,
                         struct compute_surface *surface, struct jobs_result *result)
{
    return compute_surface_load_by(run, id, SRNF_PARAMETERIZATION_AUTO, share, surface, result);
}

int compute_surface_load_by(struct jobs_run *run, const char *id, enum srnf_parameterization route,
                            double share, struct compute_surface *surface,
                            struct jobs_result *result)
{
    jobs_run_phase(run, compute_is_mesh(id) ? share : 0.0);
    return load(run, jobs_run_context(run), id, route, false, 0, surface, result);
}

int compute_surface_load_within(struct jobs_run *run, const struct srnf_context *context,
                                const char *id, bool mirror, size_t mesh_degree,
                                struct compute_surface *surface, struct jobs_result *result)
{
    return load(run, context, id, SRNF_PARAMETERIZATION_AUTO, mirror, mesh_degree, surface, result);
}

int compute_measure(struct jobs_run *run, size_t degree, size_t count, const double *coefficients,
                    struct srnf_surface_measures *measures, struct jobs_result *result)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;
    int status = jobs_transform_acquire(jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht);

    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    status = srnf_surfaces_measure(sht, count, coefficients, jobs_run_context(run), measures);
    jobs_transform_release(jobs, sht);
    return status ? compute_fail(result, status, NULL, "measuring the surface") : 0;
}
