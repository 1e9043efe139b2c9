/*
 * Tasks of kind "searches": what they find has the bits of srnf_register_to_field, however the
 * surfaces are cut into tasks; what is no such task, content or result is refused; a task that is
 * told to stop yields nothing.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "support/random.h"
#include "support/shapes.h"
#include "tasks/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE ((size_t)4)
#define N ((size_t)3)
#define M ((size_t)24) /* landmarks */
#define COUNT ((size_t)(3 * (DEGREE + 1) * (DEGREE + 1)))

struct world {
    struct shapes_surface field; /* whose SRNF is the field */
    double surfaces[N][COUNT];
    unsigned char bytes[N][8 * COUNT], *field_bytes;
    struct tasks_content contents[1 + N];
    struct tasks_searches asked;
    const struct tasks_kind *kind;
};

static int setup(void **state)
{
    struct world *world = calloc(1, sizeof *world);
    size_t size;

    world->kind = tasks_kind_find(TASKS_SEARCHES);
    shapes_open(&world->field, DEGREE);
    shapes_fill(&world->field, shapes_ellipsoid, 1.7);
    size = 3 * world->field.points;
    world->field_bytes = malloc(8 * size);
    tasks_put_doubles(world->field_bytes, world->field.q, size);
    world->contents[0] = (struct tasks_content){.bytes = world->field_bytes, .size = 8 * size};
    world->asked = (struct tasks_searches){.degree = DEGREE,
                                           .n_theta = world->field.grid->n_theta,
                                           .n_phi = world->field.grid->n_phi,
                                           .norm2 = 1.25,
                                           .registration = srnf_register_options_defaults(),
                                           .n = N};
    world->asked.registration.degree = 3;
    world->asked.registration.max_steps = 3;
    world->asked.registration.start = SRNF_START_RIGID;
    for (size_t i = 0; i < N; i++) {
        struct shapes_surface s;

        shapes_open(&s, DEGREE);
        shapes_fill_random_star(&s, 7 + i, NULL);
        memcpy(world->surfaces[i], s.f, sizeof world->surfaces[i]);
        shapes_close(&s);
        tasks_put_doubles(world->bytes[i], world->surfaces[i], COUNT);
        world->contents[1 + i] =
            (struct tasks_content){.bytes = world->bytes[i], .size = sizeof world->bytes[i]};
    }
    *state = world;
    return 0;
}

static int teardown(void **state)
{
    struct world *world = *state;

    shapes_close(&world->field);
    free(world->field_bytes);
    free(world);
    return 0;
}

static struct tasks_bytes run(const struct world *world, const struct tasks_searches *asked,
                              const struct tasks_content *contents)
{
    struct tasks_bytes inputs, result;

    assert_int_equal(tasks_searches_write(asked, &inputs), SRNF_OK);
    assert_int_equal(
        world->kind->run(inputs.bytes, inputs.size, contents, 1 + asked->n, NULL, &result, NULL),
        SRNF_OK);
    assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(inputs.bytes);
    return result;
}

/* What all surfaces have, computed once: the world is the same for each test. */
static struct tasks_bytes all_found(const struct world *world)
{
    static struct tasks_bytes found;
    struct tasks_bytes copy;

    if (!found.bytes) {
        found = run(world, &world->asked, world->contents);
    }
    copy = (struct tasks_bytes){malloc(found.size), found.size};
    assert_non_null(copy.bytes);
    memcpy(copy.bytes, found.bytes, found.size);
    return copy;
}

struct found {
    const struct world *world;
    size_t first, count;
};

static int compare(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    struct found *found = argument;
    const struct world *world = found->world;
    struct srnf_warp expected;
    double turned[9];

    assert_int_equal(srnf_register_to_field(world->field.sht, world->field.q, world->asked.norm2,
                                            world->surfaces[found->first + i],
                                            &world->asked.registration, NULL, turned, &expected,
                                            NULL),
                     SRNF_OK);
    assert_memory_equal(rotation, turned, sizeof turned);
    assert_int_equal(warp->n_links, expected.n_links);
    assert_true(warp->n_links > 1);
    for (size_t k = 0; k < warp->n_links; k++) {
        const struct srnf_warp_link *a = &warp->links[k], *b = &expected.links[k];
        size_t count = a->kind == SRNF_WARP_ROTATION ? 9 : 2 * srnf_coefficient_count(a->degree);

        assert_int_equal(a->kind, b->kind);
        assert_true(a->kind == SRNF_WARP_ROTATION || a->degree == b->degree);
        assert_memory_equal(a->values, b->values, count * sizeof(double));
    }
    srnf_warp_clear(&expected);
    found->count++;
    return SRNF_OK;
}

