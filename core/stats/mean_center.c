/*
 * mean_center.c - keeps the parameterisation of a group mean centred.
 *
 * The mean is defined up to a common warp of all subjects: (q_i, gamma_i) may be replaced by (q_i,
 * gamma_i o c) for any diffeomorphism c, which moves the mean along its orbit and changes no
 * distance. Left alone it stays wherever the first template put it. Centring takes the c that makes
 * the warps the identity on average:
 *
 *   delta_i = A_i^-1 gamma_i,   A_i the rotation nearest to gamma_i: the polar factor of the matrix
 *                               integral gamma_i(s) s', or the identity in a common pose
 *   v(s) = (1/n) sum_i log_s(delta_i(s)),  projected on gradients and curls up to the field degree
 *   c = the inverse of s -> exp_s(v(s))
 *
 * Taking A_i out makes v independent of the pose in which each subject was parameterised. c is one
 * more link, the first one, of a chain that comes before the warps of all subjects: its points are
 * computed once for all. The mean of the logarithms then vanishes to second
 * order in what the single warps differ by; the next iteration takes out what is left.
 *
 * The potentials of the projection: phi_lm = <v, grad Y_lm> / (l (l + 1)) and psi_lm = <v, s x grad
 * Y_lm> / (l (l + 1)), both by the adjoint of the gradient transform, since <v, s x g> = <v x s,
 * g>.
 */
#include "stats.h"

#include <lapacke.h>
#include <math.h>
#include <string.h>

/* Bounds of the Jacobian of one step on the grid: beyond them it could fold between the nodes. */
#define JACOBIAN_MIN 0.5
#define JACOBIAN_MAX 2.0
#define HALVINGS_MAX 10
#define BLOCK ((size_t)256) /* points whose centring is replayed together */

struct center {
    struct mean_run *run;
    size_t degree, each; /* of the field; (degree + 1)^2 */
    double *field;       /* [P][3]: v */
    double *components;  /* [4][P], weighted: v_theta and v_phi, then v_phi and -v_theta */
    double *expansion;   /* [2][(L+1)^2] */
    double *potentials;  /* [2][each] of v */
    void *workspace;
};

/* ---- The mean of the warps ------------------------------------------------------------------- */

