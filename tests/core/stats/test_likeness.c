/*
 * test_likeness.c - what distances between members say of each: the medoid, how far one is from the
 * mean of the others, who stands out, and when a match is one of mirrored or turned surfaces.
 */
#include "group.h"
#include "support/random.h"

#define N ((size_t)12)
#define SPACE ((size_t)5)

/* Points of a cloud and the distances between them; the one of that number moved away. */
static void cloud(size_t strange, double by, double points[N][SPACE], double distances[N * N])
{
    struct test_random random = test_random_seed(7);

    for (size_t i = 0; i < N; i++) {
        for (size_t c = 0; c < SPACE; c++) {
            points[i][c] = test_random_normal(&random) + (i == strange ? by : 0.0);
        }
    }
    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < N; j++) {
            double square = 0.0;

            for (size_t c = 0; c < SPACE; c++) {
                square += (points[i][c] - points[j][c]) * (points[i][c] - points[j][c]);
            }
            distances[i * N + j] = sqrt(square);
        }
    }
}

static void distances_are_those_from_the_mean(void **state)
{
    double points[N][SPACE], distances[N * N], values[N];

    (void)state;
    cloud(3, 2.0, points, distances);
    srnf_distances_from_others(N, distances, values);
    for (size_t i = 0; i < N; i++) {
        double square = 0.0;

        for (size_t c = 0; c < SPACE; c++) {
            double mean = 0.0;

            for (size_t j = 0; j < N; j++) {
                mean += j == i ? 0.0 : points[j][c] / (double)(N - 1);
            }
            square += (points[i][c] - mean) * (points[i][c] - mean);
        }
        assert_true(fabs(values[i] - sqrt(square)) < 1e-12);
    }
    /* No points have these distances. */
    memset(distances, 0, sizeof distances);
    distances[1] = distances[N] = 1.0;
    srnf_distances_from_others(N, distances, values);
    assert_true(values[2] == 0.0);
}

static void medoids_are_in_the_middle(void **state)
{
    double distances[5 * 5];
    const size_t classes[5] = {0, 1, 0, 0, 1};
    const bool taken[5] = {false, false, true, false, false};

    (void)state;
    for (size_t i = 0; i < 5; i++) { /* on a line, at 0 1 2 3 and 10 */
        for (size_t j = 0; j < 5; j++) {
            double a = i == 4 ? 10.0 : (double)i, b = j == 4 ? 10.0 : (double)j;

            distances[5 * i + j] = fabs(a - b);
        }
    }
    assert_int_equal(srnf_medoid(5, distances, NULL, 0, NULL), 2);
    assert_int_equal(srnf_medoid(5, distances, NULL, 0, taken), 1);
    assert_int_equal(srnf_medoid(5, distances, classes, 0, NULL), 2);
    assert_int_equal(srnf_medoid(5, distances, classes, 0, taken), 3);
    assert_int_equal(srnf_medoid(5, distances, classes, 1, NULL), 1);
    assert_int_equal(srnf_medoid(5, distances, classes, 2, NULL), 5);
}

static void the_strange_one_stands_out(void **state)
{
    double points[N][SPACE], distances[N * N];
    struct srnf_typicality verdicts[N];

    (void)state;
    cloud(3, 20.0, points, distances);
    assert_int_equal(srnf_members_judge(N, distances, verdicts), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_int_equal(verdicts[i].far, i == 3);
    }
    assert_true(verdicts[3].percentile == 100.0);
    cloud(3, 0.0, points, distances);
    assert_int_equal(srnf_members_judge(N, distances, verdicts), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        assert_false(verdicts[i].far);
    }
    assert_int_equal(srnf_members_judge(3, distances, verdicts), SRNF_EINVAL);
}

/* Distances of fourteen left ventricles from the mean of the others, which vary a lot, and that of
   a hippocampus among them. */
static void a_foreign_organ_is_far_from_a_group_that_varies(void **state)
{
    const double values[] = {0.1317, 0.0697, 0.0816, 0.0927, 0.0654, 0.1583, 0.1369,
                             0.0686, 0.0685, 0.1082, 0.0925, 0.1274, 0.1193, 0.0864};
    struct srnf_typicality t;

    (void)state;
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 14, values, NULL, 0.465,
                                        SRNF_TYPICAL_ALPHA_GROUP, &t),
                     SRNF_OK);
    assert_true(t.far);
    assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 14, values, NULL, 0.25,
                                        SRNF_TYPICAL_ALPHA_GROUP, &t),
                     SRNF_OK);
    assert_false(t.far);
}

/* Two strange references of fourteen hide a third one no more than they must. */
static void strange_references_hide_few(void **state)
{
    struct test_random random = test_random_seed(11);
    size_t found = 0;

    (void)state;
    for (size_t set = 0; set < 200; set++) {
        double values[14];
        struct srnf_typicality t;

        for (size_t i = 0; i < 14; i++) {
            values[i] = exp(0.3 * test_random_normal(&random) + (i < 2 ? 2.4 : 0.0));
        }
        assert_int_equal(srnf_typicality_of(SRNF_TRAIT_DISTANCE, 14, values, NULL, exp(2.4),
                                            SRNF_TYPICAL_ALPHA_GROUP, &t),
                         SRNF_OK);
        found += t.far;
    }
    printf("# beside two others of their kind %zu of 200 are far\n", found);
    assert_true(found >= 150);
}

static void matches_are_judged(void **state)
{
    const double pi = 3.14159265358979323846;
    struct srnf_match match = {.plain = 1.0, .mirrored = 0.79, .unturned = 2.01, .angle = 0.6};

    (void)state;
    assert_true(srnf_match_is_mirrored(&match));
    assert_true(srnf_match_is_turned(&match));
    match.mirrored = 0.81;
    match.unturned = 1.99;
    assert_false(srnf_match_is_mirrored(&match));
    assert_false(srnf_match_is_turned(&match));
    match.unturned = 2.01;
    match.angle = 29.0 * pi / 180.0;
    assert_false(srnf_match_is_turned(&match));
    for (double angle = 0.0; angle <= pi; angle += 0.25) {
        const double turn[9] = {cos(angle), -sin(angle), 0, sin(angle), cos(angle), 0, 0, 0, 1};

        assert_true(fabs(srnf_rotation_angle(turn) - angle) < 1e-7);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_are_those_from_the_mean),
        cmocka_unit_test(medoids_are_in_the_middle),
        cmocka_unit_test(the_strange_one_stands_out),
        cmocka_unit_test(a_foreign_organ_is_far_from_a_group_that_varies),
        cmocka_unit_test(strange_references_hide_few),
        cmocka_unit_test(matches_are_judged),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