static void bits_are_those_of_the_search(void **state)
{
    struct world *world = *state;
    struct found all = {.world = world}, last = {.world = world, .first = N - 1};
    struct tasks_bytes result = all_found(world);
    struct tasks_searches one = world->asked;
    struct tasks_content contents[2] = {world->contents[0], world->contents[N]};

    assert_int_equal(tasks_searches_read(result.bytes, result.size, N, compare, NULL, &all),
                     SRNF_OK);
    assert_int_equal(all.count, N);
    free(result.bytes);
    one.n = 1;
    result = run(world, &one, contents);
    assert_int_equal(tasks_searches_read(result.bytes, result.size, 1, compare, NULL, &last),
                     SRNF_OK);
    assert_int_equal(last.count, 1);
    free(result.bytes);
}

static void refuses(const struct world *world, const struct tasks_bytes *inputs, size_t size,
                    size_t n_contents)
{
    struct tasks_bytes result;

    assert_int_equal(
        world->kind->run(inputs->bytes, size, world->contents, n_contents, NULL, &result, NULL),
        SRNF_EINVAL);
    assert_null(result.bytes);
    assert_false(n_contents == 1 + N && world->kind->check(inputs->bytes, size, "", 0));
}

/* What landmarks find; fails: how many could not meet theirs. */
struct guided {
    const struct world *world;
    const struct tasks_searches *asked;
    size_t taken, failed;
};

static struct srnf_landmarks landmarks_of(const struct guided *guided, size_t i)
{
    const struct tasks_searches *asked = guided->asked;

    return (struct srnf_landmarks){asked->n_landmarks, asked->fixed,
                                   asked->moving + 3 * i * asked->n_landmarks, asked->weight};
}

static int search_here(const struct guided *guided, size_t i, double rotation[9],
                       struct srnf_warp *warp, struct srnf_error *why)
{
    const struct world *world = guided->world;
    const struct srnf_landmarks landmarks = landmarks_of(guided, i);

    return srnf_register_to_field_landmarks(world->field.sht, world->field.q, world->asked.norm2,
                                            world->surfaces[i], &world->asked.registration,
                                            &landmarks, NULL, rotation, warp, why);
}

static int compare_guided(void *argument, size_t i, const double rotation[9],
                          struct srnf_warp *warp)
{
    struct guided *guided = argument;
    struct srnf_warp expected;
    double turned[9];

    assert_int_equal(search_here(guided, i, turned, &expected, NULL), SRNF_OK);
    assert_memory_equal(rotation, turned, sizeof turned);
    assert_int_equal(warp->n_links, expected.n_links);
    for (size_t k = 0; k < warp->n_links; k++) {
        const struct srnf_warp_link *a = &warp->links[k], *b = &expected.links[k];
        size_t count = a->kind == SRNF_WARP_ROTATION ? 9 : 2 * srnf_coefficient_count(a->degree);

        assert_memory_equal(a->values, b->values, count * sizeof(double));
    }
    srnf_warp_clear(&expected);
    guided->taken++;
    return SRNF_OK;
}

static int compare_failed(void *argument, size_t i, const struct srnf_error *why)
{
    struct guided *guided = argument;
    struct srnf_error expected;
    struct srnf_warp warp;
    double turned[9];

    assert_int_equal(search_here(guided, i, turned, &warp, &expected), SRNF_EUNMATCHED);
    assert_int_equal(why->status, SRNF_EUNMATCHED);
    assert_int_equal(why->element, expected.element);
    assert_string_equal(why->message, expected.message);
    guided->failed++;
    return SRNF_OK;
}

