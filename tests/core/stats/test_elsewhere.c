/*
 * test_elsewhere.c - registrations that are searched elsewhere (srnf_context.search): means and
 * folds have the bits that they have without, in whatever order what was found comes back, also
 * where landmarks guide; the first whose landmarks cannot be met is named; a caller
 * who declines, fails or finds something that is none.
 *
 * srnfd-test: slow
 */
#include "group.h"

#include <fftw3.h>

#include "srnf/landmarks.h"

#define DEGREE (FIGURES_SLOW ? 5 : 7)
#define M ((size_t)20) /* landmarks */
#define N (FIGURES_SLOW ? (size_t)3 : (size_t)5)

/* Another machine: it has the numbers of a search and nothing else. */
struct elsewhere {
    int answer; /* SRNF_OK: searches */
    size_t asked, taken;
    bool inside; /* a parallel loop is open */
};

static int search_one(const struct srnf_field_search *search, size_t i, double rotation[9],
                      struct srnf_warp *warp, struct srnf_error *why)
{
    const struct srnf_grid *grid = srnf_sht_grid(search->sht);
    struct srnf_landmarks landmarks;
    struct srnf_sht *sht = NULL;
    int status =
        srnf_sht_create(&sht, srnf_sht_degree(search->sht), grid->kind, grid->n_theta, grid->n_phi);

    if (search->landmarks) {
        search->landmarks(search->argument, i, &landmarks);
    }
    status = status ? status
                    : srnf_register_to_field_landmarks(
                          sht, search->field, search->norm2, search->surfaces[i], search->options,
                          search->landmarks ? &landmarks : NULL, NULL, rotation, warp, why);
    srnf_sht_destroy(sht);
    return status;
}

static int search_elsewhere(void *user, const struct srnf_field_search *search,
                            struct srnf_error *error)
{
    struct elsewhere *elsewhere = user;
    int status = elsewhere->answer;

    (void)error;
    assert_false(elsewhere->inside);
    assert_true(search->from >= 0.0 && search->from < search->to && search->to <= 1.0);
    elsewhere->asked++;
    for (size_t i = search->n; i-- > 0 && status == SRNF_OK;) {
        struct srnf_error why = {.status = SRNF_OK};
        struct srnf_warp warp;
        double rotation[9];

        status = search_one(search, i, rotation, &warp, &why);
        if (status == SRNF_EUNMATCHED) {
            status = search->unmet(search->argument, i, &why);
        } else {
            assert_int_equal(status, SRNF_OK);
            status = search->take(search->argument, i, rotation, &warp);
        }
        assert_null(warp.links);
        elsewhere->taken++;
    }
    return status;
}

static void loop(void *user, size_t count, void (*body)(void *argument, size_t index),
                 void *argument)
{
    struct elsewhere *elsewhere = user;

    assert_false(elsewhere->inside);
    elsewhere->inside = true;
    for (size_t i = 0; i < count; i++) {
        body(argument, i);
    }
    elsewhere->inside = false;
}

static struct srnf_context context_of(struct elsewhere *elsewhere)
{
    return (struct srnf_context){
        .user = elsewhere, .search = search_elsewhere, .parallel_for = loop};
}

/* kind 0: in a common pose, 1: rotated, 2: rotations only, 3: by a grid of their own. */
static struct srnf_register_options registration_of(size_t kind)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    options.degree = kind == 3 ? 14 : 4;
    options.start = SRNF_START_RIGID;
    options.max_steps = kind == 3 ? 2 : 0;
    options.common_pose = kind == 0;
    options.reparameterization = kind != 2;
    return options;
}

static int mean_of(const struct group *g, const struct srnf_register_options *registration,
                   struct elsewhere *elsewhere, struct srnf_mean *mean)
{
    struct srnf_context context = elsewhere ? context_of(elsewhere) : (struct srnf_context){0};
    struct srnf_mean_options options = srnf_mean_options_defaults();

    options.registration = registration;
    options.tolerance = 1e-12;
    options.max_iterations = 2;
    return srnf_karcher_mean(g->sht, N, g->surfaces, &options, &context, mean, NULL);
}

