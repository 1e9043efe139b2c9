/*
 * transform.c - scalar synthesis, its adjoint, and analysis.
 *
 * values(theta, phi) = sum_m A_m cos(m phi) + B_m sin(m phi), A_m = sum_l P_lm a_lm, B_m = sum_l
 * P_lm b_lm. Since P_lm(pi - theta) = (-1)^(l-m) P_lm(theta), sums over even and odd l - m on the
 * northern rows give both hemispheres. Layout of the folded buffer: [m][parity of l -
 * m][column][scalar_rows], column = 2 field + (0 cos, 1 sin).
 */
#include "harmonics.h"

#include <string.h>

/* One row of one field: where its folded columns are, and on which side of the equator it lies. */
struct line {
    const struct srnf_sht *sht;
    size_t column, columns, row;
    bool south;
};

static const double *line_entry(const struct line *line, const double *folded, size_t m,
                                size_t parity)
{
    size_t rows = line->sht->scalar_rows;

    return folded + ((2 * m + parity) * line->columns + line->column) * rows + line->row;
}

static void synthesise_line(const struct line *line, const double *folded, double *spectrum,
                            double *values)
{
    const struct srnf_sht *sht = line->sht;
    size_t rows = sht->scalar_rows;
    double sign = line->south ? -1.0 : 1.0;

    memset(spectrum, 0, 2 * (sht->grid.n_phi / 2 + 1) * sizeof(double));
    for (size_t m = 0; m <= sht->degree; m++) {
        const double *even = line_entry(line, folded, m, 0);
        const double *odd = line_entry(line, folded, m, 1);
        double half = m > 0 ? 0.5 : 1.0;

        spectrum[2 * m] = half * (even[0] + sign * odd[0]);
        spectrum[2 * m + 1] = m > 0 ? -half * (even[rows] + sign * odd[rows]) : 0.0;
    }
    fftw_execute_dft_c2r(sht->plans.to_real, (fftw_complex *)(void *)spectrum, values);
}

static void synthesis_pass(const struct srnf_sht *sht, size_t fields, const double *coefficients,
                           double *values, const struct sphere_workspace *work)
{
    size_t n_phi = sht->grid.n_phi;
    size_t last = sht->grid.n_theta - 1;
    size_t parity = 2 * fields * sht->scalar_rows;

    for (size_t m = 0; m <= sht->degree; m++) {
        const double *table = sht->scalar + sphere_order_offset(sht->degree, m) * sht->scalar_rows;

        sphere_pack(sht->degree, m, fields, coefficients, work->x);
        for (size_t p = 0; p < 2; p++) {
            sphere_kernel_forward(sht->scalar_rows, 2 * fields, p, sht->degree + 1 - m, table,
                                  work->x, work->folded + (2 * m + p) * parity);
        }
    }
    for (size_t f = 0; f < fields; f++) {
        double *field = values + f * sht->grid.n_theta * n_phi;

        for (size_t row = 0; row < sht->north; row++) {
            struct line line = {sht, 2 * f, 2 * fields, row, false};

            synthesise_line(&line, work->folded, work->rows, field + row * n_phi);
            if (last - row != row) {
                line.south = true;
                synthesise_line(&line, work->folded, work->rows, field + (last - row) * n_phi);
            }
        }
    }
}

void srnf_sht_synthesis(const struct srnf_sht *sht, size_t batch, const double *coefficients,
                        double *values, void *workspace)
{
    struct sphere_workspace work = sphere_workspace_split(sht, workspace);
    size_t count = srnf_coefficient_count(sht->degree);
    size_t points = sht->grid.n_theta * sht->grid.n_phi;

    for (size_t done = 0; done < batch; done += PASS_FIELDS) {
        size_t fields = batch - done < PASS_FIELDS ? batch - done : PASS_FIELDS;

        synthesis_pass(sht, fields, coefficients + done * count, values + done * points, &work);
    }
}