/* The sentence of a failure goes into answers: it is one, or the bytes are no result. */
static void expect_sentence(const struct world *world, const struct tasks_bytes *inputs,
                            const struct tasks_bytes *result)
{
    for (size_t at = 0; at + 32 < result->size; at += 8) {
        unsigned char *sentence = result->bytes + at + 16;

        if (tasks_get(result->bytes + at) == UINT64_MAX) {
            sentence[3] ^= 0x80;
            assert_false(
                world->kind->check(inputs->bytes, inputs->size, result->bytes, result->size));
            sentence[3] ^= 0x80;
            assert_true(
                world->kind->check(inputs->bytes, inputs->size, result->bytes, result->size));
        }
    }
}

/* Points that correspond, but for those of the second surface, which no warp meets; of weight they
   are no failure. */
static void landmarks_guide(void **state)
{
    struct world *world = *state;
    double fixed[M][3], moving[N][M][3];
    unsigned char none[8];

    for (size_t j = 0; j < M; j++) { /* a spiral */
        double z = 1.0 - (2.0 * (double)j + 1.0) / (double)M, phi = 2.399963229728653 * (double)j;

        fixed[j][0] = sqrt(1.0 - z * z) * cos(phi);
        fixed[j][1] = sqrt(1.0 - z * z) * sin(phi);
        fixed[j][2] = z;
    }
    for (size_t i = 0; i < N; i++) {
        memcpy(moving[i], fixed, sizeof fixed);
    }
    for (size_t j = 0; j < M; j++) { /* mirrored */
        moving[1][j][0] = -fixed[j][0];
    }
    world->asked.registration.degree = 6;
    for (int exact = 0; exact < 2; exact++) {
        struct tasks_searches asked = world->asked;
        struct guided guided = {.world = world, .asked = &asked};
        struct tasks_bytes result, inputs;

        asked.n_landmarks = M;
        asked.weight = exact ? INFINITY : 0.5;
        asked.fixed = fixed[0];
        asked.moving = moving[0][0];
        result = run(world, &asked, world->contents);
        assert_int_equal(tasks_searches_read(result.bytes, result.size, N, compare_guided,
                                             compare_failed, &guided),
                         SRNF_OK);
        assert_int_equal(guided.failed, exact);
        assert_int_equal(guided.taken, N - guided.failed);
        /* Without landmarks there are no failures, and no result is cut. */
        assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_OK);
        assert_int_equal(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size),
                         !exact);
        free(inputs.bytes);
        assert_int_equal(tasks_searches_write(&asked, &inputs), SRNF_OK);
        for (size_t size = 0; size < inputs.size; size += 8) {
            refuses(world, &(struct tasks_bytes){inputs.bytes, size}, size, 1 + N);
        }
        for (size_t size = 0; size < result.size; size += 4) {
            assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, size));
        }
        expect_sentence(world, &inputs, &result);
        memset(none, 0xff, sizeof none); /* a point that is no number */
        memcpy(inputs.bytes + inputs.size - 8, none, sizeof none);
        refuses(world, &inputs, inputs.size, 1 + N);
        free(inputs.bytes);
        free(result.bytes);
    }
}

static void tasks_of_many_landmarks_are_small(void **state)
{
    struct world *world = *state;
    struct tasks_searches asked = world->asked;
    struct tasks_bytes inputs;
    double *points = calloc(3 * SRNF_LANDMARKS_MAX * TASKS_CONTENTS_MAX, sizeof *points);

    asked.n_landmarks = SRNF_LANDMARKS_MAX;
    asked.weight = 1.0;
    asked.fixed = asked.moving = points;
    asked.n = tasks_searches_most(SRNF_LANDMARKS_MAX);
    assert_true(asked.n > 10);
    assert_int_equal(tasks_searches_write(&asked, &inputs), SRNF_OK);
    assert_true(inputs.size <= TASKS_INPUTS_MAX);
    free(inputs.bytes);
    asked.n++;
    assert_int_equal(tasks_searches_write(&asked, &inputs), SRNF_ELIMIT);
    asked.n = 1;
    asked.n_landmarks++;
    assert_int_equal(tasks_searches_write(&asked, &inputs), SRNF_ELIMIT);
    assert_int_equal(tasks_searches_most(0), TASKS_CONTENTS_MAX - 1);
    free(points);
}

