/*
 * test_measured.c - fluctuating asymmetry against the error of measurement: mean squares against
 * those of the fields outright, p against all exchanges, rates of false findings with and without
 * directional asymmetry, planted asymmetry; and what every long computation promises.
 */
#include "measured.h"

/* ---- The long way ---------------------------------------------------------------------------- */

static double norm2(const struct measured *m, const double *field)
{
    return srnf_inner_product(m->g.grid, field, field);
}

/* The mean over measurements of a subject, and of a side of it unless that is -1. */
static double mean_of(const struct measured *m, size_t first, int side, double *mean)
{
    double count = 0.0;

    memset(mean, 0, m->size * sizeof(double));
    for (size_t i = 0; i < m->n; i++) {
        if (m->subjects[i] == first && (side < 0 || m->side[i] == side)) {
            count += 1.0;
        }
    }
    for (size_t i = 0; i < m->n; i++) {
        for (size_t p = 0;
             m->subjects[i] == first && (side < 0 || m->side[i] == side) && p < m->size; p++) {
            mean[p] += m->q[i * m->size + p] * m->sizes[i] / count;
        }
    }
    return count;
}

/* Mean squares of sides, interaction and error. */
static void expect(const struct measured *m, double squares[3])
{
    double *mean[2] = {shapes_doubles(m->size), shapes_doubles(m->size)};
    double *whole = shapes_doubles(m->size);
    double *off = shapes_doubles(m->size);
    double sum = 0.0;
    size_t subjects = 0;

    squares[0] = squares[1] = squares[2] = 0.0;
    for (size_t pass = 0; pass < 2; pass++) { /* the mean difference, then what is about it */
        for (size_t s = 0; s < m->n; s++) {
            double weight = 0.0;

            if (m->subjects[s] != s) {
                continue;
            }
            for (int side = 0; side < 2; side++) {
                weight += 1.0 / mean_of(m, s, side, mean[side]);
            }
            for (size_t p = 0; p < m->size; p++) {
                double difference = mean[1][p] - mean[0][p];

                off[p] = pass ? difference - whole[p] / sum : difference;
                whole[p] += pass ? 0.0 : difference / weight;
            }
            sum += pass ? 0.0 : 1.0 / weight;
            subjects += pass;
            squares[1] += pass ? norm2(m, off) / weight : 0.0;
            for (size_t i = 0; pass && i < m->n; i++) {
                for (size_t p = 0; m->subjects[i] == s && p < m->size; p++) {
                    off[p] = m->q[i * m->size + p] * m->sizes[i] - mean[m->side[i]][p];
                }
                squares[2] += m->subjects[i] == s ? norm2(m, off) : 0.0;
            }
        }
    }
    squares[0] = norm2(m, whole) / sum;
    squares[1] /= (double)(subjects - 1);
    squares[2] /= (double)(m->n - 2 * subjects);
    for (size_t k = 0; k < 2; k++) {
        srnf_free(mean[k]);
    }
    srnf_free(whole);
    srnf_free(off);
}

static void mean_squares_are_those_of_the_fields(void **state)
{
    (void)state;
    for (size_t unequal = 0; unequal < 2; unequal++) {
        const struct measured_plan plan = {7, unequal, 0.5, 0.3, 0.2, 1 + unequal};
        struct srnf_asymmetry_test out;
        struct measured m;
        double squares[3];

        measured_open(&m, &plan);
        for (size_t i = 0; i < m.n; i++) {
            m.sizes[i] = 1.0 + 0.01 * (double)(i % 5);
        }
        expect(&m, squares);
        assert_int_equal(measured_test(&m, 9, 1, NULL, &out), SRNF_OK);
        assert_int_equal(out.freedom[0], 6);
        assert_int_equal(out.freedom[1], m.n - 14);
        figure_below("side, relative", fabs(out.side / squares[0] - 1.0), 1e-11);
        figure_below("interaction, relative", fabs(out.interaction / squares[1] - 1.0), 1e-11);
        figure_below("error, relative", fabs(out.error / squares[2] - 1.0), 1e-11);
        figure_below("F, relative", fabs(out.f.value / (squares[1] / squares[2]) - 1.0), 1e-11);
        measured_close(&m);
    }
}

/* The sum of squares about the mean of all is that of its parts, where all are measured twice. */
static void squares_add_up(void **state)
{
    const struct measured_plan plan = {6, false, 0.5, 0.3, 0.2, 3};
    struct srnf_asymmetry_test out;
    struct measured m;
    double *mean;
    double whole = 0.0;
    double parts;

    (void)state;
    measured_open(&m, &plan);
    mean = shapes_doubles(m.size);
    for (size_t k = 0; k < m.n * m.size; k++) {
        mean[k % m.size] += m.q[k] / (double)m.n;
    }
    assert_int_equal(measured_test(&m, 9, 1, NULL, &out), SRNF_OK);
    for (size_t i = 0; i < m.n; i++) {
        for (size_t p = 0; p < m.size; p++) {
            m.q[i * m.size + p] -= mean[p];
        }
        whole += norm2(&m, m.q + i * m.size);
    }
    parts = 5.0 * out.individual + out.side + 5.0 * out.interaction + 12.0 * out.error;
    figure_below("squares off the sum of their parts, relative", fabs(parts / whole - 1.0), 1e-12);
    srnf_free(mean);
    measured_close(&m);
}

