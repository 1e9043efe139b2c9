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
 * Where a long chain goes too far for one step, each half of its links is fitted by itself, and
 * where that fails, too, each quarter of a longer one.
 *
 * Cost: one transposed gradient transform, one table of a field, and a move of the points; of
 * parts, as much for each, and once more along the chain.
 */
#include "tournament.h"

#include <math.h>
#include <string.h>

#define FAR_COSINE (-0.5) /* a node that goes further from its rotated place: no fit */
#define DEGREE_ABOVE ((size_t)8)
#define LEAST_JACOBIAN 0.1     /* of the step at the nodes */
#define LINKS_PART ((size_t)6) /* at least: of a chain for each part that is fitted by itself */
#define PARTS_MAX ((size_t)4)
#define PARTS_WORSE 2.0 /* times what one step may raise the objective by */

/* Along a chain, to where it is fitted, and where the points are not kept. */
const struct field_table refit_rough = {4, 3.5};

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

struct refit {
    const struct nodes_of *grid;
    const struct field_table *table; /* by which the points of a fit are found */
    struct tabulated_tools *tools;
    size_t degree, count, n;
    struct srnf_sht *sht;
    double *memory;
    double *d_theta, *d_phi; /* [2][n], of <v, .>, weighted */
    double *potentials;      /* [2][count] */
    void *workspace;
};

static void close_refit(struct refit *r)
{
    tools_return_transform(r->tools, r->sht);
    srnf_free(r->memory);
    srnf_free(r->workspace);
}

static int open_refit(struct refit *r, const struct nodes_of *grid, const struct refit_terms *terms,
                      struct tabulated_tools *tools)
{
    int status;

    *r = (struct refit){.grid = grid,
                        .table = terms->table,
                        .tools = tools,
                        .degree = terms->degree,
                        .count = srnf_coefficient_count(terms->degree),
                        .n = grid->n_theta * grid->n_phi};
    status = tools_transform(tools, terms->degree, grid, &r->sht);
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

/* A chain of a common pose begins with the identity. */
static int begin_fit(bool still, struct srnf_warp *fit)
{
    return still ? warp_append(fit, SRNF_WARP_ROTATION, 0, identity) : SRNF_OK;
}

static int append_fit(const struct refit *r, const double rotation[9], bool still,
                      struct srnf_warp *fit)
{
    int status = warp_append(fit, SRNF_WARP_EXP, r->degree, r->potentials);

    return status || still ? status : warp_append(fit, SRNF_WARP_ROTATION, 0, rotation);
}

/* R exp(v) = gamma in potentials of v; false where a point goes too far. */
static bool find_fit(const struct refit *r, const struct tabulated_target *target, bool still,
                     const struct cloud *cloud, double rotation[9])
{
    memcpy(rotation, identity, sizeof identity);
    if (!still) {
        nearest_rotation(target, cloud, rotation);
    }
    if (!take_logarithm(r, target, cloud, rotation)) {
        return false;
    }
    find_potentials(r);
    return true;
}

/* The fits of so many parts of a chain, appended to *fit: each from the identity. A chain of a
   common pose has no rotation but the identity that it begins with. */
static int fit_parts(const struct refit *r, const struct tabulated_problem *problem,
                     const struct srnf_warp *chain, size_t parts, struct cloud *spare,
                     struct srnf_warp *fit, bool *fits)
{
    bool still = warp_is_still(chain);
    int status = SRNF_OK;

