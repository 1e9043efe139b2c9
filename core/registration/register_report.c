/*
 * register_report.c - what is told of a registration.
 *
 * Fields are reported on the template's grid, from exact values; distance and objective as the
 * search measured them, on a grid that its degree cannot overfit (search_create.c); the least and
 * the largest Jacobian of its nodes and about the extreme ones (extremes.c). The coefficients of
 * the registered surface are a projection to degree L: truncation_error says what it costs.
 */
#include "register.h"

#include <math.h>
#include <string.h>

static double field_distance(const struct call *c, const double *a, const double *b)
{
    const struct srnf_grid *grid = srnf_sht_grid(c->sht);
    double sum = 0.0;

    for (size_t row = 0; row < grid->n_theta; row++) {
        for (size_t k = 0; k < 3 * grid->n_phi; k++) {
            size_t at = k / grid->n_phi * c->n + row * grid->n_phi + k % grid->n_phi;
            double d = a[at] - b[at];

            sum += grid->weight[row] * d * d;
        }
    }
    return sqrt(sum);
}

/* gamma, q and the points of the surface, [3][n], on the template's grid, where the search may have
   worked on a finer one; distance, rotation. */
static int report_field(const struct call *c, const double *moving,
                        const struct search_result *found, double *surface,
                        struct srnf_registration *r)
{
    r->points = srnf_alloc(3 * c->n, sizeof(double));
    r->jacobian = srnf_alloc(c->n, sizeof(double));
    r->q = srnf_alloc(3 * c->n, sizeof(double));
    if (!r->points || !r->jacobian || !r->q) {
        return SRNF_ENOMEM;
    }
    r->distance = found->distance;
    memcpy(r->rotation, found->warp.rotation, sizeof r->rotation);
    return registration_lay(c->sht, c->options->representation, moving, found->warp.rotation,
                            &found->warp.chain, c->context, r->points, r->jacobian, r->q, surface);
}

int srnf_registration_apply(const struct srnf_sht *sht,
                            const struct srnf_registration *registration,
                            const double *coefficients, const struct srnf_context *context,
                            double *out)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t n = grid->n_theta * grid->n_phi;
    double *values = srnf_alloc(6 * n, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    int status = SRNF_ENOMEM;

    if (values && workspace) {
        status = sphere_harmonics_at_points(context, srnf_sht_degree(sht), 3, coefficients, n,
                                            registration->points, values, NULL);
    }
    if (status == SRNF_OK) {
        double *turned = values + 3 * n;

        for (size_t k = 0; k < 3; k++) {
            const double *o = registration->rotation + 3 * k;

            for (size_t i = 0; i < n; i++) {
                turned[k * n + i] =
                    o[0] * values[i] + o[1] * values[n + i] + o[2] * values[2 * n + i];
            }
        }
        srnf_sht_analysis(sht, 3, turned, out, workspace);
    }
    srnf_free(workspace);
    srnf_free(values);
    return status;
}

/* Coefficients of O f2 o gamma, from its values at the nodes, and what their truncation costs. */
static int report_surface(const struct call *c, const double *surface, struct srnf_registration *r)
{
    double *q = srnf_alloc(3 * c->n, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(c->sht, 3));
    double norm;
    int status = SRNF_ENOMEM;

    r->coefficients = srnf_alloc(c->count, sizeof(double));
    if (q && workspace && r->coefficients) {
        srnf_sht_analysis(c->sht, 3, surface, r->coefficients, workspace);
        field_represent(c->sht, c->options->representation, r->coefficients, q, c->workspace);
        norm = sqrt(srnf_inner_product(srnf_sht_grid(c->sht), r->q, r->q));
        r->truncation_distance = field_distance(c, q, r->q);
        r->truncation_error = norm > 0.0 ? r->truncation_distance / norm : 0.0;
        status = SRNF_OK;
    }
    srnf_free(workspace);
    srnf_free(q);
    return status;
}

int register_report(const struct call *c, const double *moving, struct search_result *found,
                    struct srnf_registration *r)
{
    double *surface = srnf_alloc(3 * c->n, sizeof(double));
    int status = surface ? report_field(c, moving, found, surface, r) : SRNF_ENOMEM;

    status = status ? status : report_surface(c, surface, r);
    srnf_free(surface);
    if (status) {
        return status;
    }
    r->warp = found->warp.chain;
    found->warp.chain = (struct srnf_warp){0};
    r->objective = found->warp.objective;
    r->distance_before = field_distance(c, c->q1, c->q2);
    r->rotations_searched = found->rotations_searched;
    r->ambiguity_objective = found->ambiguity_objective;
    r->ambiguity_angle = found->ambiguity_angle;
    r->rotational_curvature = found->rotational_curvature;
    r->iterations = found->iterations;
    r->stopped = found->warp.stopped;
    r->converged = r->stopped != SRNF_REGISTER_MAX_ITERATIONS;
    r->min_jacobian = found->min_jacobian;
    r->max_jacobian = found->max_jacobian;
    return SRNF_OK;
}