/* ---- What is found --------------------------------------------------------------------------- */

static void error_alone_is_found_at_the_level(void **state)
{
    const size_t runs = 200;
    size_t found = 0;

    (void)state;
    figures_count_unsanitized();
    for (size_t run = 0; run < runs; run++) {
        const struct measured_plan plan = {8, run % 2, run % 3 ? 1.0 : 0.0, 0.0, 0.2, 100 + run};
        struct srnf_asymmetry_test out;
        struct measured m;

        measured_open(&m, &plan);
        assert_int_equal(measured_test(&m, 99, run, NULL, &out), SRNF_OK);
        found += out.p_value <= 0.05;
        measured_close(&m);
    }
    printf("# %zu of %zu at .05 or below\n", found, runs);
    assert_true(found >= 2 && found <= 20); /* binomial: beyond either with a chance of 1e-3 */
}

/* Asymmetry as large as the error, in studies of n subjects. Each of 12 patterns has a length, so
   that V is fluctuating^2 times the sum of their squares. Returns the root of the mean square error
   of the size. */
static double recover(size_t n, size_t runs, size_t inside[2], size_t *found)
{
    double square = 0.0;

    inside[0] = inside[1] = *found = 0;
    for (size_t run = 0; run < runs; run++) {
        const struct measured_plan plan = {n, run % 2, 1.0, 0.2, 0.2, 200 + run};
        struct srnf_asymmetry_test out;
        struct measured m;
        double length = 0.0;
        double truth;
        double off;

        measured_open(&m, &plan);
        for (size_t k = 0; k < MEASURED_PATTERNS; k++) {
            length += norm2(&m, m.patterns + k * m.size);
        }
        truth = 0.2 * sqrt(length);
        assert_int_equal(measured_test(&m, 99, run, NULL, &out), SRNF_OK);
        *found += out.p_value <= 0.05;
        off = out.fluctuating.value / truth - 1.0;
        square += off * off / (double)runs;
        inside[0] += out.fluctuating.interval[0] <= truth && truth <= out.fluctuating.interval[1];
        inside[1] += out.repeatability.interval[0] <= 1.0 / 3.0 &&
                     1.0 / 3.0 <= out.repeatability.interval[1];
        measured_close(&m);
    }
    return sqrt(square);
}

static void planted_asymmetry_is_found_with_its_size(void **state)
{
    const size_t runs = 60;
    double errors[3];

    (void)state;
    for (size_t step = 0; step < 3; step++) {
        size_t n = (size_t)8 << (2 * step);
        size_t inside[2];
        size_t found;

        errors[step] = recover(n, step < 2 ? runs : runs / 3, inside, &found);
        printf("# %zu subjects: found %zu, in their intervals size %zu, share %zu; off %.3f\n", n,
               found, inside[0], inside[1], errors[step]);
        if (step == 1) { /* binomial(60, .95): fewer than 50 with a chance of 1e-3 */
            assert_true(found == runs && inside[0] >= 50 && inside[1] >= 50);
        }
    }
    figure_below("error of 32 subjects over that of 8: a half", errors[1] / errors[0], 0.7);
    figure_below("error of 128 subjects over that of 32", errors[2] / errors[1], 0.7);
}

/* All but the first subjects keep one measurement of each side. */
static void repeat_only(struct measured *m, size_t subjects)
{
    size_t kept = 0;
    size_t seen = 0;
    int side = -1; /* of the measurement before */

    for (size_t i = 0; i < m->n; i++) {
        bool first = m->subjects[i] == i || m->side[i] != side;

        seen += m->subjects[i] == i;
        side = m->side[i];
        if (seen <= subjects || first) {
            memmove(m->q + kept * m->size, m->q + i * m->size, m->size * sizeof(double));
            m->side[kept] = side;
            m->subjects[kept++] = seen - 1;
        }
    }
    m->n = m->given.n = kept;
}

/* Of 20 subjects so many are measured repeatedly. Returns how many of the runs have the error of a
   measurement in its interval; none has one where none can be told. */
