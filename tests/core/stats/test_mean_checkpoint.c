/*
 * test_mean_checkpoint.c - a group mean that is stopped after its third iteration and resumed ends
 * with the same bits as one that was not; bytes that are foreign or damaged are refused.
 * srnfd-test: slow
 */
#include "group.h"

#include <fftw3.h>

#define DEGREE (FIGURES_SLOW ? 5 : 7)
#define N (FIGURES_SLOW ? (size_t)3 : (size_t)4)
#define ITERATIONS ((size_t)5)
#define STOP_AFTER ((size_t)3)
#define STRIDE ((size_t)(FIGURES_SLOW ? 1601 : 397)) /* of the words that lie */
#define TURNED ((size_t)(FIGURES_SLOW ? 3 : 1))      /* every n-th byte of those that are turned */
#define HEAD_WORDS ((size_t)13)                      /* before the history */

/* Keeps the bytes of every checkpoint; asks to stop after one of them. */
struct keeper {
    unsigned char *bytes[ITERATIONS];
    size_t size[ITERATIONS];
    size_t count, stop_after;
};

static void keep(void *user, const void *bytes, size_t size)
{
    struct keeper *keeper = user;

    assert_true(keeper->count < ITERATIONS);
    keeper->bytes[keeper->count] = malloc(size);
    assert_non_null(keeper->bytes[keeper->count]);
    memcpy(keeper->bytes[keeper->count], bytes, size);
    keeper->size[keeper->count++] = size;
}

static bool stop(void *user)
{
    const struct keeper *keeper = user;

    return keeper->count >= keeper->stop_after;
}

static void forget(struct keeper *keeper)
{
    for (size_t i = 0; i < keeper->count; i++) {
        free(keeper->bytes[i]);
    }
    keeper->count = 0;
}

struct setting {
    struct group g;
    struct keeper keeper;
    struct srnf_register_options registration;
    struct srnf_mean_options options;
};

/* kind 0: in a common pose, 1: rotated, 2: rotations only, 3: not registered. */
#define KINDS 4
static void open_setting(struct setting *s, size_t kind)
{
    *s = (struct setting){.keeper.stop_after = SIZE_MAX};
    group_open_stars(&s->g, DEGREE, N, 0.3);
    s->registration = srnf_register_options_defaults();
    s->registration.degree = 4;
    s->registration.start = SRNF_START_RIGID;
    s->registration.common_pose = kind == 0;
    s->registration.reparameterization = kind != 2;
    s->options = srnf_mean_options_defaults();
    s->options.registration = kind == 3 ? NULL : &s->registration;
    s->options.tolerance = 1e-12; /* out of reach but for what is not warped */
    s->options.max_iterations = ITERATIONS;
    s->options.checkpoint = keep;
    s->options.checkpoint_user = &s->keeper;
}

static void close_setting(struct setting *s)
{
    forget(&s->keeper);
    group_close(&s->g);
}

static void assert_same(const struct group *g, const struct srnf_mean *a, const struct srnf_mean *b)
{
    assert_int_equal(a->iterations, b->iterations);
    assert_int_equal(a->converged, b->converged);
    assert_memory_equal(a->mean_q, b->mean_q, 3 * g->points * sizeof(double));
    assert_memory_equal(a->registered_q, b->registered_q, N * 3 * g->points * sizeof(double));
    assert_memory_equal(a->coefficients, b->coefficients, g->count * sizeof(double));
    assert_memory_equal(a->distances, b->distances, N * sizeof(double));
    for (size_t k = 0; k < a->iterations; k++) {
        assert_true(a->history[k].change == b->history[k].change);
        assert_true(a->history[k].variance == b->history[k].variance);
    }
}

static void goes_on_from_any_iteration(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < KINDS; kind++) {
        struct setting s;
        struct keeper all;
        struct srnf_mean whole;
        struct srnf_mean resumed;

        open_setting(&s, kind);
        assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &whole, NULL) >=
                    0);
        assert_int_equal(s.keeper.count, whole.iterations);
        printf("# kind %zu: %zu iterations, %zu bytes in the end\n", kind, whole.iterations,
               s.keeper.size[s.keeper.count - 1]);
        all = s.keeper;
        s.keeper = (struct keeper){.stop_after = SIZE_MAX};
        for (size_t k = 0; k < all.count; k += FIGURES_SLOW ? 3 : 1) {
            s.options.resume = all.bytes[k];
            s.options.resume_size = all.size[k];
            assert_true(
                srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &resumed, NULL) >= 0);
            assert_same(&s.g, &whole, &resumed);
            assert_int_equal(s.keeper.count, all.count - 1 - k);
            srnf_mean_clear(&resumed);
            forget(&s.keeper);
        }
        srnf_mean_clear(&whole);
        forget(&all);
        close_setting(&s);
    }
}

