/*
 * test_mean_spill.c - a group mean with its warps in scratch has the bits of one in memory, however
 * few of them are held, on any number of threads and resumed from any iteration or registration;
 * scratch that fails, or is not what it was, is no answer.
 * srnfd-test: slow
 */
#include "group.h"

#include <fftw3.h>
#include <pthread.h>

#define DEGREE 4
#define N ((size_t)4)
#define ITERATIONS ((size_t)3)
#define PAGE ((size_t)4 * 36 * 72 * sizeof(double)) /* of a subject's points: 36 rows at least */
#define SCRATCH_BYTES ((size_t)8 << 20)
#define PARTS ((size_t)2 * N)

/* Scratch in memory, checkpoints and parts. */
struct world {
    unsigned char *bytes; /* [SCRATCH_BYTES] */
    size_t end, most;     /* first byte beyond what was written; first beyond what may be */
    bool spoils;          /* a bit of points changes before they are read */
    atomic_size_t written, read;
    pthread_mutex_t mutex; /* end, parts */
    unsigned char *checkpoint[ITERATIONS];
    size_t checkpoint_size[ITERATIONS], checkpoints;
    size_t end_at[ITERATIONS]; /* of scratch */
    double parts[PARTS][16];
    size_t part_size[PARTS];
    size_t forgotten, recalled;
};

static int on_write(void *user, uint64_t offset, const void *bytes, size_t size)
{
    struct world *w = user;

    if (offset > w->most || size > w->most - offset) {
        return SRNF_EIO;
    }
    memcpy(w->bytes + offset, bytes, size);
    atomic_fetch_add(&w->written, size);
    pthread_mutex_lock(&w->mutex);
    w->end = offset + size > w->end ? offset + size : w->end;
    pthread_mutex_unlock(&w->mutex);
    return SRNF_OK;
}

static int on_read(void *user, uint64_t offset, void *bytes, size_t size)
{
    struct world *w = user;

    if (offset > SCRATCH_BYTES || size > SCRATCH_BYTES - offset) {
        return SRNF_EIO;
    }
    memcpy(bytes, w->bytes + offset, size);
    if (w->spoils && size >= PAGE) {
        ((unsigned char *)bytes)[size / 2] ^= 1;
    }
    atomic_fetch_add(&w->read, size);
    return SRNF_OK;
}

static void on_checkpoint(void *user, const void *bytes, size_t size)
{
    struct world *w = user;

    assert_true(w->checkpoints < ITERATIONS);
    w->end_at[w->checkpoints] = w->end;
    w->checkpoint[w->checkpoints] = malloc(size);
    assert_non_null(w->checkpoint[w->checkpoints]);
    memcpy(w->checkpoint[w->checkpoints], bytes, size);
    w->checkpoint_size[w->checkpoints++] = size;
}

static bool on_recall(void *user, uint64_t series, uint64_t index, size_t count, double *values)
{
    struct world *w = user;

    (void)series;
    if (index >= PARTS || w->part_size[index] != count) {
        return false;
    }
    memcpy(values, w->parts[index], count * sizeof(double));
    w->recalled++;
    return true;
}

static void on_keep(void *user, uint64_t series, uint64_t index, size_t count, const double *values)
{
    struct world *w = user;

    (void)series;
    w->forgotten += count == 0;
    if (count > 0 && index < PARTS && count <= 16) {
        memcpy(w->parts[index], values, count * sizeof(double));
        w->part_size[index] = count;
    }
}

static void open_world(struct world *w)
{
    *w = (struct world){.most = SCRATCH_BYTES, .bytes = calloc(1, SCRATCH_BYTES)};
    pthread_mutex_init(&w->mutex, NULL);
    assert_non_null(w->bytes);
}

static void close_world(struct world *w)
{
    for (size_t k = 0; k < w->checkpoints; k++) {
        free(w->checkpoint[k]);
    }
    free(w->bytes);
    pthread_mutex_destroy(&w->mutex);
}

struct setting {
    struct group g;
    struct srnf_register_options registration;
    struct srnf_mean_options options;
    struct srnf_scratch scratch;
};

