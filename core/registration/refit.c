/*
 * refit.c - a chain of many short steps as one step and a rotation.
 *
 * Every link of a chain costs: at each point that is carried along it, in each table that follows
 * it, and wherever it is kept. What a tournament or a rung ends with, ten to thirty short steps, is
 * a map not far from a rotation R of the domain, so that
 *
 *   v(s) = log_s(R' gamma(s))
 *
 * is a smooth field, and gamma = R exp(v). Its potentials up to a degree are quadratures at the
 * nodes: with Y of l > 0, phi = <v, grad Y> / (l (l + 1)), and psi the same with the turned
 * gradient. What the degree cuts off is lost, and steps that follow make up for it; so a fit is
 * taken only where the objective hardly rises, and where no area shrinks below what is safe between
 * the nodes.
 *
 * Cost: one transposed gradient transform, one table of a field, and a move of the points.
 */
#include "tournament.h"

#include <math.h>
#include <string.h>

#define FAR_COSINE (-0.5) /* a node that goes further from its rotated place: no fit */
#define DEGREE_ABOVE ((size_t)8)
#define LEAST_JACOBIAN 0.1 /* of the step at the nodes */

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

struct refit {
    const struct nodes_of *grid;
    size_t degree, count, n;
    struct srnf_sht *sht;
    double *memory;
    double *d_theta, *d_phi; /* [2][n], of <v, .>, weighted */
    double *potentials;      /* [2][count] */
    void *workspace;
};

static void close_refit(struct refit *r)
{
    srnf_sht_destroy(r->sht);
    srnf_free(r->memory);
    srnf_free(r->workspace);
}

static int open_refit(struct refit *r, const struct nodes_of *grid, size_t degree)
{
    int status;

    *r = (struct refit){.grid = grid,
                        .degree = degree,
                        .count = srnf_coefficient_count(degree),
                        .n = grid->n_theta * grid->n_phi};
    status = srnf_sht_create(&r->sht, degree, grid->kind, grid->n_theta, grid->n_phi);
    if (status) {
        return status;
    }
    r->memory = srnf_alloc(4 * r->n + 2 * r->count, sizeof(double));
    r->workspace = srnf_alloc(1, srnf_sht_workspace_size(r->sht, 2));
    if (!r->memory || !r->workspace) {
        return SRNF_ENOMEM;
    }
    r->d_theta = r->memory;
    r->d_phi = r->d_theta + 2 * r->n;
    r->potentials = r->d_phi + 2 * r->n;
    return SRNF_OK;
}

/* The rotation nearest to gamma. */
static void nearest_rotation(const struct tabulated_target *t, const struct cloud *cloud,
                             double rotation[9])
{
    double b[9] = {0.0};

    for (size_t i = 0; i < t->n; i++) {
        for (size_t row = 0; row < 3; row++) {
            double along = t->weight[i] * cloud->point[row][i];

            for (size_t column = 0; column < 3; column++) {
                b[3 * row + column] += along * t->node[column][i];
            }
        }
    }
    (void)tabulated_closest_rotation(b, rotation);
}

/* Weighted components of v at the nodes, for gradients and turned ones; false: it has none. */
static bool take_logarithm(const struct refit *r, const struct tabulated_target *t,
                           const struct cloud *cloud, const double rotation[9])
{
    for (size_t i = 0; i < r->n; i++) {
        const double s[3] = {t->node[0][i], t->node[1][i], t->node[2][i]};
        double sine = sqrt(s[0] * s[0] + s[1] * s[1]);
        double y[3], along, across, cosine, scale;

        for (size_t c = 0; c < 3; c++) {
            y[c] = rotation[c] * cloud->point[0][i] + rotation[3 + c] * cloud->point[1][i] +
                   rotation[6 + c] * cloud->point[2][i];
        }
        cosine = vector_dot(s, y);
        if (!(cosine > FAR_COSINE) || !(sine > 0.0)) {
            return false;
        }
        along = (s[0] * y[0] + s[1] * y[1]) * s[2] / sine - sine * y[2];
        across = (s[0] * y[1] - s[1] * y[0]) / sine;
        scale = hypot(along, across);
        scale = t->weight[i] * (scale > 0.0 ? atan2(scale, cosine) / scale : 1.0);
        r->d_theta[i] = scale * along;
        r->d_phi[i] = scale * across;
        r->d_theta[r->n + i] = scale * across;
        r->d_phi[r->n + i] = -scale * along;
    }
    return true;
}