static void means_have_the_same_bits(void **state)
{
    struct group g;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.3);
    for (size_t kind = 0; kind < (FIGURES_SLOW ? 3 : 4); kind++) {
        struct srnf_register_options registration = registration_of(kind);
        struct elsewhere elsewhere = {.answer = SRNF_OK}, declined = {.answer = SRNF_SEARCH_HERE};
        struct srnf_mean here, there, again;

        assert_true(mean_of(&g, &registration, NULL, &here) >= 0);
        assert_true(mean_of(&g, &registration, &elsewhere, &there) >= 0);
        assert_true(mean_of(&g, &registration, &declined, &again) >= 0);
        assert_int_equal(elsewhere.asked, kind == 2 ? here.iterations : 1);
        assert_int_equal(elsewhere.taken, N * elsewhere.asked);
        assert_true(declined.asked > 0);
        assert_memory_equal(here.mean_q, there.mean_q, 3 * g.points * sizeof(double));
        assert_memory_equal(here.coefficients, there.coefficients, g.count * sizeof(double));
        assert_memory_equal(here.distances, there.distances, N * sizeof(double));
        assert_memory_equal(here.registered_q, there.registered_q,
                            N * 3 * g.points * sizeof(double));
        assert_memory_equal(here.mean_q, again.mean_q, 3 * g.points * sizeof(double));
        srnf_mean_clear(&here);
        srnf_mean_clear(&there);
        srnf_mean_clear(&again);
    }
    group_close(&g);
}

static void what_fails_elsewhere_ends_the_mean(void **state)
{
    struct srnf_register_options registration = registration_of(2);
    struct elsewhere elsewhere = {.answer = SRNF_ECANCELED};
    struct srnf_mean mean;
    struct group g;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.3);
    assert_int_equal(mean_of(&g, &registration, &elsewhere, &mean), SRNF_ECANCELED);
    assert_null(mean.mean_q);
    assert_int_equal(elsewhere.asked, 1);
    group_close(&g);
}

static void folds_have_the_same_bits(void **state)
{
    struct srnf_folds_options options = srnf_folds_options_defaults();
    static const enum srnf_metric metrics[] = {SRNF_METRIC_SRNF, SRNF_METRIC_SRM};
    struct group g;

    (void)state;
    options.registration.degree = 3;
    options.registration.start = SRNF_START_RIGID;
    group_open_stars(&g, DEGREE, N + 1, 0.3);
    for (size_t rounds = 1; rounds < (FIGURES_SLOW ? 2 : 3); rounds++) {
        for (size_t k = 0; k < 2; k++) {
            struct elsewhere elsewhere = {.answer = SRNF_OK};
            struct srnf_context context = context_of(&elsewhere);
            struct srnf_folds here, there;
            size_t n = N + 1;

            options.rounds = rounds;
            assert_int_equal(
                srnf_folds_compare(g.sht, metrics[k], n, g.surfaces, &options, NULL, &here, NULL),
                SRNF_OK);
            assert_int_equal(srnf_folds_compare(g.sht, metrics[k], n, g.surfaces, &options,
                                                &context, &there, NULL),
                             SRNF_OK);
            assert_true(elsewhere.asked > 0);
            assert_int_equal(elsewhere.taken, n * elsewhere.asked);
            assert_memory_equal(here.scores, there.scores,
                                n * n * here.components * sizeof(double));
            assert_memory_equal(here.distances, there.distances, n * n * sizeof(double));
            assert_memory_equal(here.spread, there.spread, n * sizeof(double));
            srnf_folds_clear(&here);
            srnf_folds_clear(&there);
        }
    }
    group_close(&g);
}

/* Landmarks of all surfaces, on a spiral that is turned a little from one to the next; those of
   surfaces from `mirrored` on are mirrored: no warp takes them to those of the others. */
static void place(double points[GROUP_MAX][M][3], size_t mirrored)
{
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < M; j++) {
            double z = 1.0 - (2.0 * (double)j + 1.0) / (double)M, r = sqrt(1.0 - z * z);
            double phi = 2.399963229728653 * (double)j + 0.03 * (double)i;

            points[i][j][0] = i >= mirrored ? -r * cos(phi) : r * cos(phi);
            points[i][j][1] = r * sin(phi);
            points[i][j][2] = z;
        }
    }
}

