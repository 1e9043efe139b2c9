/*
 * test_mean_landmarks.c - landmarks of a group mean: they are met exactly, or the nearer the more
 * they weigh, and the objective never rises; those that are held out change nothing, and are the
 * better met the more others guide; those of the mean lie amid those of the subjects; a mean that
 * is resumed, spread over threads or has its warps in scratch has the same bits; what is wrong is
 * told by name.
 * srnfd-test: slow
 * srnfd-test: no-asan (test_stats_allocation.c and api/test_landmarks_mean.sh run its code)
 */
#include "group.h"

#include <fftw3.h>

#include "registration/landmarks.h"

#define DEGREE 7
#define N ((size_t)4)
#define M ((size_t)6)
#define EXACT 1e-8
#define ITERATIONS_MAX ((size_t)8)
#define assert_below(a, b) assert_true((a) < (b))
#define assert_above(a, b) assert_true((a) > (b))

struct setting {
    struct group g;
    struct srnf_register_options registration;
    struct srnf_mean_options options;
    struct srnf_group_landmarks landmarks;
    double points[GROUP_MAX * M * 3];
};

/* Landmark j of subject i: a spiral, each a little beside it. */
static void place(struct setting *s, double aside)
{
    struct test_random random = test_random_seed(17);

    for (size_t i = 0; i < N; i++) {
        for (size_t j = 0; j < M; j++) {
            double *p = s->points + 3 * (i * M + j);
            double z = 1.0 - (2.0 * (double)j + 1.0) / (double)M;
            double phi = 2.399963229728653 * (double)j, length;

            p[0] = sqrt(1.0 - z * z) * cos(phi);
            p[1] = sqrt(1.0 - z * z) * sin(phi);
            p[2] = z;
            for (size_t c = 0; c < 3; c++) {
                p[c] += aside * test_random_normal(&random);
            }
            length = sqrt(vector_dot(p, p));
            for (size_t c = 0; c < 3; c++) {
                p[c] /= length;
            }
        }
    }
}

static void open_setting(struct setting *s, size_t guiding, double weight)
{
    *s = (struct setting){.landmarks = {M, guiding, NULL, weight}};
    group_open_stars(&s->g, DEGREE, N, 0.3);
    place(s, 0.06);
    s->landmarks.points = s->points;
    s->registration = srnf_register_options_defaults();
    s->registration.degree = 6;
    s->registration.start = SRNF_START_RIGID;
    s->options = srnf_mean_options_defaults();
    s->options.registration = &s->registration;
    s->options.landmarks = &s->landmarks;
    s->options.max_iterations = 6;
}

static void run(struct setting *s, const struct srnf_context *context, struct srnf_mean *mean)
{
    struct srnf_error error = {0};
    int status = srnf_karcher_mean(s->g.sht, N, s->g.surfaces, &s->options, context, mean, &error);

    if (status < 0) {
        fail_msg("mean: %s, %s", srnf_strerror(status), error.message);
    }
}

/* Root of the mean square of what is left of landmarks from first to last, and the most of it. */
static double left(const struct setting *s, const struct srnf_mean *mean, size_t first, size_t last,
                   double *most)
{
    double sum = 0.0;

    *most = 0.0;
    for (size_t i = 0; i < N; i++) {
        for (size_t j = first; j < last; j++) {
            double angle = landmarks_angle(mean->landmark_points + 3 * (i * M + j),
                                           s->points + 3 * (i * M + j));

            sum += angle * angle / (double)(N * (last - first));
            *most = compare_max(*most, angle);
        }
    }
    return sqrt(sum);
}

static void assert_falling(const struct srnf_mean *mean)
{
    for (size_t k = 1; k < mean->iterations; k++) {
        assert_true(mean->history[k].objective <= mean->history[k - 1].objective * (1.0 + 1e-12));
    }
}