static void killed_after_the_third_iteration(void **state)
{
    struct setting s;
    struct srnf_context context = {.user = &s.keeper, .canceled = stop};
    struct srnf_mean whole;
    struct srnf_mean mean;

    (void)state;
    open_setting(&s, 0);
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &whole, NULL) >= 0);
    forget(&s.keeper);
    s.keeper.stop_after = STOP_AFTER;
    assert_int_equal(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, &context, &mean, NULL),
                     SRNF_ECANCELED);
    assert_null(mean.mean_q);
    assert_int_equal(s.keeper.count, STOP_AFTER);
    s.options.resume = s.keeper.bytes[STOP_AFTER - 1];
    s.options.resume_size = s.keeper.size[STOP_AFTER - 1];
    s.options.checkpoint = NULL;
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, NULL) >= 0);
    assert_same(&s.g, &whole, &mean);
    srnf_mean_clear(&mean);
    srnf_mean_clear(&whole);
    close_setting(&s);
}

/* ---- What is refused ------------------------------------------------------------------------- */

static void assert_refused(struct setting *s, const void *bytes, size_t size)
{
    struct srnf_error error = {0};
    struct srnf_mean mean;

    s->options.resume = bytes;
    s->options.resume_size = size;
    assert_int_equal(
        srnf_karcher_mean(s->g.sht, N, s->g.surfaces, &s->options, NULL, &mean, &error),
        SRNF_EINVAL);
    assert_int_equal(error.status, SRNF_EINVAL);
    assert_non_null(strstr(error.message, "resume"));
}

/* One checkpoint of a setting, in memory of its own. */
static unsigned char *make_checkpoint(struct setting *s, size_t *size)
{
    struct srnf_mean mean;
    unsigned char *bytes;

    s->options.max_iterations = 1;
    assert_true(srnf_karcher_mean(s->g.sht, N, s->g.surfaces, &s->options, NULL, &mean, NULL) >= 0);
    srnf_mean_clear(&mean);
    s->options.max_iterations = ITERATIONS;
    bytes = s->keeper.bytes[0];
    *size = s->keeper.size[0];
    s->keeper.count = 0;
    return bytes;
}

/* Every byte of the head, and others at random, with one bit turned; every length of the head, and
   others at random. */
static void damaged_bytes(void **state)
{
    struct setting s;
    struct test_random random = test_random_seed(6);
    unsigned char *bytes;
    size_t size;

    (void)state;
    open_setting(&s, 0);
    bytes = make_checkpoint(&s, &size);
    for (size_t at = 0; at < size;
         at += TURNED * (at < 200 ? 1 : 1 + test_random_below(&random, 500))) {
        unsigned char kept = bytes[at];

        bytes[at] ^= (unsigned char)(1u << test_random_below(&random, 8));
        assert_refused(&s, bytes, size);
        bytes[at] = kept;
    }
    for (size_t length = 0; length < size;
         length += length < 200 ? 1 : TURNED * (1 + test_random_below(&random, 500))) {
        unsigned char *exact = malloc(length + 1); /* a read beyond it is seen by the sanitizer */

        assert_non_null(exact);
        memcpy(exact + 1, bytes, length);
        assert_refused(&s, exact + 1, length);
        free(exact);
    }
    free(bytes);
    close_setting(&s);
}

/* Counts that lie, under a sum that is right. */
static void bytes_that_do_not_hold_what_they_say(void **state)
{
    struct setting s;
    unsigned char *bytes;
    size_t size;
    size_t words;

    (void)state;
    open_setting(&s, 0);
    bytes = make_checkpoint(&s, &size);
    words = size / 8;
    for (size_t word = 3; word < words - 1; word += word < 2 * HEAD_WORDS ? 1 : STRIDE) {
        static const uint64_t lies[] = {0x7ff0000000000000, UINT64_MAX, UINT64_MAX / 8, 1 << 20};

        for (size_t lie = 0; lie < 4; lie++) {
            unsigned char *copy = malloc(size);
            uint64_t hash = UINT64_C(14695981039346656037);
            struct srnf_error error = {0};
            struct srnf_mean mean;
            int status;

            assert_non_null(copy);
            memcpy(copy, bytes, size);
            memcpy(copy + 8 * word, &lies[lie], 8);
            for (size_t i = 0; i < size - 8; i++) {
                hash = (hash ^ copy[i]) * UINT64_C(1099511628211);
            }
            memcpy(copy + size - 8, &hash, 8);
            s.options.resume = copy;
            s.options.resume_size = size;
            s.options.max_iterations = 1;
            status = srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, &error);
            /* No count, and nothing that is not finite; but a number that is merely another one
               cannot be told from the right one. */
            assert_true((word >= HEAD_WORDS && lie >= 2) || status == SRNF_EINVAL);
            if (status >= 0) {
                srnf_mean_clear(&mean);
            }
            free(copy);
        }
    }
    free(bytes);
    close_setting(&s);
}

