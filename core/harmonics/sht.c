/*
 * sht.c - the transform object: nodes, Legendre tables, FFTW plans, workspace, and packing of
 * coefficients.
 *
 * Tables take (L + 1)(L + 2) / 2 rows of 3 n_theta / 2 doubles: 0.6 MB at degree 31, 19 MB at 127.
 * Plans are made with FFTW_ESTIMATE, which consults no clock: the same machine always gets the same
 * plan and the same bits.
 */
#include "harmonics.h"

#include <math.h>

static size_t round_up(size_t n, size_t multiple)
{
    return (n + multiple - 1) / multiple * multiple;
}

static size_t orders_total(size_t degree)
{
    return (degree + 1) * (degree + 2) / 2;
}

/* Fills both tables, one northern row after the other. p: scratch, 1 + LEGENDRE_FACTORS times
   orders_total(degree). */
static void fill_tables(struct srnf_sht *sht, double *p)
{
    size_t degree = sht->degree;
    double *factors = p + orders_total(degree);

    sphere_legendre_factors(degree, factors);
    for (size_t row = 0; row < sht->north; row++) {
        sphere_legendre(degree, factors, sht->grid.cos_theta[row], sht->grid.sin_theta[row], p);
        for (size_t m = 0; m <= degree; m++) {
            size_t offset = sphere_order_offset(degree, m);

            for (size_t l = m; l <= degree; l++) {
                size_t k = offset + l - m;
                double factor = m > 0 ? sqrt(2.0) : 1.0;
                double d_theta = 0.0;
                double m_over_sin = 0.0;
                double *spin = sht->spin + k * 2 * sht->half_rows;

                if (l > 0) {
                    sphere_legendre_gradient(factors, p, l, m, &d_theta, &m_over_sin);
                }
                sht->scalar[k * sht->scalar_rows + row] = factor * p[l * (l + 1) / 2 + m];
                spin[row] = 0.5 * (d_theta - m_over_sin);
                spin[sht->half_rows + row] = 0.5 * (d_theta + m_over_sin);
            }
        }
    }
}

static int make_plans(struct sphere_plans *plans, size_t n_phi)
{
    int n = (int)n_phi;
    int many = (int)(2 * BLOCK_ROWS);
    size_t row = 2 * n_phi;
    double *memory = srnf_alloc(2 * 2 * BLOCK_ROWS * row, sizeof(double));
    fftw_complex *a = (fftw_complex *)(void *)memory;
    fftw_complex *b;

    if (!memory) {
        return SRNF_ENOMEM;
    }
    b = (fftw_complex *)(void *)(memory + 2 * BLOCK_ROWS * row);
    plans->backward =
        fftw_plan_many_dft(1, &n, many, a, NULL, 1, n, b, NULL, 1, n, FFTW_BACKWARD, FFTW_ESTIMATE);
    plans->forward =
        fftw_plan_many_dft(1, &n, many, a, NULL, 1, n, b, NULL, 1, n, FFTW_FORWARD, FFTW_ESTIMATE);
    plans->to_real = fftw_plan_dft_c2r_1d(n, a, (double *)b, FFTW_ESTIMATE | FFTW_UNALIGNED);
    plans->from_real = fftw_plan_dft_r2c_1d(n, (double *)a, b, FFTW_ESTIMATE | FFTW_UNALIGNED);
    srnf_free(memory);
    return plans->backward && plans->forward && plans->to_real && plans->from_real ? SRNF_OK
                                                                                   : SRNF_ENOMEM;
}

static void destroy_plans(struct sphere_plans *plans)
{
    fftw_destroy_plan(plans->backward);
    fftw_destroy_plan(plans->forward);
    fftw_destroy_plan(plans->to_real);
    fftw_destroy_plan(plans->from_real);
}

/* Even, at least 2 (degree + 1), and a product of small primes, of which transforms are fast. */
static size_t fewest_meridians(size_t degree)
{
    for (size_t n = 2 * (degree + 1);; n += 2) {
        size_t rest = n;

        for (size_t prime = 2; prime <= 5; prime++) {
            while (rest % prime == 0) {
                rest /= prime;
            }
        }
        if (rest == 1) {
            return n;
        }
    }
}

