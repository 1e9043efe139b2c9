/*
 * geodesic.c - two meshes, laid on each other, and the elastic geodesic that joins them.
 *
 *   cc geodesic.c -o geodesic $(pkg-config --cflags --libs srnf)
 *   ./geodesic FROM.ply TO.ply     writes step_0.ply .. step_6.ply
 */
#include "files.h"

int main(int argc, char **argv)
{
    struct srnf_register_options matching = srnf_register_options_defaults();
    struct srnf_geodesic_options path = srnf_geodesic_options_defaults();
    struct srnf_error error = {0};
    struct srnf_registration laid;
    struct srnf_geodesic geodesic;
    struct srnf_sht *sht;
    double *from, *to;

    if (argc != 3) {
        (void)fprintf(stderr, "usage: %s FROM TO\n", argv[0]);
        return EXIT_FAILURE;
    }
    demand(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), "transform", NULL);
    from = encode_file(argv[1]);
    to = encode_file(argv[2]);

    /* Rotation and parameterization of the second, so that it lies best on the first. */
    demand(srnf_register(sht, from, NULL, to, &matching, NULL, NULL, &laid, &error), "registration",
           &error);
    (void)printf("distance %.4f as they came, %.4f registered\n", laid.distance_before,
                 laid.distance);

    demand(srnf_geodesic(sht, from, laid.coefficients, &path, NULL, &geodesic, &error), "geodesic",
           &error);
    for (size_t i = 0; i < geodesic.steps; i++) {
        const size_t stride = 3 * srnf_coefficient_count(DEGREE);
        char name[32];

        (void)snprintf(name, sizeof name, "step_%zu.ply", i);
        write_surface(name, geodesic.coefficients + i * stride);
    }
    (void)printf("%zu surfaces, path length %.4f\n", geodesic.steps, geodesic.length);

    srnf_geodesic_clear(&geodesic);
    srnf_registration_clear(&laid);
    srnf_free(to);
    srnf_free(from);
    srnf_sht_destroy(sht);
    return EXIT_SUCCESS;
}