/* Adds the spectrum of one row, times factor, to the folded columns of its northern twin. */
static void fold_line(const struct line *line, const double *spectrum, double factor,
                      double *folded)
{
    const struct srnf_sht *sht = line->sht;
    size_t rows = sht->scalar_rows;

    for (size_t m = 0; m <= sht->degree; m++) {
        double *even = folded + ((2 * m) * line->columns + line->column) * rows + line->row;
        double *odd = even + line->columns * rows;
        double cosine = factor * spectrum[2 * m];
        double sine = -factor * spectrum[2 * m + 1];

        if (line->south) {
            even[0] += cosine;
            even[rows] += sine;
            odd[0] -= cosine;
            odd[rows] -= sine;
        } else {
            even[0] = cosine;
            even[rows] = sine;
            odd[0] = cosine;
            odd[rows] = sine;
        }
    }
}

/* weighted: multiply each row by its quadrature weight on the way. */
static void adjoint_pass(const struct srnf_sht *sht, size_t fields, const double *values,
                         bool weighted, double *coefficients, const struct sphere_workspace *work)
{
    size_t n_phi = sht->grid.n_phi;
    size_t last = sht->grid.n_theta - 1;
    size_t parity = 2 * fields * sht->scalar_rows;
    fftw_complex *spectrum = (fftw_complex *)(void *)work->rows2;

    memset(work->folded, 0, (sht->degree + 1) * 2 * parity * sizeof(double));
    for (size_t f = 0; f < fields; f++) {
        const double *field = values + f * sht->grid.n_theta * n_phi;

        for (size_t row = 0; row < sht->north; row++) {
            struct line line = {sht, 2 * f, 2 * fields, row, false};
            double factor = weighted ? sht->grid.weight[row] : 1.0;

            memcpy(work->rows, field + row * n_phi, n_phi * sizeof(double));
            fftw_execute_dft_r2c(sht->plans.from_real, work->rows, spectrum);
            fold_line(&line, work->rows2, factor, work->folded);
            if (last - row != row) {
                line.south = true;
                memcpy(work->rows, field + (last - row) * n_phi, n_phi * sizeof(double));
                fftw_execute_dft_r2c(sht->plans.from_real, work->rows, spectrum);
                fold_line(&line, work->rows2, factor, work->folded);
            }
        }
    }
    for (size_t m = 0; m <= sht->degree; m++) {
        const double *table = sht->scalar + sphere_order_offset(sht->degree, m) * sht->scalar_rows;

        for (size_t p = 0; p < 2; p++) {
            sphere_kernel_adjoint(sht->scalar_rows, 2 * fields, p, sht->degree + 1 - m, table,
                                  work->folded + (2 * m + p) * parity, work->x);
        }
        sphere_unpack(sht->degree, m, fields, work->x, coefficients);
    }
}

static void adjoint(const struct srnf_sht *sht, size_t batch, const double *values, bool weighted,
                    double *coefficients, void *workspace)
{
    struct sphere_workspace work = sphere_workspace_split(sht, workspace);
    size_t count = srnf_coefficient_count(sht->degree);
    size_t points = sht->grid.n_theta * sht->grid.n_phi;

    for (size_t done = 0; done < batch; done += PASS_FIELDS) {
        size_t fields = batch - done < PASS_FIELDS ? batch - done : PASS_FIELDS;

        adjoint_pass(sht, fields, values + done * points, weighted, coefficients + done * count,
                     &work);
    }
}

void srnf_sht_synthesis_adjoint(const struct srnf_sht *sht, size_t batch, const double *values,
                                double *coefficients, void *workspace)
{
    adjoint(sht, batch, values, false, coefficients, workspace);
}

void srnf_sht_analysis(const struct srnf_sht *sht, size_t batch, const double *values,
                       double *coefficients, void *workspace)
{
    adjoint(sht, batch, values, true, coefficients, workspace);
}