    *fits = true;
    for (size_t part = 0; part < parts && *fits && status == SRNF_OK; part++) {
        size_t first = part * chain->n_links / parts;
        const struct srnf_warp links = {.links = chain->links + first,
                                        .n_links = (part + 1) * chain->n_links / parts - first};
        double rotation[9];

        cloud_rotate(spare, problem->target, identity);
        status = cloud_follow(spare, &links, &refit_rough, r->tools, NULL);
        *fits = status == SRNF_OK && find_fit(r, problem->target, still, spare, rotation);
        if (*fits) {
            status = append_fit(r, rotation, still, fit);
        }
    }
    return status;
}

/* The cloud at the points of a fit, and measured; the least Jacobian of its steps. */
static int place(const struct refit *r, const struct tabulated_problem *problem,
                 const struct srnf_warp *fit, struct cloud *to, double *least)
{
    struct tabulated_fields fields = {0};
    int status = tools_fields(r->tools, r->degree, r->table->order,
                              field_table_rows(r->table, r->degree), &fields);

    if (status) {
        return status;
    }
    *least = INFINITY;
    cloud_rotate(to, problem->target, identity);
    for (size_t k = 0; k < fit->n_links; k++) {
        if (fit->links[k].kind == SRNF_WARP_ROTATION) {
            cloud_turn(to, fit->links[k].values);
        } else {
            tabulated_fields_fill(&fields, fit->links[k].values);
            *least = fmin(*least, cloud_move(&fields.table, to, to));
        }
    }
    tools_return_fields(r->tools, &fields);
    if (*least >= LEAST_JACOBIAN) {
        cloud_evaluate(problem->moving, to);
        cloud_measure(problem, to);
    }
    return SRNF_OK;
}

/* The fit instead of the chain, if it is as good. */
static int take(const struct refit *r, const struct tabulated_problem *problem, double worse,
                struct cloud *cloud, struct cloud *spare, struct srnf_warp *fit,
                struct srnf_warp *chain, bool *taken)
{
    double least;
    int status = place(r, problem, fit, spare, &least);

    *taken = status == SRNF_OK && least >= LEAST_JACOBIAN &&
             spare->objective <= (1.0 + worse) * cloud->objective;
    if (*taken) {
        struct srnf_warp replaced = *chain;
        struct cloud kept = *cloud;

        *chain = *fit;
        *fit = replaced;
        *cloud = *spare;
        *spare = kept;
    }
    return status;
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

static int refit_whole(const struct refit *r, const struct tabulated_problem *problem, double worse,
                       struct cloud *cloud, struct cloud *spare, struct srnf_warp *chain,
                       bool *taken)
{
    bool still = warp_is_still(chain);
    struct srnf_warp fit = {0};
    double rotation[9];
    int status;

    if (!find_fit(r, problem->target, still, cloud, rotation)) {
        return SRNF_OK;
    }
    status = begin_fit(still, &fit);
    status = status ? status : append_fit(r, rotation, still, &fit);
    status = status ? status : take(r, problem, worse, cloud, spare, &fit, chain, taken);
    srnf_warp_clear(&fit);
    return status;
}

static int refit_parts(const struct refit *r, const struct tabulated_problem *problem, size_t parts,
                       double worse, struct cloud *cloud, struct cloud *spare,
                       struct srnf_warp *chain, bool *taken)
{
    struct srnf_warp fit = {0};
    bool fits;
    int status = begin_fit(warp_is_still(chain), &fit);

    status = status ? status : fit_parts(r, problem, chain, parts, spare, &fit, &fits);
    if (status == SRNF_OK && fits) {
        status = take(r, problem, worse, cloud, spare, &fit, chain, taken);
    }
    srnf_warp_clear(&fit);
    return status;
}

int warp_refit(const struct tabulated_problem *problem, const struct nodes_of *grid,
               const struct refit_terms *terms, struct tabulated_tools *tools, struct cloud *cloud,
               struct cloud *spare, struct srnf_warp *chain)
{
    struct refit r;
    bool taken = false;
    int status = open_refit(&r, grid, terms, tools);

    if (status == SRNF_OK) {
        status = refit_whole(&r, problem, terms->worse, cloud, spare, chain, &taken);
    }
    for (size_t parts = 2;
         parts <= PARTS_MAX && !taken && chain->n_links >= LINKS_PART * parts && status == SRNF_OK;
         parts *= 2) {
        status = refit_parts(&r, problem, parts, PARTS_WORSE * terms->worse, cloud, spare, chain,
                             &taken);
    }
    close_refit(&r);
    return status;
}
