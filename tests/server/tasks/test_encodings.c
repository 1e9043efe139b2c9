/*
 * Tasks of kind "encodings": surfaces have the bits of srnf_encode, with every figure of theirs;
 * that a mesh cannot be encoded is a result; what is no such task, content or result is refused.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "support/bodies.h"
#include "tasks/internal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FIGURES (8 * (size_t)27) /* bytes before the sentence of a surface */
#define SENTENCE ((size_t)240)
#define N ((size_t)3) /* by area, by star, and one that cannot be: by a centre outside */

struct world {
    struct srnf_mesh meshes[N];
    struct srnf_mesh_report reports[N];
    struct tasks_encoding asked[N];
    unsigned char *bytes[N];
    struct tasks_content contents[N];
    const struct tasks_kind *kind;
};

static int setup(void **state)
{
    struct world *world = calloc(1, sizeof *world);

    world->kind = tasks_kind_find(TASKS_ENCODINGS);
    for (size_t i = 0; i < N; i++) {
        struct tasks_encoding *asked = &world->asked[i];

        world->meshes[i] = bodies_ventricle(i);
        assert_int_equal(srnf_mesh_prepare(&world->meshes[i], true, &world->reports[i]), SRNF_OK);
        asked->options = srnf_encode_options_defaults();
        asked->options.degree = 5 + i;
        asked->options.parameterization =
            i == 0 ? SRNF_PARAMETERIZATION_AREA : SRNF_PARAMETERIZATION_STAR;
        asked->options.smoothing = i == 1 ? 0.001 : 0.0;
        asked->options.unit_area = i != 1;
        if (i == 1) {
            assert_int_equal(srnf_star_kernel(&world->meshes[i], &asked->kernel), SRNF_OK);
            asked->kernel_known = true;
        } else if (i == 2) {
            asked->options.center_given = true;
            asked->options.center[1] = 1e6;
        }
        asked->volume = world->reports[i].volume;
        asked->area = world->reports[i].area;
        memcpy(asked->centroid, world->reports[i].centroid, sizeof asked->centroid);
        asked->n_vertices[0] = world->meshes[i].n_vertices;
        asked->n_faces[0] = world->meshes[i].n_faces;
        world->bytes[i] = malloc(tasks_mesh_size(&world->meshes[i]));
        tasks_put_mesh(world->bytes[i], &world->meshes[i]);
        world->contents[i] = (struct tasks_content){.bytes = world->bytes[i],
                                                    .size = tasks_mesh_size(&world->meshes[i])};
    }
    *state = world;
    return 0;
}

static int teardown(void **state)
{
    struct world *world = *state;

    for (size_t i = 0; i < N; i++) {
        srnf_mesh_clear(&world->meshes[i]);
        free(world->bytes[i]);
    }
    free(world);
    return 0;
}

/* The encoding as it is made without a task. */
static int encode(const struct world *world, size_t i, struct srnf_encoded *encoded,
                  struct srnf_error *error)
{
    struct srnf_encode_options options = world->asked[i].options;

    options.kernel = world->asked[i].kernel_known ? &world->asked[i].kernel : NULL;
    return srnf_encode(&world->meshes[i], &world->reports[i], &options, NULL, encoded, error);
}

static void expect_same(const struct srnf_encoded *a, const struct srnf_encoded *b)
{
    struct srnf_encoded x = *a, y = *b;

    assert_int_equal(a->degree, b->degree);
    assert_memory_equal(a->coefficients, b->coefficients,
                        3 * srnf_coefficient_count(a->degree) * sizeof(double));
    assert_string_equal(a->reason, b->reason);
    assert_int_equal(a->route, b->route);
    assert_memory_equal(&a->scale, &b->scale, sizeof a->scale);
    assert_memory_equal(a->origin, b->origin, sizeof a->origin);
    assert_true(a->star.value == b->star.value);
    assert_memory_equal(a->star.center, b->star.center, sizeof a->star.center);
    assert_memory_equal(&a->star.margin, &b->star.margin, 2 * sizeof(double));
    assert_memory_equal(&x.distortion, &y.distortion, sizeof x.distortion);
    assert_memory_equal(&x.fit, &y.fit, sizeof x.fit);
    assert_memory_equal(&x.measures, &y.measures, sizeof x.measures);
    assert_memory_equal(&a->volume_ratio, &b->volume_ratio, 2 * sizeof(double));
}

static struct tasks_bytes inputs_of(const struct world *world)
{
    struct tasks_bytes inputs;

    assert_int_equal(tasks_encodings_write(N, world->asked, &inputs), SRNF_OK);
    return inputs;
}

static struct tasks_bytes run(const struct world *world, const struct tasks_bytes *inputs)
{
    struct tasks_bytes result;

