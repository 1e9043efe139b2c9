/*
 * bench_twins.c - how near two scans of one subject are to each other, among those of others.
 *
 * The hundred left ventricles of ../shared/data and the twelve nuclei of tests/data, each group
 * registered to its mean at degree 7 as the processes on groups do it. First the groups as they
 * are, in parts of several sizes: the least distance between two members over the median of all,
 * which the limit of srnf_twins_find has to stay below. Then with repeats of five members: noise
 * of .1 and .3 mm along the normals, another triangulation (every face cut in four, then noise of
 * .1 mm), and another pose; the same ratio of each repeat and its original, which the limit has to
 * stay above.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/ventricles.h"
#include "support/random.h"

#define DEGREE 7
#define MEMBERS ((size_t)100)
#define TWINS ((size_t)5)
#define ITERATIONS ((size_t)10)

static const struct {
    const char *name;
    double noise;
    bool cut, turned;
} kinds[] = {
    {"noise .1 mm", 0.1, false, false},
    {"noise .3 mm", 0.3, false, false},
    {"triangulated again", 0.1, true, false},
    {"turned", 0.0, false, true},
};
#define KINDS (sizeof kinds / sizeof kinds[0])

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* Every face in four; welded afterwards. */
static void cut_faces(struct srnf_mesh *mesh)
{
    size_t n = mesh->n_faces;
    double *vertices = srnf_alloc(6 * n, 3 * sizeof(double));
    uint32_t *faces = srnf_alloc(4 * n, 3 * sizeof(uint32_t));
    static const uint32_t parts[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};

    assert_true(vertices && faces);
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < 6; k++) {
            const double *a = mesh->vertices + 3 * mesh->faces[3 * i + k % 3];
            const double *b = mesh->vertices + 3 * mesh->faces[3 * i + (k + (k >= 3)) % 3];

            for (size_t c = 0; c < 3; c++) {
                vertices[3 * (6 * i + k) + c] = 0.5 * (a[c] + b[c]);
            }
        }
        for (size_t p = 0; p < 12; p++) {
            faces[12 * i + p] = (uint32_t)(6 * i) + parts[p / 3][p % 3];
        }
    }
    srnf_mesh_clear(mesh);
    *mesh = (struct srnf_mesh){6 * n, 4 * n, vertices, faces};
}

/* Another scan of what the mesh shows. */
static void scan_again(struct srnf_mesh *mesh, size_t kind, struct test_random *random)
{
    const double angle[2] = {0.9, 0.5};
    struct srnf_mesh_report report;

    if (kinds[kind].cut) {
        cut_faces(mesh);
        assert_int_equal(srnf_mesh_prepare(mesh, true, &report), SRNF_OK);
    }
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        mesh->vertices[i] += kinds[kind].noise * test_random_normal(random);
    }
    for (size_t i = 0; kinds[kind].turned && i < mesh->n_vertices; i++) {
        double *v = mesh->vertices + 3 * i;

        for (size_t k = 0; k < 2; k++) {
            double x = v[k], y = v[k + 1];

            v[k] = cos(angle[k]) * x - sin(angle[k]) * y;
            v[k + 1] = sin(angle[k]) * x + cos(angle[k]) * y;
        }
    }
}

/* Distances of the members, registered to their mean: [n][n]. */
static void measure(const struct group *g, size_t n, size_t first, double *pairs)
{
    struct srnf_register_options registration = srnf_register_options_defaults();
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_mean mean;

    options.registration = &registration;
    options.max_iterations = ITERATIONS;
    assert_true(srnf_karcher_mean(g->sht, n, g->surfaces + first, &options, NULL, &mean, NULL) >=
                0);
    assert_int_equal(srnf_twins_distances(g->grid, n, mean.registered_q, pairs), SRNF_OK);
    srnf_mean_clear(&mean);
}

