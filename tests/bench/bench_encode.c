/*
 * bench_encode.c - where the time of encoding a mesh goes, on real structures at degree 31:
 * reading, repairing and reporting, star kernel, spatial index; the route star's rays; the route
 * area's map to the sphere and the sampling through it; fit error; and the whole of srnf_encode by
 * either route.
 *
 * Processor seconds of one thread, in ms and in units of one gradient transform of three
 * coordinates at the same degree, timed in the same run. The rays are those srnf_encode casts: a
 * Gauss-Legendre grid with twice the rows of the working grid. Structures without a star centre
 * go by area only.
 */
#include "sphere_map/sphere_map.h"
#include "surface/fit.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/timing.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define DEGREE ((size_t)31)
#define FIT_FREQUENCY ((size_t)31)
#define SAMPLES ((size_t)5)
#define SAMPLE_SECONDS 0.004
#define FILE_MAX ((size_t)16 << 20)

extern void openblas_set_num_threads(int threads);

struct bench {
    unsigned char *bytes;
    size_t size;
    struct srnf_mesh mesh, surface; /* surface: triangulated, in the frame of the mesh */
    struct srnf_mesh_report report;
    struct srnf_star star;
    struct srnf_index *index;
    const struct srnf_grid *rays;
    struct srnf_spherical_map map;
    double *values; /* [3] fields on the grid of the rays */
    struct shapes_surface unit;
    double *d_theta, *d_phi;
};

static void must(int status)
{
    if (status != SRNF_OK) {
        (void)fprintf(stderr, "%s\n", srnf_strerror(status));
        exit(EXIT_FAILURE);
    }
}

static void unit(void *argument)
{
    struct bench *b = argument;

    srnf_sht_gradient(b->unit.sht, 3, b->unit.f, b->d_theta, b->d_phi, b->unit.workspace);
}

static void read_mesh(void *argument)
{
    struct bench *b = argument;
    struct srnf_mesh mesh = {0};

    must(srnf_mesh_read(b->bytes, b->size, SRNF_MESH_UNKNOWN, NULL, &mesh, NULL, NULL));
    srnf_mesh_clear(&mesh);
}

static void prepare(void *argument)
{
    struct bench *b = argument;

    must(srnf_mesh_prepare(&b->mesh, false, &b->report));
}

static void kernel(void *argument)
{
    struct bench *b = argument;

    must(srnf_star_kernel(&b->mesh, &b->star));
}

static void build_index(void *argument)
{
    struct bench *b = argument;

    srnf_index_destroy(b->index);
    must(srnf_index_create(&b->index, &b->mesh));
}

static void cast_rays(void *argument)
{
    struct bench *b = argument;

    for (size_t row = 0; row < b->rays->n_theta; row++) {
        for (size_t j = 0; j < b->rays->n_phi; j++) {
            double phi = 2.0 * 3.14159265358979323846 * (double)j / (double)b->rays->n_phi;
            double e[3] = {b->rays->sin_theta[row] * cos(phi), b->rays->sin_theta[row] * sin(phi),
                           b->rays->cos_theta[row]};
            double t = 0.0;

            (void)srnf_index_ray(b->index, b->star.center, e, &t, NULL);
        }
    }
}

static void measure_fit(void *argument)
{
    struct bench *b = argument;
    struct srnf_fit fit;

    must(srnf_fit_measure(&b->mesh, b->index, &b->surface, NULL, &fit));
}

static void map_to_sphere(void *argument)
{
    struct bench *b = argument;

    srnf_free(b->map.points);
    must(srnf_spherical_map(&b->mesh, NULL, &b->map, NULL));
}

static void sample(void *argument)
{
    struct bench *b = argument;

    must(spherical_sample(&b->mesh, b->map.points, b->rays, NULL, b->values));
}

static void encode_by(struct bench *b, enum srnf_parameterization route)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded;

    options.parameterization = route;
    must(srnf_encode(&b->mesh, &b->report, &options, NULL, &encoded, NULL));
    srnf_free(encoded.coefficients);
}

static void encode_area(void *argument)
{
    encode_by(argument, SRNF_PARAMETERIZATION_AREA);
}

static void encode_star(void *argument)
{
    encode_by(argument, SRNF_PARAMETERIZATION_STAR);
}

static const struct {
    const char *name;
    void (*body)(void *argument);
    bool star; /* needs a centre; these come last */
} stages[] = {
    {"U", unit, false},        {"read", read_mesh, false},    {"prepare", prepare, false},
    {"kernel", kernel, false}, {"index", build_index, false}, {"map", map_to_sphere, false},
    {"sample", sample, false}, {"fit", measure_fit, false},   {"area", encode_area, false},
    {"rays", cast_rays, true}, {"star", encode_star, true},
};
#define STAGES (sizeof stages / sizeof stages[0])