    assert_int_equal(
        world->kind->run(inputs->bytes, inputs->size, world->contents, N, NULL, &result, NULL),
        SRNF_OK);
    assert_true(world->kind->check(inputs->bytes, inputs->size, result.bytes, result.size));
    return result;
}

static void bits_are_those_of_the_encoding(void **state)
{
    const struct world *world = *state;
    struct tasks_bytes inputs = inputs_of(world), result = run(world, &inputs);
    struct tasks_encoded found[N];

    assert_int_equal(tasks_encodings_read(result.bytes, result.size, N, found), SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        struct srnf_encoded encoded = {0};
        struct srnf_error error = {0};
        int status = encode(world, i, &encoded, &error);

        assert_int_equal(found[i].status, status);
        assert_true((status < 0) == (i == 2));
        if (status < 0) {
            assert_string_equal(found[i].error.message, error.message);
            assert_int_equal(found[i].error.element, error.element);
            assert_null(found[i].encoded.coefficients);
        } else {
            expect_same(&found[i].encoded, &encoded);
        }
        srnf_free(encoded.coefficients);
        srnf_free(found[i].encoded.coefficients);
    }
    free(inputs.bytes);
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
}

static void what_is_no_task_is_refused(void **state)
{
    struct world *world = *state;
    struct tasks_bytes inputs = inputs_of(world), none;
    uint32_t beyond = (uint32_t)world->asked[0].n_vertices[0];
    double nan = (double)NAN;
    size_t faces = 24 * world->asked[0].n_vertices[0];

    for (size_t size = 0; size < inputs.size; size += 7) {
        refuses(world, &inputs, size, N);
    }
    refuses(world, &inputs, inputs.size, 0);
    world->contents[0].size -= 12;
    refuses(world, &inputs, inputs.size, N);
    world->contents[0].size += 12;
    for (size_t at = 0; at < 24 + 8 * (size_t)11; at += 8) { /* all that are no doubles */
        unsigned char kept[8];

        memcpy(kept, inputs.bytes + at, 8);
        memset(inputs.bytes + at, 0xff, 8);
        refuses(world, &inputs, inputs.size, N);
        memcpy(inputs.bytes + at, kept, 8);
    }
    memcpy(world->bytes[0] + faces, &beyond, sizeof beyond);
    refuses(world, &inputs, inputs.size, N);
    tasks_put_mesh(world->bytes[0], &world->meshes[0]);
    tasks_put_doubles(world->bytes[0], &nan, 1);
    refuses(world, &inputs, inputs.size, N);
    free(inputs.bytes);
    assert_int_equal(tasks_encodings_write(0, world->asked, &none), SRNF_ELIMIT);
    assert_int_equal(tasks_encodings_write(TASKS_ENCODINGS_MAX + 1, world->asked, &none),
                     SRNF_ELIMIT);
}

static void what_is_no_result_is_told(void **state)
{
    const struct world *world = *state;
    struct tasks_bytes inputs = inputs_of(world), result = run(world, &inputs);
    struct tasks_encoded found[N];
    static const int64_t statuses[] = {SRNF_ENOMEM, SRNF_ECANCELED, SRNF_ENUMERIC - 1, 1};

    for (size_t size = 0; size < result.size; size += size < 300 ? 1 : 61) {
        assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, size));
        assert_int_equal(tasks_encodings_read(result.bytes, size, N, found), SRNF_EINVAL);
        assert_null(found[0].encoded.coefficients);
    }
    for (size_t k = 0; k < sizeof statuses / sizeof statuses[0]; k++) {
        tasks_put(result.bytes, (uint64_t)statuses[k]);
        assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    }
    tasks_put(result.bytes, 0);
    assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    tasks_put(result.bytes + 8, 4); /* of another degree than was asked for */
    assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(inputs.bytes);
    free(result.bytes);
}

