/*
 * bench_landmarks.c - how well registration corresponds on real left ventricles, whose vertices do:
 * without landmarks, and guided by a few of them; the error at all other vertices.
 *
 * Ten pairs of eleven ventricles at equal steps of the list, degree 23, route star as encode
 * takes it. A vertex of the
 * template lies somewhere on its sphere; the warp takes it to the moving surface, and the error is
 * how far from its own vertex of the moving mesh it comes out, in mm. Landmarks are vertices far
 * from each other: each the farthest from those before it, on the first mesh, from the apex on.
 *
 * Then means of the eleven: the distance, at 40 vertices more, between where the warp takes a
 * landmark of the mean that is held out and the vertex of each member, in mm.
 */
#include "support/compare.h"
#include "support/folders.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/timing.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE 23
#define PAIRS 10
#define FOLDER "../shared/data/lv_endocardium_ed"
#define LANDMARKS_MOST 12
#define HELD_OUT 40
#define MARKS (LANDMARKS_MOST + HELD_OUT)

extern void openblas_set_num_threads(int threads);

static const struct {
    const char *name;
    bool common_pose, searched;
    size_t landmarks;
    double weight;
} ways[] = {
    {"radial, as they are", true, false, 0, 0.0},
    {"free", false, true, 0, 0.0},
    {"common pose", true, true, 0, 0.0},
    {"free, 3 landmarks exact", false, true, 3, INFINITY},
    {"free, 6 landmarks, weight 0.1", false, true, 6, 0.1},
    {"free, 6 landmarks, weight 1", false, true, 6, 1.0},
    {"free, 6 landmarks exact", false, true, 6, INFINITY},
    {"free, 12 landmarks exact", false, true, 12, INFINITY},
    {"common pose, 6 landmarks exact", true, true, 6, INFINITY},
    {"common pose, 12 landmarks exact", true, true, 12, INFINITY},
};
#define WAYS (sizeof ways / sizeof ways[0])

struct ventricle {
    struct srnf_mesh mesh;
    struct srnf_encoded encoded;
    double *directions; /* [n][3] of the vertices, on the sphere */
    double landmarks[3 * MARKS];
};

static void must(int status)
{
    if (status < 0) {
        (void)fprintf(stderr, "%s\n", srnf_strerror(status));
        exit(EXIT_FAILURE);
    }
}

static void open_ventricle(struct ventricle *v, const char *path)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_mesh_report report;

    if (!meshes_load(path, &v->mesh)) {
        exit(EXIT_FAILURE);
    }
    must(srnf_mesh_prepare(&v->mesh, false, &report));
    options.degree = DEGREE;
    options.parameterization = SRNF_PARAMETERIZATION_STAR;
    must(srnf_encode(&v->mesh, &report, &options, NULL, &v->encoded, NULL));
    v->directions = srnf_alloc(3 * v->mesh.n_vertices, sizeof(double));
    must(srnf_encode_points(&v->mesh, &report, &options, NULL, v->directions, NULL));
    for (size_t i = 0; i < v->mesh.n_vertices; i++) {
        double *d = v->directions + 3 * i;
        double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);

        for (size_t c = 0; c < 3; c++) {
            d[c] /= length;
        }
    }
}

static void close_ventricle(struct ventricle *v)
{
    srnf_mesh_clear(&v->mesh);
    srnf_free(v->encoded.coefficients);
    srnf_free(v->directions);
}

static double apart(const double *a, const double *b)
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];

    return sqrt(x * x + y * y + z * z);
}

static void choose(const struct srnf_mesh *mesh, size_t vertices[MARKS])
{
    for (size_t k = 0; k < MARKS; k++) {
        double most = -INFINITY;

        for (size_t i = 0; i < mesh->n_vertices; i++) {
            double least = k ? INFINITY : -mesh->vertices[3 * i + 2];

            for (size_t j = 0; j < k; j++) {
                least = compare_min(
                    least, apart(mesh->vertices + 3 * i, mesh->vertices + 3 * vertices[j]));
            }
            if (!(least <= most)) {
                most = least;
                vertices[k] = i;
            }
        }
    }
}

/* As the service places them: the nearest points of the surface. */
static void place(struct ventricle *v, const size_t vertices[MARKS])
{
    double positions[3 * MARKS], off[MARKS];

    for (size_t k = 0; k < 3 * MARKS; k++) {
        positions[k] = (v->mesh.vertices[3 * vertices[k / 3] + k % 3] - v->encoded.origin[k % 3]) /
                       v->encoded.scale;
    }
    must(srnf_surface_nearest(DEGREE, v->encoded.coefficients, MARKS, positions, NULL, v->landmarks,
                              off));
}

/* Mean error over all vertices. */
static double error_of(const struct ventricle *a, const struct ventricle *b,
                       const struct srnf_warp *warp)
{
    size_t n = a->mesh.n_vertices;
    double *points = srnf_alloc(6 * n, sizeof(double));
    double *values = points + 3 * n;
    double sum = 0.0;

    memcpy(points, a->directions, 3 * n * sizeof(double));
    if (warp) {
        must(srnf_warp_apply(warp, n, a->directions, points, NULL));
    }
    must(srnf_harmonics_at_points(DEGREE, 3, b->encoded.coefficients, n, points, values, NULL));
    for (size_t i = 0; i < n; i++) {
        double x[3];

        for (size_t c = 0; c < 3; c++) {
            x[c] = b->encoded.scale * values[c * n + i] + b->encoded.origin[c];
        }
        sum += apart(x, b->mesh.vertices + 3 * i) / (double)n;
    }
    srnf_free(points);
    return sum;
}

struct figures {
    double error, distance2, least, most, seconds;
};

