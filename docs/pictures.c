/*
 * pictures.c - the pictures of README: a geodesic between two structures of tests/data, registered,
 * as it runs, coloured by how far each point has moved. "make pictures" writes them anew.
 *
 *   build/pictures FOLDER     FOLDER/geodesic_0.png .. geodesic_4.png
 */
#include "examples/files.h"

#include "paper/picture.h"

#define STEPS 5

static void write_picture(const char *folder, size_t step, const struct picture *picture)
{
    char path[400];
    FILE *file;

    (void)snprintf(path, sizeof path, "%s/geodesic_%zu.png", folder, step);
    file = fopen(path, "wb");
    if (!file || fwrite(picture->png, 1, picture->size, file) != picture->size ||
        fclose(file) != 0) {
        perror(path);
        exit(EXIT_FAILURE);
    }
}

int main(int argc, char **argv)
{
    struct srnf_register_options matching = srnf_register_options_defaults();
    struct srnf_geodesic_options path = srnf_geodesic_options_defaults();
    const size_t stride = 3 * srnf_coefficient_count(DEGREE);
    struct srnf_error error = {0};
    struct srnf_registration laid;
    struct srnf_geodesic geodesic;
    struct picture_view view;
    struct srnf_sht *sht;
    double *from, *to, most;

    if (argc != 2) {
        (void)fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return EXIT_FAILURE;
    }
    from = encode_file("tests/data/aal_subcortex/L_putamen.ply");
    to = encode_file("tests/data/aal_subcortex/L_hippocampus.ply");
    path.steps = STEPS;
    demand(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), "transform", NULL);
    demand(srnf_register(sht, from, NULL, to, &matching, NULL, NULL, &laid, &error), "registration",
           &error);
    demand(srnf_geodesic(sht, from, laid.coefficients, &path, NULL, &geodesic, &error), "geodesic",
           &error);
    view = picture_view_of(DEGREE, from);
    for (size_t i = 0; i < STEPS; i++) {
        double reach = picture_reach(DEGREE, geodesic.coefficients + i * stride);

        view.reach = reach > view.reach ? reach : view.reach;
    }
    most = picture_largest(DEGREE, geodesic.coefficients + (STEPS - 1) * stride, from);
    for (size_t i = 0; i < STEPS; i++) {
        struct picture picture =
            picture_draw(DEGREE, geodesic.coefficients + i * stride, &view, from, most);

        write_picture(argv[1], i, &picture);
        picture_clear(&picture);
    }
    srnf_geodesic_clear(&geodesic);
    srnf_registration_clear(&laid);
    srnf_free(to);
    srnf_free(from);
    srnf_sht_destroy(sht);
    return EXIT_SUCCESS;
}