static void meets_them_exactly(void **state)
{
    (void)state;
    for (int pose = 0; pose < 2; pose++) {
        struct setting s;
        struct srnf_mean mean;
        double most;

        open_setting(&s, M, INFINITY);
        s.registration.common_pose = pose == 1;
        run(&s, NULL, &mean);
        (void)left(&s, &mean, 0, M, &most);
        printf("# pose %d: %zu iterations, %.2g left, objective %.5f to %.5f\n", pose,
               mean.iterations, most, mean.history[0].objective,
               mean.history[mean.iterations - 1].objective);
        assert_true(mean.n_landmarks == M);
        assert_below(most, EXACT);
        assert_falling(&mean);
        assert_below(mean.history[mean.iterations - 1].objective, mean.history[0].objective);
        srnf_mean_clear(&mean);
        group_close(&s.g);
    }
}

/* Less is left the more they weigh, and more of the distance. */
static void weighs_them(void **state)
{
    static const double weights[] = {1e-9, 0.1, 3.0, INFINITY};
    double before = INFINITY, first = 0.0, variance = 0.0;
    (void)state;

    for (size_t k = 0; k < 4; k++) {
        struct setting s;
        struct srnf_mean mean;
        double most, root;

        open_setting(&s, M, weights[k]);
        run(&s, NULL, &mean);
        root = left(&s, &mean, 0, M, &most);
        variance = mean.history[mean.iterations - 1].variance;
        printf("# weight %g: %.4g left, variance %.5f\n", weights[k], root, variance);
        assert_below(root, before);
        assert_falling(&mean);
        before = root;
        first = k == 0 ? variance : first;
        srnf_mean_clear(&mean);
        group_close(&s.g);
    }
    assert_above(variance, first);
}

/* All held out: the mean without, bit for bit; the fewer are, the better they are met. */
static void held_out(void **state)
{
    struct setting s;
    struct srnf_mean plain, free, guided;
    double most, root_free, root_guided;
    (void)state;

    open_setting(&s, 0, 1.0);
    place(&s, 0.0); /* stars about one centre: their directions correspond */
    run(&s, NULL, &free);
    s.options.landmarks = NULL;
    run(&s, NULL, &plain);
    assert_null(plain.landmarks);
    assert_true(plain.n_landmarks == 0);
    assert_memory_equal(plain.mean_q, free.mean_q, 3 * s.g.points * sizeof(double));
    assert_memory_equal(plain.registered_q, free.registered_q, N * 3 * s.g.points * sizeof(double));
    s.options.landmarks = &s.landmarks;
    s.landmarks.guiding = M - 2;
    s.landmarks.weight = INFINITY;
    run(&s, NULL, &guided);
    root_free = left(&s, &free, M - 2, M, &most);
    root_guided = left(&s, &guided, M - 2, M, &most);
    printf("# the last two: %.4f left, guided by the others %.4f\n", root_free, root_guided);
    assert_above(root_free, 1e-3);
    assert_below(root_guided, root_free);
    (void)left(&s, &guided, 0, M - 2, &most);
    assert_below(most, EXACT);
    srnf_mean_clear(&plain);
    srnf_mean_clear(&free);
    srnf_mean_clear(&guided);
    group_close(&s.g);
}

/* Nothing registered: the mean's are the Karcher means of points of one sphere, where the
   logarithms cancel. */
static void lie_amid_those_of_the_subjects(void **state)
{
    struct setting s;
    struct srnf_mean mean;
    (void)state;

    open_setting(&s, 0, 1.0);
    place(&s, 0.3);
    s.options.registration = NULL;
    run(&s, NULL, &mean);
    for (size_t j = 0; j < M; j++) {
        const double *a = mean.landmarks + 3 * j;
        double t1[3], t2[3], sum[2] = {0.0, 0.0};

        landmarks_frame(a, t1, t2);
        for (size_t i = 0; i < N; i++) {
            double r[2];

            assert_below(landmarks_angle(a, mean.landmark_points + 3 * (i * M + j)), 1e-12);
            landmarks_logarithm(a, s.points + 3 * (i * M + j), t1, t2, r);
            sum[0] += r[0];
            sum[1] += r[1];
        }
        assert_below(sqrt(sum[0] * sum[0] + sum[1] * sum[1]), 1e-7);
    }
    srnf_mean_clear(&mean);
    group_close(&s.g);
}