static void run(const struct srnf_sht *sht, size_t way, const struct ventricle *a,
                const struct ventricle *b, struct figures *sum)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    const struct srnf_landmarks landmarks = {ways[way].landmarks, a->landmarks, b->landmarks,
                                             ways[way].weight};
    struct srnf_registration r = {.iterations = 0};
    double seconds = timing_cpu();

    options.common_pose = ways[way].common_pose;
    if (ways[way].searched) {
        must(srnf_register_landmarks(sht, a->encoded.coefficients, NULL, b->encoded.coefficients,
                                     &options, ways[way].landmarks ? &landmarks : NULL, NULL, NULL,
                                     &r, NULL));
    }
    sum->seconds += timing_cpu() - seconds;
    sum->error += error_of(a, b, ways[way].searched ? &r.warp : NULL) / PAIRS;
    sum->distance2 += r.distance * r.distance / PAIRS;
    sum->least = compare_min(sum->least, r.min_jacobian);
    sum->most = compare_max(sum->most, r.max_jacobian);
    srnf_registration_clear(&r);
}

/* ---- Means ----------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    bool common_pose;
    size_t landmarks;
    double weight;
} means[] = {
    {"free", false, 0, 1.0},
    {"common pose", true, 0, 1.0},
    {"free, 6 landmarks, weight 1", false, 6, 1.0},
    {"free, 6 landmarks exact", false, 6, INFINITY},
    {"free, 12 landmarks exact", false, 12, INFINITY},
    {"common pose, 6 landmarks exact", true, 6, INFINITY},
    {"common pose, 12 landmarks exact", true, 12, INFINITY},
};

/* Mean distance over members and vertices held out. */
static double error_of_mean(const struct ventricle *all, const struct srnf_mean *mean, size_t first)
{
    double values[6 * MARKS], points[6 * MARKS], sum = 0.0;
    size_t count = MARKS - first;

    for (size_t i = 0; i <= PAIRS; i++) {
        memcpy(points, mean->landmark_points + 3 * (i * mean->n_landmarks + first),
               3 * count * sizeof(double));
        memcpy(points + 3 * count, all[i].landmarks + 3 * first, 3 * count * sizeof(double));
        must(srnf_harmonics_at_points(DEGREE, 3, all[i].encoded.coefficients, 2 * count, points,
                                      values, NULL));
        for (size_t j = 0; j < count; j++) {
            double a[3], b[3];

            for (size_t c = 0; c < 3; c++) {
                a[c] = values[2 * c * count + j];
                b[c] = values[2 * c * count + count + j];
            }
            sum += all[i].encoded.scale * apart(a, b) / (double)(count * (PAIRS + 1));
        }
    }
    return sum;
}

static void run_mean(const struct srnf_sht *sht, size_t way, const struct ventricle *all)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_group_landmarks landmarks = {MARKS, means[way].landmarks, NULL, means[way].weight};
    double *points = srnf_alloc((PAIRS + 1) * MARKS, 3 * sizeof(double));
    const double *surfaces[PAIRS + 1];
    struct srnf_mean mean;
    double seconds = timing_cpu();

    for (size_t i = 0; i <= PAIRS; i++) {
        surfaces[i] = all[i].encoded.coefficients;
        memcpy(points + 3 * i * MARKS, all[i].landmarks, sizeof all[i].landmarks);
    }
    registration.common_pose = means[way].common_pose;
    landmarks.points = points;
    options.registration = &registration;
    options.landmarks = &landmarks;
    must(srnf_karcher_mean(sht, PAIRS + 1, surfaces, &options, NULL, &mean, NULL));
    printf("%-34s %8.2f %10.4f %6zu %8.2f\n", means[way].name,
           error_of_mean(all, &mean, LANDMARKS_MOST), mean.history[mean.iterations - 1].variance,
           mean.iterations, timing_cpu() - seconds);
    srnf_mean_clear(&mean);
    srnf_free(points);
}

int main(void)
{
    char *paths[FOLDERS_FILES_MAX];
    size_t found = folders_list(FOLDER, paths), vertices[MARKS];
    struct ventricle all[PAIRS + 1];
    struct srnf_sht *sht;

    openblas_set_num_threads(1);
    if (found <= PAIRS) {
        printf("# skipped: no %s\n", FOLDER);
        return 0;
    }
    must(srnf_sht_create(&sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 0, 0));
    for (size_t i = 0; i <= PAIRS; i++) {
        open_ventricle(&all[i], paths[i * (found - 1) / PAIRS]);
        if (i == 0) {
            choose(&all[0].mesh, vertices);
        }
        place(&all[i], vertices);
    }
    printf("%-34s %8s %10s %12s %8s\n", "", "mm", "distance^2", "J", "s a pair");
    for (size_t way = 0; way < WAYS; way++) {
        struct figures sum = {.least = INFINITY};

        for (size_t i = 0; i < PAIRS; i++) {
            run(sht, way, &all[i], &all[i + 1], &sum);
        }
        printf("%-34s %8.2f %10.4f %6.2f %5.2f %8.2f\n", ways[way].name, sum.error, sum.distance2,
               sum.least, sum.most, sum.seconds / PAIRS);
    }
    printf("\n%-34s %8s %10s %6s %8s\n", "means of eleven", "mm", "variance", "steps", "s");
    for (size_t way = 0; way < sizeof means / sizeof means[0]; way++) {
        run_mean(sht, way, all);
    }
    for (size_t i = 0; i <= PAIRS; i++) {
        close_ventricle(&all[i]);
    }
    for (size_t i = 0; i < found; i++) {
        free(paths[i]);
    }
    srnf_sht_destroy(sht);
    return 0;
}
