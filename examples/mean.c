/*
 * mean.c - the mean of a folder's meshes, and what varies most about it.
 *
 *   cc mean.c -o mean $(pkg-config --cflags --libs srnf) -lm
 *   ./mean MESH..      writes mean.ply, and the first mode at two standard deviations below and
 *                      above it: minus.ply, plus.ply
 */
#include "files.h"

#include <math.h>

/* The surface whose SRNF lies `deviations` standard deviations out along the first mode. */
static void write_mode(const struct srnf_sht *sht, const struct srnf_mean *mean,
                       const struct srnf_pca *pca, double deviations, const char *path)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct srnf_invert_options options = srnf_invert_options_defaults();
    struct srnf_error error = {0};
    struct srnf_inversion surface;
    double *q = srnf_alloc(3 * grid->n_theta * grid->n_phi, sizeof *q);
    double *scores = srnf_alloc(pca->components, sizeof *scores);

    if (!q || !scores) {
        demand(SRNF_ENOMEM, path, NULL);
    }
    scores[0] = deviations * sqrt(pca->eigenvalues[0]);
    srnf_pca_reconstruct(grid, pca, mean->mean_q, scores, q);
    options.initial = SRNF_INITIAL_SURFACE;
    options.surface = mean->coefficients;
    options.certify = false;
    demand(srnf_invert(sht, q, &options, NULL, &surface, &error), path, &error);
    write_surface(path, surface.coefficients);
    srnf_inversion_clear(&surface);
    srnf_free(scores);
    srnf_free(q);
}

int main(int argc, char **argv)
{
    struct srnf_register_options matching = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_error error = {0};
    size_t n = argc > 1 ? (size_t)argc - 1 : 0;
    double **surfaces = calloc(n + 1, sizeof *surfaces);
    struct srnf_sht *sht;
    struct srnf_mean mean;
    struct srnf_pca pca;

    if (n < 2 || !surfaces) {
        (void)fprintf(stderr, "usage: %s MESH MESH..\n", argv[0]);
        return EXIT_FAILURE;
    }
    demand(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), "transform", NULL);
    for (size_t i = 0; i < n; i++) {
        surfaces[i] = encode_file(argv[i + 1]);
    }
    options.registration = &matching;
    demand(
        srnf_karcher_mean(sht, n, (const double *const *)surfaces, &options, NULL, &mean, &error),
        "mean", &error);
    demand(srnf_pca_fit(srnf_sht_grid(sht), n, mean.mean_q, mean.registered_q, 0, &pca),
           "principal components", NULL);
    if (pca.components == 0) {
        (void)fprintf(stderr, "the surfaces do not differ\n");
        return EXIT_FAILURE;
    }
    (void)printf("mean of %zu after %zu iterations; the first of %zu modes has %.0f %% of the "
                 "variance\n",
                 n, mean.iterations, pca.components, 100.0 * pca.explained[0]);
    write_surface("mean.ply", mean.coefficients);
    write_mode(sht, &mean, &pca, -2.0, "minus.ply");
    write_mode(sht, &mean, &pca, 2.0, "plus.ply");

    srnf_pca_clear(&pca);
    srnf_mean_clear(&mean);
    for (size_t i = 0; i < n; i++) {
        srnf_free(surfaces[i]);
    }
    free(surfaces);
    srnf_sht_destroy(sht);
    return EXIT_SUCCESS;
}