/* kind 0: in a common pose, 1: rotated, 2: rotations only. */
#define KINDS ((size_t)3)
static void open_setting(struct setting *s, size_t kind, struct world *w)
{
    *s = (struct setting){.scratch = {.user = w, .write = on_write, .read = on_read}};
    group_open_stars(&s->g, DEGREE, N, 0.3);
    s->registration = srnf_register_options_defaults();
    s->registration.degree = 3;
    s->registration.start = SRNF_START_RIGID;
    s->registration.common_pose = kind == 0;
    s->registration.reparameterization = kind != 2;
    s->options = srnf_mean_options_defaults();
    s->options.registration = &s->registration;
    s->options.tolerance = 1e-12;
    s->options.max_iterations = ITERATIONS;
}

static void lend(struct setting *s, size_t held)
{
    s->options.scratch = &s->scratch;
    s->options.held_bytes = held * PAGE;
}

static void assert_same(const struct group *g, const struct srnf_mean *a, const struct srnf_mean *b)
{
    assert_int_equal(a->iterations, b->iterations);
    assert_memory_equal(a->mean_q, b->mean_q, 3 * g->points * sizeof(double));
    assert_memory_equal(a->registered_q, b->registered_q, N * 3 * g->points * sizeof(double));
    assert_memory_equal(a->coefficients, b->coefficients, g->count * sizeof(double));
    assert_memory_equal(a->distances, b->distances, N * sizeof(double));
    for (size_t k = 0; k < a->iterations; k++) {
        assert_true(a->history[k].objective == b->history[k].objective);
    }
}

static void same_bits_in_scratch(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < KINDS; kind++) {
        struct group_watch watch;
        struct srnf_context threads = group_context(&watch, 3);
        struct setting s;
        struct world w;
        struct srnf_mean whole, spilled;

        open_world(&w);
        open_setting(&s, kind, &w);
        assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &whole, NULL) >=
                    0);
        for (size_t held = FIGURES_SLOW && kind != 1 ? 2 : 0; held < N; held += 2) {
            lend(&s, held);
            assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options,
                                          held ? &threads : NULL, &spilled, NULL) >= 0);
            assert_same(&s.g, &whole, &spilled);
            assert_true(atomic_load(&w.written) >= (kind == 2 ? 1 : (N - held) * PAGE));
            assert_true(atomic_load(&w.read) > 0);
            srnf_mean_clear(&spilled);
            atomic_store(&w.written, 0);
        }
        /* With room for all of them nothing is written. */
        if (!FIGURES_SLOW || kind == 0) {
            lend(&s, 100);
            assert_true(
                srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &spilled, NULL) >= 0);
            assert_int_equal(atomic_load(&w.written), 0);
            srnf_mean_clear(&spilled);
        }
        srnf_mean_clear(&whole);
        group_close(&s.g);
        close_world(&w);
    }
}

/* The scratch as it was when a checkpoint was told, or with all that came after: either will do. */
static void goes_on_from_any_iteration(void **state)
{
    struct setting s;
    struct world w;
    struct srnf_mean whole, resumed;

    (void)state;
    open_world(&w);
    open_setting(&s, 1, &w);
    lend(&s, 1);
    s.options.checkpoint = on_checkpoint;
    s.options.checkpoint_user = &w;
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &whole, NULL) >= 0);
    assert_int_equal(w.checkpoints, whole.iterations);
    s.options.checkpoint = NULL;
    for (size_t k = 0; k < w.checkpoints; k++) {
        assert_true(w.checkpoint_size[k] < PAGE * 3 / 4 + 4000); /* a mean, and no chain */
        for (int late = 0; late < 2; late++) {
            s.scratch.used = late ? w.end : w.end_at[k];
            memset(w.bytes, 0xa5, N * PAGE); /* points are not what is resumed from */
            s.options.resume = w.checkpoint[k];
            s.options.resume_size = w.checkpoint_size[k];
            assert_true(
                srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &resumed, NULL) >= 0);
            assert_same(&s.g, &whole, &resumed);
            srnf_mean_clear(&resumed);
        }
    }
    srnf_mean_clear(&whole);
    group_close(&s.g);
    close_world(&w);
}

