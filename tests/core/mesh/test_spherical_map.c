/*
 * test_spherical_map.c - the spherical parameterisation of real meshes and of shapes whose map is
 * known: bijective, little distorted, the same whatever the pose and the numbering of the mesh.
 *
 * srnfd-test: timeout 300
 */
#include "spherical_checks.h"

#include <stdlib.h>

#include "support/folders.h"

#define SHARED "../shared/data/"

/* ---- Real meshes ----------------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a;
    double y = *(const double *)b;

    return (x > y) - (x < y);
}

/* Limits are what the method reached when it was found, to the last digit given; `whole` says that
   this was measured on just these meshes, so that the medians are comparable. */
struct expectation {
    const char *folder;
    double median, most, deviation;
    bool whole;
};

/* Every mesh of a folder; under a sanitizer a few of many. */
static void check_folder(const struct expectation *expected)
{
    static char *paths[FOLDERS_FILES_MAX];
    static double energies[FOLDERS_FILES_MAX];
    size_t n = folders_list(expected->folder, paths);
    size_t stride = CHECK_SANITIZED && n > 20 ? 10 : 1;
    size_t count = 0;
    double deviation = 0.0;

    if (n == 0) {
        printf("# there is no folder %s\n", expected->folder);
        skip();
    }
    for (size_t i = 0; i < n; i += stride) {
        struct srnf_mesh mesh;
        struct srnf_mesh_report report;
        struct srnf_spherical_map map;

        assert_true(meshes_load(paths[i], &mesh));
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        assert_int_equal(report.n_problems, 0);
        assert_int_equal(check_map(folders_name(paths[i]), &mesh, &map), SRNF_OK);
        assert_int_equal(map.attempts, 1);
        energies[count++] = map.symmetric_dirichlet;
        deviation = fmax(deviation, map.log_area_deviation);
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
    for (size_t i = 0; i < n; i++) {
        free(paths[i]);
    }
    qsort(energies, count, sizeof *energies, by_value);
    printf("# %s: %zu meshes, E median %.2f (%.2f), at most %.2f (%.2f), sd at most %.2f (%.2f)\n",
           expected->folder, count, energies[count / 2], expected->median, energies[count - 1],
           expected->most, deviation, expected->deviation);
    assert_true(energies[count - 1] < expected->most + 0.005);
    assert_true(deviation < expected->deviation + 0.005);
    if (expected->whole) {
        assert_true(energies[count / 2] < expected->median + 0.005);
    }
}

static void test_brain_structures(void **state)
{
    (void)state;
    check_folder(&(struct expectation){"tests/data/aal_subcortex", 4.41, 5.74, 0.43, true});
}

static void test_ventricles(void **state)
{
    (void)state;
    check_folder(&(struct expectation){SHARED "lv_endocardium_ed", 4.23, 4.95, 0.35, false});
}

static void test_ventricle_pairs(void **state)
{
    (void)state;
    check_folder(&(struct expectation){SHARED "lv_pairs", 4.23, 4.95, 0.35, false});
}

static void test_small_bodies(void **state)
{
    (void)state;
    check_folder(&(struct expectation){SHARED "small_bodies", 4.07, 5.76, 0.46, false});
}

/* ---- Known maps ------------------------------------------------------------------------------ */

/* How far a map of a mesh on the unit sphere is from a rotation: largest change of the products of
   the positions of two vertices. */
static double distance_from_rotation(const struct srnf_mesh *mesh, const double *points)
{
    double largest = 0.0;

    for (size_t a = 0; a < mesh->n_vertices; a++) {
        for (size_t b = 0; b < mesh->n_vertices; b += 97) {
            double before = 0.0;
            double after = 0.0;

            for (size_t k = 0; k < 3; k++) {
                before += mesh->vertices[3 * a + k] * mesh->vertices[3 * b + k];
                after += points[3 * a + k] * points[3 * b + k];
            }
            largest = fmax(largest, fabs(before - after));
        }
    }
    return largest;
}

/* The map of a sphere is a rotation, up to what the relaxation leaves when no vertex gains more than
   1e-5 of its energy any more. */
static void test_sphere(void **state)
{
    (void)state;

    for (size_t frequency = 4; frequency <= 32; frequency *= 2) {
        struct srnf_mesh mesh = meshes_sphere(frequency);
        struct srnf_spherical_map map;
        double distance;

        assert_int_equal(check_map("sphere", &mesh, &map), SRNF_OK);
        distance = distance_from_rotation(&mesh, map.points);
        printf("#   energy - 4: %.1e, products of positions off by %.1e\n",
               map.symmetric_dirichlet - 4.0, distance);
        assert_true(fabs(map.symmetric_dirichlet - 4.0) < 2.0 / (double)(frequency * frequency));
        assert_true(distance < 0.01);
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
}

/* The figures that come with a map are those of the map; no slivers here. */
static void test_figures(void **state)
{
    struct srnf_mesh meshes[] = {meshes_sphere(12), meshes_star(14), meshes_bumpy(12, 5),
                                 meshes_bent_capsule(6, 1, 4, 40, 16), meshes_tetrahedron()};
    (void)state;

    for (size_t i = 0; i < sizeof meshes / sizeof meshes[0]; i++) {
        struct srnf_spherical_map map;
        double deviation;
        double energy;

        assert_int_equal(check_map("figures", &meshes[i], &map), SRNF_OK);
        energy = check_distortion(&meshes[i], map.points, &deviation);
        assert_true(fabs(energy / map.symmetric_dirichlet - 1.0) < 1e-10);
        assert_true(fabs(deviation - map.log_area_deviation) < 1e-7);
        srnf_free(map.points);
        srnf_mesh_clear(&meshes[i]);
    }
}

/* Ellipsoids: the longer, the more distortion there must be; better than the obvious map along the
   rays, (x / a, y / b, z / c). */
static void test_ellipsoids(void **state)
{
    double last = 3.99;
    (void)state;

    for (double length = 1.0; length < 7.0; length += 1.0) {
        struct srnf_mesh sphere = meshes_sphere(16);
        struct srnf_mesh mesh = meshes_copy(&sphere);
        struct srnf_spherical_map map;
        double deviation;
        double obvious;

        meshes_stretch(&mesh, 1.0, 0.8, length);
        assert_int_equal(check_map("ellipsoid", &mesh, &map), SRNF_OK);
        obvious = check_distortion(&mesh, sphere.vertices, &deviation);
        printf("#   1 : 0.8 : %g, E %.3f, along the rays %.3f\n", length, map.symmetric_dirichlet,
               obvious);
        assert_true(map.symmetric_dirichlet < obvious);
        assert_true(length < 2.0 || map.symmetric_dirichlet > last);
        last = map.symmetric_dirichlet;
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
        srnf_mesh_clear(&sphere);
    }
}

/* ---- Pose and numbering ---------------------------------------------------------------------- */

/* Shapes without symmetry: only of these are the axes and their signs well defined. */
static struct srnf_mesh asymmetric(size_t i)
{
    static const char *const paths[] = {"tests/data/aal_subcortex/L_hippocampus.ply",
                                        "tests/data/aal_subcortex/R_putamen.ply",
                                        "tests/data/aal_subcortex/L_thalamus.ply"};
    struct srnf_mesh mesh;

    if (i < 3) {
        assert_true(meshes_load(paths[i], &mesh));
        return mesh;
    }
    return meshes_bumpy(16, i);
}
#define ASYMMETRIC 5

static const char *const changes[] = {"turned",       "moved by 1e6 diagonals", "1e-9 the size",
                                      "1e9 the size", "2^30 the size",          "renumbered",
                                      "all of it"};
enum { TURNED, MOVED, TINY, HUGE_SIZE, POWER_OF_TWO, RENUMBERED, ALL, CHANGES };

/* new_index tells where each vertex has gone. */
static void change(struct srnf_mesh *mesh, size_t how, uint32_t *new_index)
{
    struct test_random random = test_random_seed(how);
    struct srnf_mesh_report report;

    assert_int_equal(srnf_mesh_prepare(mesh, false, &report), SRNF_OK);
    for (uint32_t v = 0; v < mesh->n_vertices; v++) {
        new_index[v] = v;
    }
    if (how == TURNED || how == ALL) {
        meshes_turn(mesh, how);
    }
    if (how == RENUMBERED || how == ALL) {
        triangulations_renumber(mesh, new_index, &random);
    }
    if (how == TINY || how == HUGE_SIZE || how == POWER_OF_TWO) {
        meshes_scale(mesh, how == TINY ? 1e-9 : how == HUGE_SIZE ? 1e9 : 0x1p30);
    }
    if (how == MOVED || how == ALL) {
        double far = 1e6 * report.bounding_box_diagonal;

        meshes_move(mesh, 0.3 * far, -0.5 * far, 0.8 * far);
    }
}

/* Differences between the map of a mesh and that of the same mesh changed: largest and root mean
   square over the vertices. */
static double compare(const struct srnf_mesh *mesh, const struct srnf_spherical_map *a,
                      const struct srnf_spherical_map *b, const uint32_t *new_index, double *rms)
{
    double largest = 0.0;
    double sum = 0.0;

    for (size_t v = 0; v < mesh->n_vertices; v++) {
        double square = 0.0;

        for (size_t k = 0; k < 3; k++) {
            double d = a->points[3 * v + k] - b->points[3 * (size_t)new_index[v] + k];

            square += d * d;
        }
        largest = fmax(largest, sqrt(square));
        sum += square;
    }
    *rms = sqrt(sum / (double)mesh->n_vertices);
    return largest;
}

static void test_pose_and_numbering(void **state)
{
    (void)state;
    for (size_t i = 0; i < ASYMMETRIC; i++) {
        struct srnf_mesh mesh = asymmetric(i);
        uint32_t *new_index = calloc(mesh.n_vertices, sizeof *new_index);
        struct srnf_spherical_map map;

        assert_non_null(new_index);
        assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_OK);
        for (size_t how = 0; how < CHANGES; how++) {
            struct srnf_mesh other = meshes_copy(&mesh);
            struct srnf_spherical_map changed;
            double largest;
            double rms;

            change(&other, how, new_index);
            assert_int_equal(srnf_spherical_map(&other, NULL, &changed, NULL), SRNF_OK);
            check_bijection(&other, &changed);
            largest = compare(&mesh, &map, &changed, new_index, &rms);
            printf("# mesh %zu %-23s: points differ by %.1e rms, %.1e at most; E by %.1e\n", i,
                   changes[how], rms, largest,
                   fabs(changed.symmetric_dirichlet - map.symmetric_dirichlet));
            assert_true(how != POWER_OF_TWO || largest == 0.0);
            assert_true(rms < 0.02 && largest < 0.1);
            assert_true(fabs(changed.symmetric_dirichlet / map.symmetric_dirichlet - 1.0) < 5e-3);
            srnf_free(changed.points);
            srnf_mesh_clear(&other);
        }
        free(new_index);
        srnf_free(map.points);
        srnf_mesh_clear(&mesh);
    }
}

/* Real shapes are nearly symmetric about some plane or other; what symmetry is left out must still
   decide the signs of the axes, whatever the pose. */
static void test_axes(void **state)
{
    static char *paths[FOLDERS_FILES_MAX];
    size_t n = folders_list("tests/data/aal_subcortex", paths);
    double worst = 0.0;
    (void)state;

    assert_int_equal(n, 12);
    for (size_t i = 0; i < n; i++) {
        struct srnf_mesh mesh;
        struct srnf_spherical_map maps[2];
        uint32_t *new_index;
        double rms;

        assert_true(meshes_load(paths[i], &mesh));
        new_index = calloc(mesh.n_vertices, sizeof *new_index);
        assert_non_null(new_index);
        assert_int_equal(srnf_spherical_map(&mesh, NULL, &maps[0], NULL), SRNF_OK);
        for (size_t how = TURNED; how <= ALL; how += ALL - TURNED) {
            struct srnf_mesh other = meshes_copy(&mesh);

            change(&other, how, new_index);
            assert_int_equal(srnf_spherical_map(&other, NULL, &maps[1], NULL), SRNF_OK);
            (void)compare(&mesh, &maps[0], &maps[1], new_index, &rms);
            worst = fmax(worst, rms);
            srnf_free(maps[1].points);
            srnf_mesh_clear(&other);
        }
        srnf_free(maps[0].points);
        srnf_mesh_clear(&mesh);
        free(new_index);
        free(paths[i]);
    }
    printf("# brain structures turned, moved, renumbered: points differ by at most %.1e rms\n",
           worst);
    assert_true(worst < 0.05);
}

/* ---- Repeats, progress, cancelling ----------------------------------------------------------- */

static void test_repeats(void **state)
{
    (void)state;
    for (size_t i = 0; i < ASYMMETRIC; i++) {
        struct srnf_mesh mesh = asymmetric(i);
        struct srnf_spherical_map first;
        struct srnf_spherical_map second;

        assert_int_equal(srnf_spherical_map(&mesh, NULL, &first, NULL), SRNF_OK);
        assert_int_equal(srnf_spherical_map(&mesh, NULL, &second, NULL), SRNF_OK);
        assert_memory_equal(first.points, second.points, 3 * mesh.n_vertices * sizeof(double));
        assert_memory_equal(&first.symmetric_dirichlet, &second.symmetric_dirichlet,
                            sizeof(double));
        srnf_free(first.points);
        srnf_free(second.points);
        srnf_mesh_clear(&mesh);
    }
}

struct watch {
    double last;
    size_t reports, asked, limit;
    bool disordered;
};

static void watch_progress(void *user, double fraction, const char *message)
{
    struct watch *watch = user;

    watch->disordered = watch->disordered || fraction < watch->last || fraction > 1.0 || !message;
    watch->last = fraction;
    watch->reports++;
}

static bool watch_canceled(void *user)
{
    struct watch *watch = user;

    return watch->asked++ >= watch->limit;
}

/* However often it is asked before it says stop, the call ends with that answer and nothing. */
static void test_cancel(void **state)
{
    struct srnf_mesh mesh = meshes_bumpy(16, 1);
    struct watch watch = {.limit = SIZE_MAX};
    struct srnf_context context = {
        .user = &watch, .progress = watch_progress, .canceled = watch_canceled};
    struct srnf_spherical_map map;
    struct srnf_error error;
    size_t times;
    (void)state;

    assert_int_equal(srnf_spherical_map(&mesh, &context, &map, NULL), SRNF_OK);
    srnf_free(map.points);
    times = watch.asked;
    printf("# asked %zu times, %zu reports of progress\n", times, watch.reports);
    assert_true(times > 20 && watch.reports > 5 && !watch.disordered);
    for (size_t limit = 0; limit < times; limit += 1 + times / 20) {
        watch = (struct watch){.limit = limit};
        assert_int_equal(srnf_spherical_map(&mesh, &context, &map, &error), SRNF_ECANCELED);
        assert_int_equal(error.status, SRNF_ECANCELED);
        assert_null(map.points);
        assert_int_equal(watch.asked, limit + 1); /* it does not ask again */
    }
    srnf_mesh_clear(&mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere),       cmocka_unit_test(test_figures),
        cmocka_unit_test(test_ellipsoids),   cmocka_unit_test(test_pose_and_numbering),
        cmocka_unit_test(test_axes),         cmocka_unit_test(test_repeats),
        cmocka_unit_test(test_cancel),       cmocka_unit_test(test_brain_structures),
        cmocka_unit_test(test_small_bodies), cmocka_unit_test(test_ventricle_pairs),
        cmocka_unit_test(test_ventricles),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