static size_t cover(size_t repeated, bool told, size_t runs)
{
    size_t inside = 0;

    for (size_t run = 0; run < runs; run++) {
        const struct measured_plan plan = {20, false, 1.0, 0.2, 0.2, 400 + run};
        struct srnf_asymmetry_test out;
        struct measured m;
        double length = 0.0;
        double truth;

        measured_open(&m, &plan);
        for (size_t k = 0; k < MEASURED_PATTERNS; k++) {
            length += norm2(&m, m.patterns + k * m.size);
        }
        truth = 0.2 * sqrt(length);
        repeat_only(&m, repeated);
        assert_int_equal(measured_test(&m, 9, run, NULL, &out), SRNF_OK);
        assert_int_equal(out.repeated, repeated);
        assert_true(out.measured.value > 0.0 && out.f.value > 0.0);
        for (size_t k = 0; k < 2; k++) {
            assert_int_equal(isfinite(out.measured.interval[k]), told);
            assert_int_equal(isfinite(out.f.interval[k]), told);
            assert_int_equal(isfinite(out.error_interval[k]), told);
            assert_true(isfinite(out.interaction_interval[k]));
            assert_true(isfinite(out.individual_interval[k]));
            assert_int_equal(isfinite(out.fluctuating.interval[k]), told);
            assert_int_equal(isfinite(out.repeatability.interval[k]), told);
        }
        assert_true(!told || out.measured.interval[1] > out.measured.value);
        inside += out.measured.interval[0] <= truth && truth <= out.measured.interval[1];
        measured_close(&m);
    }
    return inside;
}

static void few_repeated_subjects_have_no_interval(void **state)
{
    (void)state;
    for (size_t repeated = 1; repeated < SRNF_PAIRS_MIN; repeated++) {
        assert_int_equal(cover(repeated, false, 5), 0);
    }
    for (size_t repeated = SRNF_PAIRS_MIN; repeated <= 20; repeated *= 2) {
        size_t inside = cover(repeated, true, 60);

        printf("# %zu repeated: %zu of 60 inside\n", repeated, inside);
        assert_true(inside >= 45);
    }
}

/* Of studies of n subjects that are measured twice, w_s being 1: how many miss the expectations of
   the mean squares of individuals, interaction and error. */
static void miss_squares(size_t n, size_t runs, size_t missed[3])
{
    memset(missed, 0, 3 * sizeof *missed);
    for (size_t run = 0; run < runs; run++) {
        const struct measured_plan plan = {n, false, 1.0, 0.3, 0.2, 700 + run};
        struct srnf_asymmetry_test out;
        struct measured m;
        double length = 0.0;
        const double *intervals[3] = {out.individual_interval, out.interaction_interval,
                                      out.error_interval};
        const double *values[3] = {&out.individual, &out.interaction, &out.error};

        measured_open(&m, &plan);
        for (size_t k = 0; k < MEASURED_PATTERNS; k++) {
            length += norm2(&m, m.patterns + k * m.size);
        }
        assert_int_equal(measured_test(&m, 1, run, NULL, &out), SRNF_OK);
        for (size_t k = 0; k < 3; k++) {
            double truth = length * (k == 0 ? 4.04 : k == 1 ? 0.13 : 0.04);

            assert_true(intervals[k][0] <= *values[k] && *values[k] <= intervals[k][1]);
            missed[k] += !(intervals[k][0] <= truth && truth <= intervals[k][1]);
        }
        measured_close(&m);
    }
}

static void mean_squares_have_intervals(void **state)
{
    static const size_t sizes[] = {5, 8, 20};

    (void)state;
    for (size_t k = 0; k < 3; k++) {
        size_t missed[3];

        miss_squares(sizes[k], 200, missed);
        printf("# %zu subjects: of 200 missed individual %zu, interaction %zu, error %zu\n",
               sizes[k], missed[0], missed[1], missed[2]);
        for (size_t s = 0; s < 3; s++) {
            assert_in_range(missed[s], 0, 21); /* one in twenty, beyond with a chance of 3e-4 */
        }
    }
}

/* One subject measured so often on either side, without error, and four once: what is observed is
   more asymmetric than every exchange that differs from it, but for that of all sides at once. */
static void least_p_is_that_of_the_best_asymmetry(void **state)
{
    (void)state;
    for (size_t other = 1; other <= 2; other++) {
        const struct measured_plan plan = {5, false, 0.5, 1.0, 1e-6, 500};
        const double relabellings = other == 1 ? 48.0 : 96.0;
        const double least = (other == 1 ? 1.0 : 2.0) / relabellings;
        const double permutations = 20000.0;
        struct srnf_asymmetry_test out;
        struct measured m;

        measured_open(&m, &plan);
        repeat_only(&m, 1);
        if (other == 1) { /* the first measurement of the first subject goes */
            m.n = --m.given.n;
            memmove(m.q, m.q + m.size, m.n * m.size * sizeof(double));
            memmove(m.side, m.side + 1, m.n * sizeof *m.side);
            memmove(m.subjects, m.subjects + 1, m.n * sizeof *m.subjects);
        }
        assert_int_equal(measured_test(&m, (size_t)permutations, 1, NULL, &out), SRNF_OK);
        figure_below("relabellings off", fabs(out.test.relabellings - relabellings), 1e-9);
        figure_below("least p off", fabs(out.test.least - least), 1e-12);
        figure_below("p off its least, in standard errors",
                     fabs(out.p_value - least) / sqrt(least * (1.0 - least) / permutations), 4.0);
        measured_close(&m);
    }
}