static void guided_means_have_the_same_bits(void **state)
{
    static double points[GROUP_MAX][M][3];
    struct group g;

    (void)state;
    group_open_stars(&g, DEGREE, N, 0.3);
    /* Met, of weight, met by all but the last two, and of weight where two averages coincide. */
    for (int kind = 0; kind < 4; kind++) {
        struct srnf_group_landmarks landmarks = {M, M - 1, points[0][0], kind % 2 ? 0.7 : INFINITY};
        size_t n = kind == 3 ? 2 : N;
        struct srnf_register_options registration = registration_of(kind % 2 == 1);
        struct srnf_mean_options options = srnf_mean_options_defaults();
        struct elsewhere elsewhere = {.answer = SRNF_OK};
        struct srnf_context context = context_of(&elsewhere);
        struct srnf_error why[2] = {{0}, {0}};
        struct srnf_mean mean[2];
        int status[2];

        registration.degree = 6;
        place(points, kind == 2 ? N - 2 : N);
        if (kind == 3) {
            registration.common_pose = true; /* so that the start is the average */
            memcpy(points[1], points[0], sizeof points[1]);
            memcpy(points[1][0], points[0][1], sizeof points[1][0]);
            memcpy(points[1][1], points[0][0], sizeof points[1][1]);
        }
        options.registration = &registration;
        options.landmarks = &landmarks;
        options.max_iterations = 2;
        for (int k = 0; k < 2; k++) {
            status[k] = srnf_karcher_mean(g.sht, n, g.surfaces, &options, k ? &context : NULL,
                                          &mean[k], &why[k]);
        }
        assert_true(elsewhere.asked > 0);
        assert_int_equal(status[0], status[1]);
        assert_int_equal(why[0].element, why[1].element);
        assert_string_equal(why[0].message, why[1].message);
        if (kind == 2) {
            assert_int_equal(status[0], SRNF_EUNMATCHED);
            continue;
        }
        assert_true(status[0] >= 0);
        assert_memory_equal(mean[0].mean_q, mean[1].mean_q, 3 * g.points * sizeof(double));
        assert_memory_equal(mean[0].coefficients, mean[1].coefficients, g.count * sizeof(double));
        assert_memory_equal(mean[0].landmark_points, mean[1].landmark_points,
                            3 * M * n * sizeof(double));
        srnf_mean_clear(&mean[0]);
        srnf_mean_clear(&mean[1]);
    }
    group_close(&g);
}

static void what_is_no_search_is_refused(void **state)
{
    struct srnf_register_options options = registration_of(1);
    struct srnf_warp warp;
    double rotation[9];
    double *field;
    struct group g;

    (void)state;
    group_open_stars(&g, DEGREE, 2, 0.3);
    field = shapes_doubles(3 * g.points);
    assert_int_equal(stats_fields(g.sht, 1, g.surfaces, NULL, field, NULL), SRNF_OK);
#define REFUSES(norm2)                                                                          \
    assert_int_equal(srnf_register_to_field(g.sht, field, norm2, g.surfaces[1], &options, NULL, \
                                            rotation, &warp, NULL),                             \
                     SRNF_EINVAL);                                                              \
    assert_null(warp.links)
    REFUSES(-1.0);
    REFUSES((double)NAN);
    options.symmetric = true;
    REFUSES(0.0);
    options.symmetric = false;
    options.degree = 0;
    REFUSES(0.0);
    options.degree = 4;
    g.f[1][0] = (double)NAN;
    REFUSES(0.0);
    g.f[1][0] = 0.0;
    memset(field, 0, 3 * g.points * sizeof(double));
    REFUSES(0.0);
    srnf_free(field);
    group_close(&g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(means_have_the_same_bits),
        cmocka_unit_test(what_fails_elsewhere_ends_the_mean),
        cmocka_unit_test(folds_have_the_same_bits),
        cmocka_unit_test(guided_means_have_the_same_bits),
        cmocka_unit_test(what_is_no_search_is_refused),
    };
    int failed;

    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    failed = cmocka_run_group_tests(tests, NULL, NULL);
    fftw_cleanup_threads();
    return failed;
}