/* Figures that no surface has go into records, and sentences into answers. */
static void figures_and_sentences_are_looked_at(void **state)
{
    const struct world *world = *state;
    struct tasks_bytes inputs = inputs_of(world), result = run(world, &inputs);
    const double wrong[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    unsigned char *sentences[] = {result.bytes + FIGURES, result.bytes + result.size - SENTENCE};
    static const unsigned char bytes[] = {0xff, 0x01, '\n', 0x7f};
    static const size_t bound[] = {5, 20, 21, 25, 26}; /* scale, area, volume, and their ratios */
    static const double factors[] = {-1.0, 0.0, 1.0 + 1e-6, 0.5, 1e300};

    for (size_t at = 8 * 5; at < FIGURES; at += 8) {
        bool of_the_map = at == 8 * (size_t)14 || at == 8 * (size_t)15; /* how it is distorted */
        double kept = tasks_get_double(result.bytes + at);

        for (size_t k = 0; k < sizeof wrong / sizeof wrong[0]; k++) {
            tasks_put_double(result.bytes + at, wrong[k]);
            assert_int_equal(
                world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size),
                of_the_map);
        }
        tasks_put_double(result.bytes + at, kept);
    }
    for (size_t k = 0; k < sizeof bound / sizeof bound[0]; k++) {
        double kept = tasks_get_double(result.bytes + 8 * bound[k]);

        for (size_t f = 0; f < sizeof factors / sizeof factors[0]; f++) {
            tasks_put_double(result.bytes + 8 * bound[k], factors[f] * kept);
            if (world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size)) {
                fail_msg("figure %zu, %g times %g, is taken", bound[k], factors[f], kept);
            }
        }
        tasks_put_double(result.bytes + 8 * bound[k], kept);
    }
    tasks_put(result.bytes + 8 * 3, 2); /* neither a star nor none */
    assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    tasks_put(result.bytes + 8 * 3, 1);
    for (size_t i = 0; i < 2; i++) {
        for (size_t k = 0; k < SENTENCE; k += SENTENCE - 1) { /* in it, and behind it */
            unsigned char kept = sentences[i][k];

            for (size_t b = 0; b < sizeof bytes; b++) {
                sentences[i][k] = bytes[b];
                assert_false(
                    world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
            }
            sentences[i][k] = kept;
        }
    }
    assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
    free(inputs.bytes);
    free(result.bytes);
}

/* Figures that agree with each other are those of the coefficients, too. */
static void figures_are_those_of_the_coefficients(void **state)
{
    const struct world *world = *state;
    struct tasks_bytes inputs = inputs_of(world), result = run(world, &inputs);
    size_t first = FIGURES + SENTENCE + 8 * (size_t)(3 * 36);
    /* Of the first surface, which has an area of one, and of the second, which keeps its own. */
    static const size_t pairs[][2] = {{20, 26}, {21, 25}}; /* area, volume, and their ratios */

    for (size_t i = 0; i < 2; i++) {
        unsigned char *surface = result.bytes + i * first;
        double *coefficients = malloc(8 * (size_t)(3 * 49));
        size_t count = i == 0 ? 3 * 36 : 3 * 49;

        assert_true(tasks_get_doubles(surface + FIGURES + SENTENCE, count, coefficients));
        for (size_t k = i == 0; k < 2; k++) {
            double kept[2];

            for (size_t j = 0; j < 2; j++) {
                kept[j] = tasks_get_double(surface + 8 * pairs[k][j]);
                tasks_put_double(surface + 8 * pairs[k][j], kept[j] * (1.0 + 1e-6));
            }
            if (world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size)) {
                fail_msg("figure %zu of surface %zu with its ratio is taken", pairs[k][0], i);
            }
            for (size_t j = 0; j < 2; j++) {
                tasks_put_double(surface + 8 * pairs[k][j], kept[j]);
            }
        }
        for (size_t k = 0; k < 3; k++) { /* beside its centroid */
            double kept = tasks_get_double(surface + 8 * (22 + k));

            tasks_put_double(surface + 8 * (22 + k), kept + 1e-3);
            assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
            tasks_put_double(surface + 8 * (22 + k), kept);
        }
        coefficients[1] += 1e-3; /* another surface */
        tasks_put_doubles(surface + FIGURES + SENTENCE, coefficients, count);
        assert_false(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
        coefficients[1] -= 1e-3; /* within rounding the same again */
        tasks_put_doubles(surface + FIGURES + SENTENCE, coefficients, count);
        assert_true(world->kind->check(inputs.bytes, inputs.size, result.bytes, result.size));
        free(coefficients);
    }
    free(inputs.bytes);
    free(result.bytes);
}

static bool stops(void *user)
{
    (void)user;
    return true;
}

static void a_task_that_is_stopped_yields_nothing(void **state)
{
    const struct world *world = *state;
    const struct srnf_context context = {.canceled = stops};
    struct tasks_bytes inputs = inputs_of(world), result;

    assert_int_equal(
        world->kind->run(inputs.bytes, inputs.size, world->contents, N, &context, &result, NULL),
        SRNF_ECANCELED);
    assert_null(result.bytes);
    free(inputs.bytes);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(bits_are_those_of_the_encoding),
        TEST(what_is_no_task_is_refused),
        TEST(what_is_no_result_is_told),
        TEST(figures_and_sentences_are_looked_at),
        TEST(figures_are_those_of_the_coefficients),
        TEST(a_task_that_is_stopped_yields_nothing),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
