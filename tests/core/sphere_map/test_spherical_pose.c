/*
 * test_spherical_pose.c - the same mesh gets the same map: bit for bit in repeats and on many
 * threads, and up to the tolerance of the relaxation when it is turned, moved, scaled or numbered
 * anew. And a call that is asked to stop does.
 *
 * A shape that is symmetric, or so nearly that the relaxation cannot tell, has no axes to go by:
 * its map may come out turned by half a turn. Those used here are not.
 * srnfd-test: slow
 * srnfd-test: no-asan (core/registration/test_register_known.c runs its code)
 */
#include "spherical_checks.h"

#include "support/parallel.h"

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
#define ASYMMETRIC_STEP (CHECK_SLOW ? 3 : 1) /* with sanitizers one of each kind */
#define STRUCTURES_STEP (CHECK_SLOW ? 4 : 1)

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
        largest = compare_max(largest, sqrt(square));
        sum += square;
    }
    *rms = sqrt(sum / (double)mesh->n_vertices);
    return largest;
}

static void test_pose_and_numbering(void **state)
{
    (void)state;
    for (size_t i = 0; i < ASYMMETRIC; i += ASYMMETRIC_STEP) {
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
    for (size_t i = 0; i < n; i += STRUCTURES_STEP) {
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
            worst = compare_max(worst, rms);
            srnf_free(maps[1].points);
            srnf_mesh_clear(&other);
        }
        srnf_free(maps[0].points);
        srnf_mesh_clear(&mesh);
        free(new_index);
    }
    for (size_t i = 0; i < n; i++) {
        free(paths[i]);
    }
    printf("# brain structures turned, moved, renumbered: points differ by at most %.1e rms\n",
           worst);
    assert_true(worst < 0.05);
}

/* ---- Threads --------------------------------------------------------------------------------- */

struct shared {
    const struct srnf_mesh *mesh;
    const struct srnf_spherical_map *expected;
    bool same[8];
};

static void map_again(void *argument, size_t index)
{
    struct shared *shared = argument;
    struct srnf_spherical_map map;

    shared->same[index] = srnf_spherical_map(shared->mesh, NULL, &map, NULL) == SRNF_OK &&
                          memcmp(map.points, shared->expected->points,
                                 3 * shared->mesh->n_vertices * sizeof(double)) == 0;
    srnf_free(map.points);
}

static void test_threads(void **state)
{
    struct srnf_mesh mesh = meshes_bumpy(12, 1);
    struct srnf_spherical_map map;
    struct shared shared = {.mesh = &mesh, .expected = &map};
    (void)state;

    assert_int_equal(srnf_spherical_map(&mesh, NULL, &map, NULL), SRNF_OK);
    parallel_threads(NULL, 8, map_again, &shared);
    for (size_t i = 0; i < 8; i++) {
        assert_true(shared.same[i]);
    }
    srnf_free(map.points);
    srnf_mesh_clear(&mesh);
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
        cmocka_unit_test(test_pose_and_numbering),
        cmocka_unit_test(test_axes),
        cmocka_unit_test(test_repeats),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_cancel),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