static int fail_second(void *argument, size_t i, const double rotation[9], struct srnf_warp *warp)
{
    (void)rotation;
    (void)warp;
    ++*(size_t *)argument;
    return i == 1 ? SRNF_ENOMEM : SRNF_OK;
}

static void who_takes_may_fail(void **state)
{
    struct world *world = *state;
    struct tasks_bytes result = all_found(world);
    size_t taken = 0;

    assert_int_equal(tasks_searches_read(result.bytes, result.size, N, fail_second, NULL, &taken),
                     SRNF_ENOMEM);
    assert_int_equal(taken, 2);
    free(result.bytes);
}

static void what_is_no_task_is_refused(void **state)
{
    struct world *world = *state;
    struct tasks_bytes inputs;
    double none = (double)NAN;

    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_OK);
    for (size_t size = 0; size < inputs.size; size++) {
        refuses(world, &inputs, size, 1 + N);
    }
    refuses(world, &inputs, inputs.size, N);
    for (size_t i = 0; i < 1 + N; i++) {
        world->contents[i].size -= 8;
        refuses(world, &inputs, inputs.size, 1 + N);
        world->contents[i].size += 8;
    }
    tasks_put_doubles(world->bytes[1] + 16, &none, 1);
    refuses(world, &inputs, inputs.size, 1 + N);
    tasks_put_doubles(world->bytes[1] + 16, &world->surfaces[1][2], 1);
    /* Each byte of the head and the options of another kind of number. */
    for (size_t at = 0; at < inputs.size; at += 8) {
        unsigned char kept[8];

        memcpy(kept, inputs.bytes + at, 8);
        memset(inputs.bytes + at, 0xff, 8); /* no double either, and no count */
        if (at + 8 < inputs.size) {         /* maxSteps may be anything */
            refuses(world, &inputs, inputs.size, 1 + N);
        }
        memcpy(inputs.bytes + at, kept, 8);
    }
    free(inputs.bytes);
    world->asked.n = 0;
    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_ELIMIT);
    world->asked.n = TASKS_CONTENTS_MAX;
    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_ELIMIT);
}

static void what_is_no_result_is_told(void **state)
{
    struct world *world = *state;
    struct tasks_bytes result = all_found(world), inputs;
    double none = (double)NAN;

    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_OK);
    for (size_t size = 0; size < result.size; size += size < 300 ? 1 : 97) {
        assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, size));
    }
    tasks_put(result.bytes, UINT64_MAX); /* links */
    assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(result.bytes);
    result = all_found(world);
    tasks_put_doubles(result.bytes + 8, &none, 1);
    assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(result.bytes);
    result = all_found(world);
    tasks_put(result.bytes + 80, SRNF_WARP_SERIES); /* no link of a search */
    assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(result.bytes);
    free(inputs.bytes);
}

static bool stops(void *user)
{
    (void)user;
    return true;
}

/* As a worker returns that computes wrong, or makes numbers up: finite, and no rotation. */
static void what_is_no_rotation_is_told(void **state)
{
    static const double bad[][9] = {{2, 0, 0, 0, 2, 0, 0, 0, 2},
                                    {-1, 0, 0, 0, 1, 0, 0, 0, 1},
                                    {1, 1e-3, 0, 0, 1, 0, 0, 0, 1},
                                    {0}};
    struct world *world = *state;
    struct tasks_bytes inputs, result = all_found(world);
    unsigned char *places[] = {result.bytes + 8, result.bytes + 96}; /* O; that of the first link */

    assert_int_equal(tasks_get(result.bytes + 80), SRNF_WARP_ROTATION);
    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_OK);
    for (size_t p = 0; p < sizeof places / sizeof places[0]; p++) {
        unsigned char kept[72];

        memcpy(kept, places[p], sizeof kept);
        for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
            tasks_put_doubles(places[p], bad[k], 9);
            assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
        }
        memcpy(places[p], kept, sizeof kept);
    }
    assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(inputs.bytes);
    free(result.bytes);
}

