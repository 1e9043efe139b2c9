/*
 * test_mesh_asks.c - reading, preparing and judging a mesh ask for cancellation every few thousand
 * items: told to stop at any of these moments each says SRNF_ECANCELED, loses nothing and leaves
 * nothing; asked in vain it gives what it gives without being asked.
 *
 *   SRNFD_ASKS_FREQUENCY=300   of the geodesic sphere, to see the longest silence at 20 times its
 *                              square of faces
 *
 * srnfd-test: slow
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "support/mesh_files.h"
#include "support/meshes.h"
#include "support/timing.h"

/* Faces, vertices and numbers that may pass between two questions. */
#define ITEMS_UNASKED 16384

struct watch {
    size_t asked, stop_at; /* the question that is answered yes */
    double last, longest;  /* seconds of this thread */
};

static bool asked(void *user)
{
    struct watch *watch = user;
    double now = timing_cpu();

    watch->longest = now - watch->last > watch->longest ? now - watch->last : watch->longest;
    watch->last = now;
    return watch->asked++ >= watch->stop_at;
}

/* What is run, on a copy of its mesh or on a file. */
struct subject {
    const struct srnf_mesh *mesh;
    struct srnf_buffer file;
    enum srnf_mesh_format format;
    struct srnf_mesh result;
};
typedef int run_function(struct subject *subject, const struct srnf_context *context);

static int run_read(struct subject *subject, const struct srnf_context *context)
{
    struct srnf_mesh_limits limits = srnf_mesh_limits_defaults();
    int status;

    limits.context = context;
    status = srnf_mesh_read(subject->file.data, subject->file.size, subject->format, &limits,
                            &subject->result, NULL, NULL);
    assert_true(status == SRNF_OK || (!subject->result.vertices && !subject->result.faces));
    return status;
}

static int run_prepare(struct subject *subject, const struct srnf_context *context)
{
    struct srnf_mesh_report report;

    subject->result = meshes_copy(subject->mesh);
    return srnf_mesh_prepare_within(&subject->result, true, context, &report);
}

static int run_prepare_pair(struct subject *subject, const struct srnf_context *context)
{
    struct srnf_mesh sphere = meshes_copy(subject->mesh);
    struct srnf_mesh_report report;
    int status;

    subject->result = meshes_copy(subject->mesh);
    status = srnf_mesh_prepare_pair_within(&subject->result, &sphere, context, &report);
    srnf_mesh_clear(&sphere);
    return status;
}

static int run_star_kernel(struct subject *subject, const struct srnf_context *context)
{
    struct srnf_star star;

    return srnf_star_kernel_within(subject->mesh, context, &star);
}

static void assert_same(const struct srnf_mesh *a, const struct srnf_mesh *b)
{
    assert_int_equal(a->n_vertices, b->n_vertices);
    assert_int_equal(a->n_faces, b->n_faces);
    if (a->n_faces > 0) {
        assert_memory_equal(a->faces, b->faces, 3 * a->n_faces * sizeof *a->faces);
        assert_memory_equal(a->vertices, b->vertices, 3 * a->n_vertices * sizeof *a->vertices);
    }
}

static void asks(struct subject *subject, run_function *run, const char *label, size_t items)
{
    struct watch watch = {.stop_at = SIZE_MAX, .last = timing_cpu()};
    struct srnf_context context = {.user = &watch, .canceled = asked};
    struct srnf_mesh unasked;
    size_t questions, step;

    assert_int_equal(run(subject, &context), SRNF_OK);
    unasked = subject->result;
    subject->result = (struct srnf_mesh){0};
    questions = watch.asked;
    print_message("# %s: %zu questions, longest silence %.4f s\n", label, questions, watch.longest);
    assert_true(questions > items / ITEMS_UNASKED);
    assert_int_equal(run(subject, NULL), SRNF_OK);
    assert_same(&subject->result, &unasked);
    srnf_mesh_clear(&subject->result);
    srnf_mesh_clear(&unasked);
    step = questions / 12 + 1;
    for (size_t stop = 0; stop < questions; stop += step) {
        watch = (struct watch){.stop_at = stop};
        assert_int_equal(run(subject, &context), SRNF_ECANCELED);
        assert_true(watch.asked <=
                    stop + 64); /* it ends soon, not by passing over loop after loop */
        srnf_mesh_clear(&subject->result);
    }
}