/* ---- The same bits --------------------------------------------------------------------------- */

struct keeper {
    unsigned char *bytes[ITERATIONS_MAX];
    size_t size[ITERATIONS_MAX], count;
};

static void keep(void *user, const void *bytes, size_t size)
{
    struct keeper *keeper = user;

    assert_true(keeper->count < ITERATIONS_MAX);
    keeper->bytes[keeper->count] = malloc(size);
    assert_non_null(keeper->bytes[keeper->count]);
    memcpy(keeper->bytes[keeper->count], bytes, size);
    keeper->size[keeper->count++] = size;
}

static void assert_same(const struct setting *s, const struct srnf_mean *a,
                        const struct srnf_mean *b)
{
    assert_true(a->iterations == b->iterations);
    assert_memory_equal(a->mean_q, b->mean_q, 3 * s->g.points * sizeof(double));
    assert_memory_equal(a->landmarks, b->landmarks, 3 * M * sizeof(double));
    assert_memory_equal(a->landmark_points, b->landmark_points, 3 * N * M * sizeof(double));
    for (size_t k = 0; k < a->iterations; k++) {
        assert_true(a->history[k].objective == b->history[k].objective);
    }
}

static void the_same_resumed(void **state)
{
    static const double weights[] = {1.0, INFINITY};
    (void)state;

    for (size_t kind = 0; kind < 2; kind++) {
        struct keeper keeper = {.count = 0};
        struct setting s;
        struct srnf_mean whole, resumed;
        struct srnf_error error = {0};
        size_t count;

        open_setting(&s, M - 2, weights[kind]);
        s.options.tolerance = 1e-12;
        s.options.max_iterations = 3;
        s.options.checkpoint = keep;
        s.options.checkpoint_user = &keeper;
        run(&s, NULL, &whole);
        count = keeper.count;
        s.options.checkpoint = NULL;
        for (size_t k = 0; k < count; k++) {
            s.options.resume = keeper.bytes[k];
            s.options.resume_size = keeper.size[k];
            run(&s, NULL, &resumed);
            assert_same(&s, &whole, &resumed);
            srnf_mean_clear(&resumed);
        }
        /* Of other landmarks they are not the bytes. */
        s.points[0] = -s.points[0];
        assert_int_equal(
            srnf_karcher_mean(s.g.sht, N, s.g.surfaces, &s.options, NULL, &resumed, &error),
            SRNF_EINVAL);
        assert_non_null(strstr(error.message, "resume"));
        for (size_t k = 0; k < count; k++) {
            free(keeper.bytes[k]);
        }
        srnf_mean_clear(&whole);
        group_close(&s.g);
    }
}

static int decline(void *user, const struct srnf_field_search *search, struct srnf_error *error)
{
    (void)user;
    (void)search;
    (void)error;
    return SRNF_SEARCH_HERE;
}

/* On any number of threads, and where others are asked but there are none (with others:
   test_elsewhere.c). */
static void the_same_in_parallel(void **state)
{
    struct setting s;
    struct srnf_mean alone, spread;
    struct group_watch watch = {0};
    struct srnf_context context = group_context(&watch, 3);
    (void)state;

    open_setting(&s, M - 2, 1.0);
    s.options.max_iterations = 2;
    run(&s, NULL, &alone);
    context.search = decline;
    run(&s, &context, &spread);
    assert_same(&s, &alone, &spread);
    srnf_mean_clear(&alone);
    srnf_mean_clear(&spread);
    group_close(&s.g);
}

/* Scratch in memory. */
static int on_write(void *user, uint64_t offset, const void *bytes, size_t size)
{
    memcpy((char *)user + offset, bytes, size);
    return SRNF_OK;
}

static int on_read(void *user, uint64_t offset, void *bytes, size_t size)
{
    memcpy(bytes, (const char *)user + offset, size);
    return SRNF_OK;
}