/* ---- What every long computation promises ---------------------------------------------------- */

static void results_do_not_depend_on_threads(void **state)
{
    const struct measured_plan plan = {8, true, 0.1, 0.05, 0.03, 80};
    struct srnf_asymmetry_test alone;
    struct measured m;

    (void)state;
    measured_open(&m, &plan);
    assert_int_equal(measured_test(&m, 199, 1, NULL, &alone), SRNF_OK);
    for (size_t s = 0; s < GROUP_SPREADS; s++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[s]);
        struct srnf_asymmetry_test out;

        assert_int_equal(measured_test(&m, 199, 1, &context, &out), SRNF_OK);
        assert_true(out.p_value == alone.p_value);
        assert_memory_equal(&out.repeatability, &alone.repeatability, sizeof out.repeatability);
        watch.cancel_after = 0;
        assert_int_equal(measured_test(&m, 199, 1, &context, &out), SRNF_ECANCELED);
    }
    measured_close(&m);
}

static void refuse(const struct measured *m, int expected, const char *pattern)
{
    struct srnf_asymmetry_test out = {.p_value = 7.0};
    struct srnf_error error = {0};

    assert_int_equal(srnf_test_asymmetry(m->g.sht, &m->given, NULL, NULL, &out, &error), expected);
    if (!strstr(error.message, pattern)) {
        fail_msg("\"%s\" for \"%s\"", error.message, pattern);
    }
    assert_true(out.p_value > 6.0);
}

static void wrong_input_is_refused(void **state)
{
    const struct measured_plan plan = {5, false, 0.1, 0.05, 0.03, 81};
    struct srnf_paired_options options = srnf_paired_options_defaults();
    struct srnf_asymmetry_test out;
    struct measured m;

    (void)state;
    measured_open(&m, &plan);
    options.permutations = 0;
    assert_int_equal(srnf_test_asymmetry(m.g.sht, &m.given, &options, NULL, &out, NULL),
                     SRNF_EINVAL);
    options = srnf_paired_options_defaults();
    options.bootstraps = 99;
    assert_int_equal(srnf_test_asymmetry(m.g.sht, &m.given, &options, NULL, &out, NULL),
                     SRNF_EINVAL);
    m.side[1] = 2;
    refuse(&m, SRNF_EINVAL, "the side of measurement 1 is neither 0 nor 1");
    m.side[1] = 0;
    m.side[2] = m.side[3] = 0;
    refuse(&m, SRNF_EINVAL, "the subject of measurement 0 has no side 1");
    m.side[2] = m.side[3] = 1;
    m.sizes[4] = 0.0;
    refuse(&m, SRNF_EINVAL, "the size of measurement 4 is not positive");
    m.sizes[4] = 1.0;
    m.given.n = 16;
    refuse(&m, SRNF_EINVAL, "4 subjects; 5 are needed");
    m.given.n = m.n;
    for (size_t i = 0; i < m.n; i += 2) {
        memcpy(m.q + (i + 1) * m.size, m.q + i * m.size, m.size * sizeof(double));
    }
    refuse(&m, SRNF_EDEGENERATE, "repeated measurements are all equal");
    for (size_t i = 0; i < m.n / 2; i++) { /* one of each side */
        m.side[i] = (int)(i % 2);
        m.subjects[i] = i / 2;
    }
    m.given.n = m.n / 2;
    refuse(&m, SRNF_EINVAL, "no side of any subject is measured twice");
    m.q[7] = NAN;
    m.given.n = m.n;
    m.subjects[0] = m.n;
    refuse(&m, SRNF_EINVAL, "subject");
    measured_close(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mean_squares_are_those_of_the_fields),
        cmocka_unit_test(squares_add_up),
        cmocka_unit_test(error_alone_is_found_at_the_level),
        cmocka_unit_test(planted_asymmetry_is_found_with_its_size),
        cmocka_unit_test(few_repeated_subjects_have_no_interval),
        cmocka_unit_test(mean_squares_have_intervals),
        cmocka_unit_test(least_p_is_that_of_the_best_asymmetry),
        cmocka_unit_test(results_do_not_depend_on_threads),
        cmocka_unit_test(wrong_input_is_refused),
    };

    openblas_set_num_threads(1);
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