#ifdef __SANITIZE_ADDRESS__
#define FREQUENCY 28 /* half of the faces */
#else
#define FREQUENCY 40
#endif

static struct srnf_mesh ball; /* single precision, which all formats hold */

static int open_ball(void **state)
{
    const char *frequency = getenv("SRNFD_ASKS_FREQUENCY");

    (void)state;
    ball = meshes_bumpy(frequency ? strtoul(frequency, NULL, 10) : FREQUENCY, 1);
    return 0;
}

static int close_ball(void **state)
{
    (void)state;
    srnf_mesh_clear(&ball);
    return 0;
}

static void test_reading(void **state)
{
    (void)state;
    for (const struct mesh_file_kind *kind = mesh_file_kinds; kind->label; kind++) {
        struct subject subject = {.mesh = &ball, .format = kind->format};

        kind->make(&ball, &subject.file);
        asks(&subject, run_read, kind->label, ball.n_vertices + 3 * ball.n_faces);
        srnf_buffer_clear(&subject.file);
    }
}

/* A polygon whose corners turn in and out by turns: cutting it takes steps by the square. */
static void test_polygon(void **state)
{
    const size_t corners = 3000;
    struct subject subject = {.format = SRNF_MESH_OBJ};

    (void)state;
    for (size_t i = 0; i < corners; i++) {
        file_print(&subject.file, "v %zu %zu 0\n", i, i == 0 || i + 1 == corners ? 9 : i % 2);
    }
    file_print(&subject.file, "v %zu 20 0\nf", corners / 2);
    for (size_t i = 0; i <= corners; i++) {
        file_print(&subject.file, " %zu", i + 1);
    }
    file_print(&subject.file, "\n");
    asks(&subject, run_read, "a polygon to be cut", 20 * corners);
    srnf_buffer_clear(&subject.file);
}

static void test_preparing(void **state)
{
    struct srnf_mesh soup = meshes_soup(&ball), two = meshes_two_spheres(30);
    struct srnf_mesh twice = meshes_join(&ball, &ball); /* each face has its equal */
    struct subject subjects[] = {
        {.mesh = &ball}, {.mesh = &soup}, {.mesh = &two}, {.mesh = &twice}};
    struct srnf_mesh back = meshes_copy(&ball), walls;
    struct subject folded;

    (void)state;
    meshes_flip(&back);
    walls = meshes_join(&ball, &back); /* or its opposite */
    folded = (struct subject){.mesh = &walls};
    for (size_t i = 0; i < sizeof subjects / sizeof subjects[0]; i++) {
        asks(&subjects[i], run_prepare, "preparing", 8 * subjects[i].mesh->n_faces);
    }
    asks(&folded, run_prepare, "preparing walls", 8 * walls.n_faces);
    asks(&subjects[0], run_prepare_pair, "preparing a pair", 6 * ball.n_faces);
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&two);
    srnf_mesh_clear(&twice);
    srnf_mesh_clear(&back);
    srnf_mesh_clear(&walls);
}

static void test_star_kernel(void **state)
{
    struct subject subject = {.mesh = &ball};

    (void)state;
    asks(&subject, run_star_kernel, "the star kernel", 4 * ball.n_faces);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reading),
        cmocka_unit_test(test_polygon),
        cmocka_unit_test(test_preparing),
        cmocka_unit_test(test_star_kernel),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, open_ball, close_ball);
}