static void the_same_in_scratch(void **state)
{
    struct srnf_scratch scratch = {calloc(1, (size_t)16 << 20), on_write, on_read, 0};
    struct setting s;
    struct srnf_mean here, there;
    (void)state;

    assert_non_null(scratch.user);
    open_setting(&s, M - 2, 1.0);
    s.options.max_iterations = 2;
    run(&s, NULL, &here);
    s.options.scratch = &scratch;
    s.options.held_bytes = 1;
    run(&s, NULL, &there);
    assert_same(&s, &here, &there);
    srnf_mean_clear(&here);
    srnf_mean_clear(&there);
    group_close(&s.g);
    free(scratch.user);
}

/* ---- What is wrong --------------------------------------------------------------------------- */

static void assert_refused(struct setting *s, int status, int64_t element, const char *text)
{
    struct srnf_error error = {0};
    struct srnf_mean mean;

    assert_int_equal(
        srnf_karcher_mean(s->g.sht, N, s->g.surfaces, &s->options, NULL, &mean, &error), status);
    assert_null(mean.mean_q);
    assert_true(error.element == element);
    if (!strstr(error.message, text)) {
        fail_msg("\"%s\" has no \"%s\"", error.message, text);
    }
}

static void refuses(void **state)
{
    struct setting s;
    double kept[3];
    (void)state;

    open_setting(&s, M, INFINITY);
    s.landmarks.guiding = M + 1;
    assert_refused(&s, SRNF_EINVAL, -1, "landmarks");
    s.landmarks = (struct srnf_group_landmarks){M, M, s.points, 0.0};
    assert_refused(&s, SRNF_EINVAL, 0, "weight");
    s.landmarks.weight = INFINITY;
    memcpy(kept, s.points + 3 * M, sizeof kept);
    s.points[3 * M] += 0.1;
    assert_refused(&s, SRNF_EINVAL, 1, "landmark 0 of surface 1 is no unit vector");
    memcpy(s.points + 3 * M, s.points + 3 * (M + 2), sizeof kept);
    assert_refused(&s, SRNF_EINVAL, 1, "landmarks 0 and 2");
    s.landmarks.guiding = 0; /* held out, they may coincide */
    s.options.max_iterations = 1;
    {
        struct srnf_mean mean;

        run(&s, NULL, &mean);
        srnf_mean_clear(&mean);
    }
    s.landmarks.guiding = M;
    memcpy(s.points + 3 * M, kept, sizeof kept);
    s.registration.exact = true;
    assert_refused(&s, SRNF_EINVAL, -1, "guide");
    s.registration.exact = false;
    s.registration.reparameterization = false;
    assert_refused(&s, SRNF_EINVAL, -1, "guide");
    s.options.registration = NULL;
    assert_refused(&s, SRNF_EINVAL, -1, "guide");
    group_close(&s.g);
}

/* Two landmarks in each other's place, amid others that are where they were. */
static void names_whose_are_not_met(void **state)
{
    struct setting s;
    double kept[3];
    (void)state;

    open_setting(&s, M, INFINITY);
    place(&s, 0.0);
    for (size_t j = 0; j < M; j += 2) { /* of the last subject, who is not the medoid */
        double *p = s.points + 3 * ((N - 1) * M + j);

        memcpy(kept, p, sizeof kept);
        memcpy(p, p + 3, sizeof kept);
        memcpy(p + 3, kept, sizeof kept);
    }
    s.registration.degree = 4;
    s.registration.common_pose = true;
    for (size_t j = 0; j < M; j++) { /* and amid all is where the others are */
        memcpy(s.points + 3 * j, s.points + 3 * (M + j), sizeof kept);
    }
    assert_refused(&s, SRNF_EUNMATCHED, (int64_t)N - 1, "was not met");
    group_close(&s.g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meets_them_exactly),
        cmocka_unit_test(weighs_them),
        cmocka_unit_test(held_out),
        cmocka_unit_test(lie_amid_those_of_the_subjects),
        cmocka_unit_test(the_same_resumed),
        cmocka_unit_test(the_same_in_parallel),
        cmocka_unit_test(the_same_in_scratch),
        cmocka_unit_test(refuses),
        cmocka_unit_test(names_whose_are_not_met),
    };

    openblas_set_num_threads(1);
    fftw_make_planner_thread_safe();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