/* Least distance and quartile of n members that do not repeat. */
static void report(const struct group *g, size_t n, size_t first, const char *name)
{
    double *pairs = shapes_doubles(g->n * g->n);
    struct srnf_twins twins;

    measure(g, n, first, pairs);
    assert_int_equal(srnf_twins_find(n, pairs, NULL, NULL, &twins), SRNF_OK);
    printf("%-30s %4zu members: least %.4f, quartile %.4f, ratio %.3f, pairs found %zu\n", name, n,
           twins.nearest, twins.quartile, twins.nearest / twins.quartile, twins.count);
    srnf_free(pairs);
}

static void repeats(struct group *g, size_t n, bool (*load)(size_t i, struct srnf_mesh *mesh),
                    enum srnf_parameterization route)
{
    double *pairs = shapes_doubles(g->n * g->n);

    for (size_t kind = 0; kind < KINDS; kind++) {
        struct test_random random = test_random_seed(7 + kind);
        struct srnf_twins twins;
        struct srnf_mesh mesh;
        double ratios[TWINS];

        for (size_t i = 0; i < TWINS; i++) {
            assert_true(load(i, &mesh));
            scan_again(&mesh, kind, &random);
            group_encode(g, n + i, &mesh, route);
        }
        measure(g, n + TWINS, 0, pairs);
        assert_int_equal(srnf_twins_find(n + TWINS, pairs, NULL, NULL, &twins), SRNF_OK);
        for (size_t i = 0; i < TWINS; i++) {
            ratios[i] = pairs[i * (n + TWINS) + n + i] / twins.quartile;
        }
        qsort(ratios, TWINS, sizeof(double), compare_doubles);
        printf("  %-20s repeats over the quartile: %.3f %.3f %.3f %.3f %.3f, pairs found %zu\n",
               kinds[kind].name, ratios[0], ratios[1], ratios[2], ratios[3], ratios[4],
               twins.count);
        (void)fflush(stdout);
    }
    srnf_free(pairs);
}

static bool load_ventricle(size_t i, struct srnf_mesh *mesh)
{
    return ventricles_load(i, MEMBERS, mesh);
}

static bool load_nucleus(size_t i, struct srnf_mesh *mesh)
{
    static const char *const names[] = {"amygdala", "caudate", "hippocampus",
                                        "pallidum", "putamen", "thalamus"};
    char path[120];

    (void)snprintf(path, sizeof path, "tests/data/aal_subcortex/%c_%s.ply", i % 2 ? 'R' : 'L',
                   names[i / 2]);
    return meshes_load(path, mesh);
}

int main(int argc, char **argv)
{
    static const size_t parts[] = {6, 10, 20, 50, 100};
    struct srnf_mesh mesh;
    struct group g;
    size_t n = argc > 1 ? (size_t)strtoul(argv[1], NULL, 10) : MEMBERS;

    group_open(&g, DEGREE, 12 + TWINS);
    for (size_t i = 0; i < 12; i++) {
        assert_true(load_nucleus(i, &mesh));
        group_encode(&g, i, &mesh, SRNF_PARAMETERIZATION_AREA);
    }
    report(&g, 12, 0, "nuclei");
    repeats(&g, 12, load_nucleus, SRNF_PARAMETERIZATION_AREA);
    group_close(&g);
    if (!ventricles_open(&g, DEGREE, n, SRNF_PARAMETERIZATION_AUTO)) {
        return EXIT_SUCCESS;
    }
    for (size_t p = 0; p < sizeof parts / sizeof parts[0] && parts[p] <= n; p++) {
        for (size_t first = 0; first + parts[p] <= n && first < 3 * parts[p]; first += parts[p]) {
            report(&g, parts[p], first, "ventricles");
            (void)fflush(stdout);
        }
    }
    group_close(&g);
    n = n < 20 ? n : 20;
    if (!ventricles_open(&g, DEGREE, n, SRNF_PARAMETERIZATION_AUTO)) {
        return EXIT_SUCCESS;
    }
    for (size_t i = n; i < n + TWINS; i++) {
        g.f[i] = shapes_doubles(g.count);
        g.surfaces[i] = g.f[i];
    }
    g.n = n + TWINS;
    repeats(&g, n, load_ventricle, SRNF_PARAMETERIZATION_AUTO);
    group_close(&g);
    return EXIT_SUCCESS;
}