static int make_nodes(struct srnf_sht *sht)
{
    size_t n = sht->grid.n_theta;
    double *theta;

    sht->nodes = srnf_alloc(4 * n, sizeof(double));
    if (!sht->nodes) {
        return SRNF_ENOMEM;
    }
    theta = sht->nodes;
    if (sht->grid.kind == SRNF_GRID_GAUSS_LEGENDRE) {
        sphere_gauss_legendre(n, theta, theta + n, theta + 2 * n, theta + 3 * n);
    } else {
        long double *scratch = srnf_alloc(2 * n, sizeof *scratch);

        if (!scratch) {
            return SRNF_ENOMEM;
        }
        sphere_clenshaw_curtis(n, scratch, theta, theta + n, theta + 2 * n, theta + 3 * n);
        srnf_free(scratch);
    }
    for (size_t i = 0; i < n; i++) {
        theta[3 * n + i] *= 2.0 * SRNF_PI / (double)sht->grid.n_phi;
    }
    sht->grid.theta = theta;
    sht->grid.cos_theta = theta + n;
    sht->grid.sin_theta = theta + 2 * n;
    sht->grid.weight = theta + 3 * n;
    return SRNF_OK;
}

static bool shape_is_valid(size_t degree, enum srnf_grid_kind kind, size_t n_theta, size_t n_phi)
{
    size_t least = kind == SRNF_GRID_EQUIANGULAR ? 2 * degree + 1 : degree + 1;

    if (kind != SRNF_GRID_GAUSS_LEGENDRE && kind != SRNF_GRID_EQUIANGULAR) {
        return false;
    }
    if (degree > SRNF_TRANSFORM_DEGREE_MAX || n_theta > SRNF_GRID_ROWS_MAX ||
        n_phi > 4 * SRNF_GRID_ROWS_MAX) {
        return false;
    }
    return n_theta >= least && n_theta >= 2 && n_phi >= 2 * degree + 1;
}

/* A transform with nodes and tables, on a grid of a valid shape; its plans are NULL. */
static int create_unplanned(struct srnf_sht **out, size_t degree, const struct srnf_grid *shape)
{
    struct srnf_sht *sht = srnf_alloc(1, sizeof *sht);
    double *p = NULL;
    int status = SRNF_ENOMEM;

    *out = sht;
    if (!sht) {
        return SRNF_ENOMEM;
    }
    *sht = (struct srnf_sht){.degree = degree};
    sht->grid.kind = shape->kind;
    sht->grid.n_theta = shape->n_theta;
    sht->grid.n_phi = shape->n_phi;
    sht->north = (shape->n_theta + 1) / 2;
    sht->equator = shape->n_theta % 2 == 1;
    sht->half_rows = round_up(sht->north, BLOCK_ROWS);
    sht->scalar_rows = round_up(sht->north, 8);
    sht->scalar = srnf_alloc(orders_total(degree) * sht->scalar_rows, sizeof(double));
    sht->spin = srnf_alloc(orders_total(degree) * 2 * sht->half_rows, sizeof(double));
    p = srnf_alloc((1 + LEGENDRE_FACTORS) * orders_total(degree), sizeof(double));
    if (sht->scalar && sht->spin && p) {
        status = make_nodes(sht);
    }
    if (status == SRNF_OK) {
        fill_tables(sht, p);
    }
    srnf_free(p);
    return status;
}

int srnf_sht_create(struct srnf_sht **out, size_t degree, enum srnf_grid_kind kind, size_t n_theta,
                    size_t n_phi)
{
    struct srnf_sht *sht = NULL;
    int status;

    *out = NULL;
    if (n_theta == 0 && degree <= SRNF_TRANSFORM_DEGREE_MAX) {
        n_theta = kind == SRNF_GRID_EQUIANGULAR ? 2 * degree + 1 : srnf_working_rows(degree);
        n_theta = n_theta < 2 ? 2 : n_theta;
    }
    if (n_phi == 0 && n_theta <= SRNF_GRID_ROWS_MAX) {
        n_phi = 2 * n_theta;
    }
    if (!shape_is_valid(degree, kind, n_theta, n_phi)) {
        return SRNF_EINVAL;
    }
    status = create_unplanned(
        &sht, degree, &(struct srnf_grid){.kind = kind, .n_theta = n_theta, .n_phi = n_phi});
    if (status == SRNF_OK) {
        status = make_plans(&sht->plans, n_phi);
    }
    if (status == SRNF_OK) {
        sht->least_phi = fewest_meridians(degree);
        if (sht->least_phi < n_phi) {
            status = make_plans(&sht->least, sht->least_phi);
        }
    }
    if (status) {
        srnf_sht_destroy(sht);
    } else {
        *out = sht;
    }
    return status;
}