static bool load(struct bench *b, const char *structure)
{
    char path[128];
    FILE *file;

    (void)snprintf(path, sizeof path, "tests/data/aal_subcortex/%s.ply", structure);
    file = fopen(path, "rb");
    if (!file) {
        return false;
    }
    b->size = fread(b->bytes, 1, FILE_MAX, file);
    (void)fclose(file);
    must(srnf_mesh_read(b->bytes, b->size, SRNF_MESH_UNKNOWN, NULL, &b->mesh, NULL, NULL));
    must(srnf_mesh_prepare(&b->mesh, false, &b->report));
    must(srnf_star_kernel(&b->mesh, &b->star));
    must(srnf_index_create(&b->index, &b->mesh));
    return true;
}

/* The triangulation that the fit is measured on. */
static void triangulate(struct bench *b)
{
    struct srnf_encoded encoded;

    must(srnf_encode(&b->mesh, &b->report, NULL, NULL, &encoded, NULL));
    must(srnf_surface_triangulate(DEGREE, encoded.coefficients, FIT_FREQUENCY, &b->surface, NULL));
    meshes_scale(&b->surface, encoded.scale);
    meshes_move(&b->surface, encoded.origin[0], encoded.origin[1], encoded.origin[2]);
    srnf_free(encoded.coefficients);
}

static void bench_structure(struct bench *b, const char *structure)
{
    double seconds[STAGES][SAMPLES];
    double medians[STAGES];
    struct timing_case timed[STAGES];
    size_t count;

    if (!load(b, structure)) {
        printf("%-14s not there\n", structure);
        return;
    }
    count = 0;
    while (count < STAGES && (b->star.value || !stages[count].star)) {
        count++;
    }
    map_to_sphere(b);
    triangulate(b);
    for (size_t k = 0; k < count; k++) {
        timed[k] = (struct timing_case){.body = stages[k].body, .argument = b};
        timing_calibrate(&timed[k], SAMPLE_SECONDS);
    }
    timing_interleave(timed, count, SAMPLES, seconds[0]);
    for (size_t k = 0; k < count; k++) {
        medians[k] = timing_median(SAMPLES, seconds[k]);
    }
    printf("%-14s %6zu", structure, b->mesh.n_faces);
    for (size_t k = 1; k < count; k++) {
        printf("  %7.2f %5.0f", 1e3 * medians[k], medians[k] / medians[0]);
    }
    printf("%s\n", b->star.value ? "" : "  not star-shaped");
    srnf_free(b->map.points);
    b->map.points = NULL;
    srnf_index_destroy(b->index);
    b->index = NULL;
    srnf_mesh_clear(&b->surface);
    srnf_mesh_clear(&b->mesh);
}

int main(void)
{
    const char *const structures[] = {"L_thalamus", "R_thalamus", "L_pallidum",    "R_pallidum",
                                      "L_amygdala", "R_amygdala", "L_putamen",     "R_putamen",
                                      "L_caudate",  "R_caudate",  "L_hippocampus", "R_hippocampus"};
    struct bench b = {0};
    struct srnf_sht *fine;

    openblas_set_num_threads(1);
    b.bytes = malloc(FILE_MAX);
    if (!b.bytes) {
        must(SRNF_ENOMEM);
    }
    must(srnf_sht_create(&fine, DEGREE - 1, SRNF_GRID_GAUSS_LEGENDRE, 2 * srnf_working_rows(DEGREE),
                         0));
    b.rays = srnf_sht_grid(fine);
    shapes_open(&b.unit, DEGREE);
    shapes_fill(&b.unit, shapes_bumpy, 0.0);
    b.d_theta = shapes_doubles(3 * b.unit.points);
    b.d_phi = shapes_doubles(3 * b.unit.points);
    b.values = shapes_doubles(3 * b.rays->n_theta * b.rays->n_phi);
    printf("Encoding at degree %zu, one core, processor time, medians of %zu: ms and U\n\n", DEGREE,
           SAMPLES);
    printf("%-14s %6s", "structure", "faces");
    for (size_t k = 1; k < STAGES; k++) {
        printf("  %7s %5s", stages[k].name, "U");
    }
    printf("\n");
    for (size_t k = 0; k < sizeof structures / sizeof structures[0]; k++) {
        bench_structure(&b, structures[k]);
    }
    printf("\narea and star are srnf_encode by that route: kernel, index, map and samples or rays, "
           "%zu of them,\nanalysis, fit and normalization together.\n",
           b.rays->n_theta * b.rays->n_phi);
    srnf_free(b.values);
    srnf_free(b.d_phi);
    srnf_free(b.d_theta);
    shapes_close(&b.unit);
    srnf_sht_destroy(fine);
    free(b.bytes);
    return EXIT_SUCCESS;
}