/* Numbers that are finite, and of which no computation could go on. */
static void what_no_search_finds_is_told(void **state)
{
    struct world *world = *state;
    struct tasks_bytes inputs, result = all_found(world);
    size_t links = (size_t)tasks_get(result.bytes), at = 80;
    double value;

    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_OK);
    assert_true(world->kind->possible(inputs.bytes, inputs.size, world->contents, 1 + N,
                                      result.bytes, result.size));
    assert_true(links > 1);
    while (tasks_get(result.bytes + at) != SRNF_WARP_EXP) {
        at += 16 + 8 * 9;
    }
    for (size_t k = 1; k < 5; k++) {
        value = 1000.0 * tasks_get_double(result.bytes + at + 16 + 8 * k);
        tasks_put_doubles(result.bytes + at + 16 + 8 * k, &value, 1);
    }
    assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    assert_false(world->kind->possible(inputs.bytes, inputs.size, world->contents, 1 + N,
                                       result.bytes, result.size));
    value = 1e300;
    tasks_put_doubles(result.bytes + at + 24, &value, 1);
    assert_false(world->kind->possible(inputs.bytes, inputs.size, world->contents, 1 + N,
                                       result.bytes, result.size));
    assert_false(world->kind->possible(inputs.bytes, inputs.size, world->contents, N, result.bytes,
                                       result.size));
    free(inputs.bytes);
    free(result.bytes);
}

static void a_task_that_is_stopped_yields_nothing(void **state)
{
    const struct world *world = *state;
    const struct srnf_context context = {.canceled = stops};
    struct tasks_bytes inputs, result;

    assert_int_equal(tasks_searches_write(&world->asked, &inputs), SRNF_OK);
    assert_int_equal(world->kind->run(inputs.bytes, inputs.size, world->contents, 1 + N, &context,
                                      &result, NULL),
                     SRNF_ECANCELED);
    assert_null(result.bytes);
    free(inputs.bytes);
}

/* Each option is another number, so that one that were not written, or in another's place, would
   come back as what it is not. */
static void options_come_back(void **state)
{
    struct srnf_register_options all[2], back;
    unsigned char bytes[TASKS_OPTIONS_SIZE];

    (void)state;
    for (size_t k = 0; k < 8; k++) {
        struct srnf_register_options options = {
            .representation = k == 0 ? SRNF_REPRESENTATION_SRM : SRNF_REPRESENTATION_SRNF,
            .rotation = k == 1,
            .reparameterization = k == 2,
            .degree = 17,
            .penalty_jacobian = 0.25,
            .penalty_displacement = 0.75,
            .start = k == 3 ? SRNF_START_IDENTITY : SRNF_START_RIGID,
            .common_pose = k == 4,
            .symmetric = k == 5,
            .exact = k == 6,
            .max_steps = 99};

        memset(&back, 0, sizeof back);
        tasks_put_options(bytes, &options);
        assert_true(tasks_get_options(bytes, &back));
        assert_int_equal(back.representation, options.representation);
        assert_true(back.rotation == options.rotation &&
                    back.reparameterization == options.reparameterization &&
                    back.common_pose == options.common_pose &&
                    back.symmetric == options.symmetric && back.exact == options.exact);
        assert_int_equal(back.degree, 17);
        assert_int_equal(back.start, options.start);
        assert_int_equal(back.max_steps, 99);
        assert_true(back.penalty_jacobian == 0.25 && back.penalty_displacement == 0.75);
        all[k % 2] = back;
        assert_true(k == 0 || memcmp(&all[0], &all[1], sizeof back) != 0);
    }
    for (size_t i = 0; i < TASKS_OPTIONS_SIZE; i += 8) {
        unsigned char kept[8];

        memcpy(kept, bytes + i, 8);
        memset(bytes + i, 0xee, 8);
        assert_true(tasks_get_options(bytes, &back) ==
                    (i == 40 || i == 48 || i == TASKS_OPTIONS_SIZE - 8));
        memcpy(bytes + i, kept, 8);
    }
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(bits_are_those_of_the_search),
        TEST(landmarks_guide),
        TEST(tasks_of_many_landmarks_are_small),
        TEST(who_takes_may_fail),
        TEST(what_is_no_task_is_refused),
        TEST(what_is_no_result_is_told),
        TEST(what_is_no_rotation_is_told),
        TEST(what_no_search_finds_is_told),
        TEST(options_come_back),
        TEST(a_task_that_is_stopped_yields_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