static void goes_on_from_any_registration(void **state)
{
    struct srnf_context context = {.recall = on_recall, .keep = on_keep};
    struct setting s;
    struct world w;
    struct srnf_mean whole, resumed;

    (void)state;
    open_world(&w);
    context.user = &w;
    open_setting(&s, 1, &w);
    s.options.max_iterations = 1;
    lend(&s, 0);
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, &context, &whole, NULL) >=
                0);
    assert_int_equal(w.recalled, 0);
    w.part_size[1] = 0;                  /* one is missing */
    w.bytes[(size_t)w.parts[2][9]] ^= 1; /* one is damaged */
    s.scratch.used = w.end;
    context.keep = NULL;
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, &context, &resumed, NULL) >=
                0);
    assert_int_equal(w.recalled, N - 1);
    assert_same(&s.g, &whole, &resumed);
    srnf_mean_clear(&resumed);
    /* Without the scratch of then nothing is taken. */
    s.scratch.used = 0;
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, &context, &resumed, NULL) >=
                0);
    assert_same(&s.g, &whole, &resumed);
    srnf_mean_clear(&resumed);
    srnf_mean_clear(&whole);
    group_close(&s.g);
    close_world(&w);
}

/* What the bytes of a checkpoint name is not there, or is something else; or they are of a run
   without scratch. */
static void refuses_scratch_that_is_not_what_it_was(void **state)
{
    struct setting s;
    struct world w;
    struct srnf_mean mean;
    struct srnf_error error;

    (void)state;
    open_world(&w);
    open_setting(&s, 0, &w);
    lend(&s, 0);
    s.options.max_iterations = 1;
    s.options.checkpoint = on_checkpoint;
    s.options.checkpoint_user = &w;
    assert_true(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, NULL) >= 0);
    srnf_mean_clear(&mean);
    s.options.checkpoint = NULL;
    s.options.max_iterations = ITERATIONS;
    s.options.resume = w.checkpoint[0];
    s.options.resume_size = w.checkpoint_size[0];
    s.scratch.used = w.end - 8;
    assert_int_equal(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, &error),
                     SRNF_EINVAL);
    s.scratch.used = w.end;
    for (size_t at = N * PAGE; at < w.end; at += 997) {
        w.bytes[at] ^= 4;
        assert_int_equal(
            srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, &error),
            SRNF_EINVAL);
        assert_non_null(strstr(error.message, "resume"));
        w.bytes[at] ^= 4;
    }
    s.options.scratch = NULL;
    assert_int_equal(srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "elsewhere"));
    group_close(&s.g);
    close_world(&w);
}

/* Points of garbage could give a wrong mean in silence, or a search that does not end. */
static void points_that_changed_are_an_error(void **state)
{
    (void)state;
    for (size_t kind = 0; kind < 2; kind++) {
        struct setting s;
        struct world w;
        struct srnf_mean mean;
        struct srnf_error error;

        open_world(&w);
        w.spoils = true;
        open_setting(&s, kind, &w);
        lend(&s, 1);
        assert_int_equal(
            srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, &error), SRNF_EIO);
        assert_null(mean.mean_q);
        group_close(&s.g);
        close_world(&w);
    }
}

static void full_scratch_is_an_error(void **state)
{
    struct setting s;
    struct world w;
    struct srnf_mean mean;
    struct srnf_error error;

    (void)state;
    open_world(&w);
    open_setting(&s, 0, &w);
    lend(&s, 1);
    for (w.most = 0; w.most < N * PAGE; w.most += PAGE) {
        error = (struct srnf_error){0};
        assert_int_equal(
            srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &mean, &error), SRNF_EIO);
        assert_int_equal(error.status, SRNF_EIO);
        assert_null(mean.mean_q);
    }
    group_close(&s.g);
    close_world(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bits_in_scratch),
        cmocka_unit_test(goes_on_from_any_iteration),
        cmocka_unit_test(goes_on_from_any_registration),
        cmocka_unit_test(refuses_scratch_that_is_not_what_it_was),
        cmocka_unit_test(points_that_changed_are_an_error),
        cmocka_unit_test(full_scratch_is_an_error),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
