/*
 * fields.c - the surfaces of a group and their SRNFs as vectors of L2.
 */
#include "stats.h"
#include "srnf/field.h"

#include <cblas.h>
#include <math.h>

int stats_check_surfaces(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                         struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));

    if (n == 0) {
        return srnf_fail(error, SRNF_EINVAL, -1, "there is no surface");
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < count; k++) {
            if (!isfinite(surfaces[i][k])) {
                return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                                 "surface %zu has a coefficient that is not finite", i);
            }
        }
    }
    return SRNF_OK;
}

struct fields_loop {
    const struct srnf_sht *sht;
    enum srnf_representation representation;
    const double *const *surfaces;
    double *q;
};

static int field_of_one(void *argument, size_t i, const struct srnf_context *context,
                        struct srnf_error *error)
{
    struct fields_loop *loop = argument;
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(loop->sht));

    (void)context;
    (void)error;
    if (!workspace) {
        return SRNF_ENOMEM;
    }
    field_represent(loop->sht, loop->representation, loop->surfaces[i],
                    loop->q + i * 3 * stats_points(srnf_sht_grid(loop->sht)), workspace);
    srnf_free(workspace);
    return SRNF_OK;
}

int stats_fields(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                 const struct srnf_context *context, double *q, struct srnf_error *error)
{
    return stats_represent(sht, SRNF_REPRESENTATION_SRNF, n, surfaces, context, q, error);
}

int stats_represent(const struct srnf_sht *sht, enum srnf_representation representation, size_t n,
                    const double *const *surfaces, const struct srnf_context *context, double *q,
                    struct srnf_error *error)
{
    struct fields_loop loop = {sht, representation, surfaces, q};

    return stats_run(context, n, field_of_one, &loop, (struct stats_progress){0}, error);
}

double stats_distance2(const struct srnf_grid *grid, const double *a, const double *b)
{
    size_t points = stats_points(grid);
    double sum = 0.0;

    for (size_t row = 0; row < grid->n_theta; row++) {
        double line = 0.0;

        for (size_t c = 0; c < 3; c++) {
            size_t first = c * points + row * grid->n_phi;

            for (size_t k = first; k < first + grid->n_phi; k++) {
                double d = a[k] - b[k];

                line += d * d;
            }
        }
        sum += grid->weight[row] * line;
    }
    return sum;
}

void stats_average(const struct srnf_grid *grid, size_t n, const double *q, double *mean)
{
    size_t size = 3 * stats_points(grid);

    for (size_t k = 0; k < size; k++) {
        mean[k] = 0.0;
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < size; k++) {
            mean[k] += q[i * size + k];
        }
    }
    for (size_t k = 0; k < size; k++) {
        mean[k] /= (double)n;
    }
}

void stats_weight(const struct srnf_grid *grid, size_t n, const double *q, const double *centre,
                  double *out)
{
    size_t points = stats_points(grid);
    size_t size = 3 * points;

    for (size_t k = 0; k < size; k++) {
        double root = sqrt(grid->weight[k % points / grid->n_phi]);

        for (size_t i = 0; i < n; i++) {
            out[i * size + k] = root * (q[i * size + k] - (centre ? centre[k] : 0.0));
        }
    }
}

int stats_gram(size_t n, size_t size, const double *x, double *gram, struct srnf_error *error)
{
    cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, (int)n, (int)size, 1.0, x, (int)size, 0.0,
                gram, (int)n);
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(gram[i * n + i])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                             "the SRNF of surface %zu is not finite", i);
        }
        for (size_t j = 0; j < i; j++) {
            gram[i * n + j] = gram[j * n + i];
        }
    }
    return SRNF_OK;
}

void stats_nodes(const struct srnf_grid *grid, double *nodes)
{
    for (size_t row = 0; row < grid->n_theta; row++) {
        for (size_t j = 0; j < grid->n_phi; j++) {
            double phi = 2.0 * SRNF_PI * (double)j / (double)grid->n_phi;
            double *node = nodes + 3 * (row * grid->n_phi + j);

            node[0] = grid->sin_theta[row] * cos(phi);
            node[1] = grid->sin_theta[row] * sin(phi);
            node[2] = grid->cos_theta[row];
        }
    }
}