static double determinant(const double m[9])
{
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/* A: the rotation that is nearest to gamma in L2 (W. Kabsch 1976). */
static int nearest_rotation(const struct mean_run *run, const double *gamma, double rotation[9])
{
    double moments[9] = {0};
    double s[3];
    double u[9];
    double vt[9];
    double work[64];
    double sign;

    for (size_t k = 0; k < run->points; k++) {
        double weight = run->grid->weight[k / run->grid->n_phi];

        for (size_t c = 0; c < 3; c++) {
            for (size_t d = 0; d < 3; d++) {
                moments[c + 3 * d] += weight * gamma[3 * k + c] * run->nodes[3 * k + d];
            }
        }
    }
    if (LAPACKE_dgesvd_work(LAPACK_COL_MAJOR, 'A', 'A', 3, 3, moments, 3, s, u, 3, vt, 3, work,
                            64)) {
        return SRNF_ENUMERIC;
    }
    sign = determinant(u) * determinant(vt) < 0.0 ? -1.0 : 1.0;
    for (size_t c = 0; c < 3; c++) {
        for (size_t d = 0; d < 3; d++) {
            rotation[3 * c + d] =
                u[c] * vt[3 * d] + u[c + 3] * vt[1 + 3 * d] + sign * u[c + 6] * vt[2 + 3 * d];
        }
    }
    return SRNF_OK;
}

/* sum += log_s(A^-1 p): the tangent vector at s that leads to it. 0 for the antipode, where no
   direction is the shortest. */
static void add_logarithm(const double *s, const double *p, const double a[9], double *sum)
{
    double x[3];
    double tangent[3];
    double along = 0.0;
    double across = 0.0;
    double factor;

    for (size_t c = 0; c < 3; c++) {
        x[c] = a[c] * p[0] + a[3 + c] * p[1] + a[6 + c] * p[2];
        along += x[c] * s[c];
    }
    for (size_t c = 0; c < 3; c++) {
        tangent[c] = x[c] - along * s[c];
        across += tangent[c] * tangent[c];
    }
    across = sqrt(across);
    factor = across > 0.0 ? atan2(across, along) / across : 0.0;
    for (size_t c = 0; c < 3; c++) {
        sum[c] += factor * tangent[c];
    }
}

/* v on the grid, and the root of its mean square. */
static int mean_field(struct center *center, double *spread)
{
    struct mean_run *run = center->run;
    double square = 0.0;

    for (size_t i = 0; i < run->n; i++) {
        const double *gamma = run->gamma + 3 * i * run->points;
        double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

        if (!run->registration.common_pose) {
            int status = nearest_rotation(run, gamma, rotation);

            if (status) {
                return status;
            }
        }
        for (size_t k = 0; k < run->points; k++) {
            add_logarithm(run->nodes + 3 * k, gamma + 3 * k, rotation, center->field + 3 * k);
        }
    }
    for (size_t k = 0; k < 3 * run->points; k++) {
        center->field[k] /= (double)run->n;
        square += run->grid->weight[k / 3 / run->grid->n_phi] * center->field[k] * center->field[k];
    }
    *spread = sqrt(square / (4.0 * SRNF_PI));
    return SRNF_OK;
}

/* ---- The step -------------------------------------------------------------------------------- */

/* Potentials of v, projected. */
static void project(struct center *center)
{
    const struct mean_run *run = center->run;
    const struct srnf_grid *grid = run->grid;
    size_t n = run->points;
    size_t full = srnf_coefficient_count(srnf_sht_degree(run->sht));
    double *d_theta = center->components;
    double *d_phi = d_theta + 2 * n;

    for (size_t k = 0; k < n; k++) {
        size_t row = k / grid->n_phi;
        double longitude = 2.0 * SRNF_PI * (double)(k % grid->n_phi) / (double)grid->n_phi;
        double cosine = cos(longitude);
        double sine = sin(longitude);
        const double *v = center->field + 3 * k;
        double southward =
            grid->cos_theta[row] * (cosine * v[0] + sine * v[1]) - grid->sin_theta[row] * v[2];
        double eastward = cosine * v[1] - sine * v[0];

        d_theta[k] = grid->weight[row] * southward;
        d_phi[k] = grid->weight[row] * eastward;
        d_theta[n + k] = grid->weight[row] * eastward;
        d_phi[n + k] = -grid->weight[row] * southward;
    }
    srnf_sht_gradient_adjoint(run->sht, 2, d_theta, d_phi, center->expansion, center->workspace);
    for (size_t l = 1; l <= center->degree; l++) {
        double factor = 1.0 / ((double)l * (double)(l + 1));

        for (size_t lm = l * l; lm < (l + 1) * (l + 1); lm++) {
            center->potentials[lm] = factor * center->expansion[lm];
            center->potentials[center->each + lm] = factor * center->expansion[full + lm];
        }
    }
}

/* Halves v until no area changes too much under its exponential, and so under the inverse. The
   points and J of the step go where field and components were: they are free by then. */
static int shorten(struct center *center)
{
    const struct mean_run *run = center->run;
    struct srnf_warp_link link = {SRNF_WARP_EXP, center->degree, center->potentials};
    struct srnf_warp step = {1, 1, &link};

    for (size_t halvings = 0; halvings < HALVINGS_MAX; halvings++) {
        double least = 1.0;
        double most = 1.0;
        int status =
            srnf_warp_apply(&step, run->points, run->nodes, center->field, center->components);

        if (status) {
            return status;
        }
        for (size_t k = 0; k < run->points; k++) {
            least = fmin(least, center->components[k]);
            most = fmax(most, center->components[k]);
        }
        if (least >= JACOBIAN_MIN && most <= JACOBIAN_MAX) {
            break;
        }
        for (size_t k = 0; k < 2 * center->each; k++) {
            center->potentials[k] *= 0.5;
        }
    }
    return SRNF_OK;
}

/* Puts c in front of the centring. */
static int prepend(const struct center *center)
{
    struct srnf_warp *warp = &center->run->centring;
    struct srnf_warp_link *links = srnf_alloc(warp->n_links + 1, sizeof *links);
    double *values = srnf_alloc(2 * center->each, sizeof(double));

    if (!links || !values) {
        srnf_free(links);
        srnf_free(values);
        return SRNF_ENOMEM;
    }
    memcpy(values, center->potentials, 2 * center->each * sizeof(double));
    links[0] = (struct srnf_warp_link){SRNF_WARP_EXP_INVERSE, center->degree, values};
    for (size_t k = 0; k < warp->n_links; k++) {
        links[k + 1] = warp->links[k];
    }
    srnf_free(warp->links);
    warp->links = links;
    warp->n_links++;
    warp->capacity = warp->n_links;
    return SRNF_OK;
}

/* A block of points; blocks are the same however many threads there are. */
static int replay_block(void *argument, size_t block, const struct srnf_context *context,
                        struct srnf_error *error)
{
    const struct mean_run *run = argument;
    size_t first = block * BLOCK;
    size_t count = run->points - first < BLOCK ? run->points - first : BLOCK;

    (void)context;
    (void)error;
    return srnf_warp_apply(&run->centring, count, run->nodes + 3 * first, run->base + 3 * first,
                           run->base_jacobian + first);
}

int mean_replay_base(struct mean_run *run)
{
    return stats_run(run->context, (run->points + BLOCK - 1) / BLOCK, replay_block, run,
                     (struct stats_progress){0}, NULL);
}

int mean_center(struct mean_run *run, double *spread)
{
    size_t limit = srnf_sht_degree(run->sht);
    size_t degree = run->registration.degree < limit ? run->registration.degree : limit;
    struct center center = {.run = run, .degree = degree, .each = srnf_coefficient_count(degree)};
    double size = 0.0;
    int status = SRNF_ENOMEM;

    center.field = srnf_alloc(3 * run->points, sizeof(double));
    center.components = srnf_alloc(4 * run->points, sizeof(double));
    center.expansion = srnf_alloc(2 * srnf_coefficient_count(limit), sizeof(double));
    center.potentials = srnf_alloc(2 * center.each, sizeof(double));
    center.workspace = srnf_alloc(1, srnf_sht_workspace_size(run->sht, 2));
    if (!center.field || !center.components || !center.expansion || !center.potentials ||
        !center.workspace) {
        goto out;
    }
    status = mean_field(&center, &size);
    if (status) {
        goto out;
    }
    project(&center);
    status = shorten(&center);
    status = status ? status : prepend(&center);
    status = status ? status : mean_replay_base(run);
    if (status == SRNF_OK && spread) {
        *spread = size;
    }
out:
    srnf_free(center.field);
    srnf_free(center.components);
    srnf_free(center.expansion);
    srnf_free(center.potentials);
    srnf_free(center.workspace);
    return status;
}