static void find_potentials(const struct refit *r)
{
    srnf_sht_gradient_adjoint(r->sht, 2, r->d_theta, r->d_phi, r->potentials, r->workspace);
    r->potentials[0] = r->potentials[r->count] = 0.0;
    for (size_t l = 1; l <= r->degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            r->potentials[i] /= (double)(l * (l + 1));
            r->potentials[r->count + i] /= (double)(l * (l + 1));
        }
    }
}

/* R exp(v) at the nodes; the least Jacobian of v's step. */
static int place(const struct refit *r, const struct tabulated_target *t, const double rotation[9],
                 struct cloud *to, double *least)
{
    struct tabulated_fields fields = {0};
    int status = tabulated_fields_create(&fields, r->degree, FOLLOW_ORDER, follow_rows(r->degree));

    if (status) {
        return status;
    }
    cloud_rotate(to, t, identity);
    tabulated_fields_fill(&fields, r->potentials);
    *least = cloud_move(&fields.table, to, to);
    cloud_turn(to, rotation);
    tabulated_fields_clear(&fields);
    return SRNF_OK;
}

/* A chain of a common pose begins with the identity, as before. */
static int replace(const struct refit *r, const double rotation[9], struct srnf_warp *chain)
{
    bool still = warp_is_still(chain);
    struct srnf_warp fit = {0};
    int status = still ? warp_append(&fit, SRNF_WARP_ROTATION, 0, identity) : SRNF_OK;

    status = status ? status : warp_append(&fit, SRNF_WARP_EXP, r->degree, r->potentials);
    status = status || still ? status : warp_append(&fit, SRNF_WARP_ROTATION, 0, rotation);
    if (status) {
        srnf_warp_clear(&fit);
        return status;
    }
    srnf_warp_clear(chain);
    *chain = fit;
    return SRNF_OK;
}

bool search_refits(const struct search *search)
{
    return search->options->degree > DEGREE_ABOVE && !search->options->exact;
}

bool warp_is_still(const struct srnf_warp *chain)
{
    return chain->n_links > 0 && chain->links[0].kind == SRNF_WARP_ROTATION &&
           memcmp(chain->links[0].values, identity, sizeof identity) == 0;
}

int warp_refit(const struct tabulated_problem *problem, const struct nodes_of *grid, size_t degree,
               double worse, struct cloud *cloud, struct cloud *spare, struct srnf_warp *chain)
{
    double rotation[9];
    struct refit r;
    double least = 0.0;
    int status = open_refit(&r, grid, degree);

    memcpy(rotation, identity, sizeof identity);
    if (status == SRNF_OK && !warp_is_still(chain)) {
        nearest_rotation(problem->target, cloud, rotation);
    }
    if (status == SRNF_OK && take_logarithm(&r, problem->target, cloud, rotation)) {
        find_potentials(&r);
        status = place(&r, problem->target, rotation, spare, &least);
    }
    if (status == SRNF_OK && least >= LEAST_JACOBIAN) {
        cloud_evaluate(problem->moving, spare);
        cloud_measure(problem, spare);
        if (spare->objective <= (1.0 + worse) * cloud->objective) {
            status = replace(&r, rotation, chain);
            if (status == SRNF_OK) {
                struct cloud kept = *cloud;

                *cloud = *spare;
                *spare = kept;
            }
        }
    }
    close_refit(&r);
    return status;
}