int sphere_sht_least(struct srnf_sht **out, const struct srnf_sht *of)
{
    bool fewer = of->least_phi < of->grid.n_phi;
    const struct srnf_grid shape = {.kind = SRNF_GRID_GAUSS_LEGENDRE,
                                    .n_theta = of->degree + 1,
                                    .n_phi = fewer ? of->least_phi : of->grid.n_phi};
    struct srnf_sht *sht = NULL;
    int status = create_unplanned(&sht, of->degree, &shape);

    *out = NULL;
    if (sht) {
        sht->borrowed = true;
        sht->plans = fewer ? of->least : of->plans;
        sht->least_phi = shape.n_phi;
    }
    if (status) {
        srnf_sht_destroy(sht);
    } else {
        *out = sht;
    }
    return status;
}

void srnf_sht_destroy(struct srnf_sht *sht)
{
    if (!sht) {
        return;
    }
    if (!sht->borrowed) {
        destroy_plans(&sht->plans);
        destroy_plans(&sht->least);
    }
    srnf_free(sht->nodes);
    srnf_free(sht->scalar);
    srnf_free(sht->spin);
    srnf_free(sht);
}

const struct srnf_grid *srnf_sht_grid(const struct srnf_sht *sht)
{
    return &sht->grid;
}

size_t srnf_sht_degree(const struct srnf_sht *sht)
{
    return sht->degree;
}

static size_t x_doubles(const struct srnf_sht *sht)
{
    return round_up((sht->degree + 1) * PASS_COLUMNS, 8);
}

static size_t folded_doubles(const struct srnf_sht *sht)
{
    return (sht->degree + 1) * 2 * PASS_COLUMNS * 2 * round_up(sht->half_rows, 8);
}

static size_t rows_doubles(const struct srnf_sht *sht)
{
    return round_up(2 * BLOCK_ROWS * 2 * sht->grid.n_phi, 8);
}

/* Doubles of workspace for x, the folded rows of all orders, and the row buffers. */
static size_t workspace_doubles(const struct srnf_sht *sht)
{
    return x_doubles(sht) + folded_doubles(sht) + 2 * rows_doubles(sht);
}

size_t srnf_sht_workspace_size(const struct srnf_sht *sht, size_t batch)
{
    (void)batch; /* fields are carried three at a time, whatever their number */
    return workspace_doubles(sht) * sizeof(double);
}

struct sphere_workspace sphere_workspace_split(const struct srnf_sht *sht, void *workspace)
{
    struct sphere_workspace parts;

    parts.x = workspace;
    parts.folded = parts.x + x_doubles(sht);
    parts.rows = parts.folded + folded_doubles(sht);
    parts.rows2 = parts.rows + rows_doubles(sht);
    return parts;
}

void sphere_pack(size_t degree, size_t m, size_t fields, const double *coefficients, double *x)
{
    size_t count = srnf_coefficient_count(degree);

    for (size_t l = m; l <= degree; l++) {
        for (size_t f = 0; f < fields; f++) {
            const double *c = coefficients + f * count + l * l + l;

            *x++ = c[m];
            *x++ = m > 0 ? *(c - m) : 0.0;
        }
    }
}

void sphere_unpack(size_t degree, size_t m, size_t fields, const double *x, double *coefficients)
{
    size_t count = srnf_coefficient_count(degree);

    for (size_t l = m; l <= degree; l++) {
        for (size_t f = 0; f < fields; f++) {
            double *c = coefficients + f * count + l * l + l;

            if (m > 0) {
                *(c - m) = x[1];
            }
            c[m] = x[0];
            x += 2;
        }
    }
}