static void bytes_of_another_group_or_other_options(void **state)
{
    struct setting s;
    struct srnf_mean mean;
    unsigned char *bytes;
    size_t size;
    double kept;

    (void)state;
    open_setting(&s, 0);
    bytes = make_checkpoint(&s, &size);
    s.registration.degree = 3;
    assert_refused(&s, bytes, size);
    s.registration.degree = 4;
    s.registration.penalty_jacobian *= 2.0;
    assert_refused(&s, bytes, size);
    s.registration.penalty_jacobian /= 2.0;
    s.registration.common_pose = false;
    assert_refused(&s, bytes, size);
    s.registration.common_pose = true;
    s.options.registration = NULL;
    assert_refused(&s, bytes, size);
    s.options.registration = &s.registration;
    kept = s.g.f[2][10];
    s.g.f[2][10] += 1e-12;
    assert_refused(&s, bytes, size);
    s.g.f[2][10] = kept;
    assert_int_equal(s.keeper.count, 0);
    /* When to stop is free to change. */
    s.options.resume = bytes;
    s.options.resume_size = size;
    s.options.tolerance = 1.0;
    assert_int_equal(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, NULL),
                     SRNF_OK);
    assert_int_equal(mean.iterations, 1);
    srnf_mean_clear(&mean);
    free(bytes);
    close_setting(&s);
}

/* ---- Registrations of the first iteration ---------------------------------------------------- */

#define PARTS (2 * N)

struct shelf {
    double *values[2 * 8];
    size_t count[2 * 8], asked, recalled, stop_after; /* stop_after: parts */
    size_t n;
};

static bool shelf_recall(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    struct shelf *shelf = user;

    (void)series;
    shelf->asked++;
    if (index >= PARTS || !shelf->values[index] || shelf->count[index] != count) {
        return false;
    }
    memcpy(values, shelf->values[index], count * sizeof(double));
    shelf->recalled++;
    return true;
}

static void shelf_keep(void *user, uint64_t series, uint64_t index, size_t count,
                       const double *values)
{
    struct shelf *shelf = user;

    (void)series;
    assert_true(index < PARTS);
    if (count == 0) { /* the checkpoint has them */
        for (size_t k = 0; k < PARTS; k++) {
            free(shelf->values[k]);
            shelf->values[k] = NULL;
        }
        return;
    }
    free(shelf->values[index]);
    shelf->values[index] = malloc(count * sizeof(double));
    assert_non_null(shelf->values[index]);
    memcpy(shelf->values[index], values, count * sizeof(double));
    shelf->count[index] = count;
    shelf->n++;
}

static bool shelf_stop(void *user)
{
    const struct shelf *shelf = user;

    return shelf->n >= shelf->stop_after;
}

/* Stopped after two registrations, it ends with the bits of a run that was not; and registrations
   that are not what was kept are made anew. */
static void goes_on_within_the_first_iteration(void **state)
{
    struct setting s;
    struct shelf shelf = {.stop_after = 4};
    struct srnf_context context = {
        .user = &shelf, .canceled = shelf_stop, .recall = shelf_recall, .keep = shelf_keep};
    struct srnf_mean whole, resumed;

    (void)state;
    open_setting(&s, 1);
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &whole, NULL) >= 0);
    forget(&s.keeper);
    assert_int_equal(
        srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, &context, &resumed, NULL),
        SRNF_ECANCELED);
    assert_int_equal(shelf.n, 4);
    assert_int_equal(shelf.recalled, 0);
    shelf.values[3][9] = 7.5; /* the kind of its first link: made anew */
    shelf.stop_after = SIZE_MAX;
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, &context, &resumed, NULL) >=
                0);
    assert_int_equal(shelf.recalled, 4);
    assert_int_equal(shelf.n, 4 + 2 * (N - 1));
    assert_same(&s.g, &whole, &resumed);
    for (size_t k = 0; k < PARTS; k++) {
        assert_null(shelf.values[k]);
    }
    srnf_mean_clear(&whole);
    srnf_mean_clear(&resumed);
    close_setting(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(goes_on_from_any_iteration),
        cmocka_unit_test(goes_on_within_the_first_iteration),
        cmocka_unit_test(killed_after_the_third_iteration),
        cmocka_unit_test(damaged_bytes),
        cmocka_unit_test(bytes_that_do_not_hold_what_they_say),
        cmocka_unit_test(bytes_of_another_group_or_other_options),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
