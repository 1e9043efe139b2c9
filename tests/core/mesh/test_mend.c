/*
 * test_mend.c - repairs on request: each fault alone, mended or refused with the reason, with what
 * was changed and where; a sound mesh stays as it is; and the distance between before and after.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "support/meshes.h"

static const struct srnf_mend_options all = {.orient = true,
                                             .islands = true,
                                             .duplicates = true,
                                             .degenerate = true,
                                             .merge = 1e-4,
                                             .holes = 10.0};

static struct srnf_mended mend(const struct srnf_mesh *mesh, struct srnf_mend_options options)
{
    struct srnf_mended mended;
    struct srnf_error error = {.element = -1};

    if (srnf_mend(mesh, &options, NULL, &mended, &error) != SRNF_OK) {
        fail_msg("%s", error.message);
    }
    return mended;
}

static const struct srnf_mend_item *find(const struct srnf_mend_item *items, size_t n,
                                         const char *code)
{
    for (size_t i = 0; i < n; i++) {
        if (strcmp(items[i].code, code) == 0) {
            return &items[i];
        }
    }
    fail_msg("no %s", code);
    return NULL;
}

static const struct srnf_mend_item *change(const struct srnf_mended *mended, const char *code)
{
    return find(mended->changes, mended->n_changes, code);
}

static const struct srnf_mend_item *refusal(const struct srnf_mended *mended, const char *code)
{
    return find(mended->refused, mended->n_refused, code);
}

static void assert_near(const double *a, const double *b, double most)
{
    for (size_t k = 0; k < 3; k++) {
        assert_true(fabs(a[k] - b[k]) < most);
    }
}

/* One closed surface of genus zero, that looks outwards as it stands. */
static void assert_sound(const struct srnf_mended *mended)
{
    struct srnf_mesh mesh = meshes_copy(&mended->mesh);
    struct srnf_mesh_report report;

    assert_int_equal(srnf_mesh_prepare(&mesh, true, &report), SRNF_OK);
    if (report.n_problems > 0) {
        fail_msg("%s", report.problems[0].detail);
    }
    assert_int_equal(report.euler_characteristic, 2);
    srnf_mesh_clear(&mesh);
}

static struct srnf_mesh_distance distance(const struct srnf_mesh *a, const struct srnf_mesh *b)
{
    struct srnf_mesh_distance d;

    assert_int_equal(srnf_mesh_distance(a, b, NULL, &d), SRNF_OK);
    return d;
}

/* The sphere without the faces around vertex 0: a hole of one loop. */
static struct srnf_mesh open_sphere(size_t frequency)
{
    struct srnf_mesh sphere = meshes_sphere(frequency), open;
    bool *drop = calloc(sphere.n_faces, sizeof *drop);

    assert_non_null(drop);
    for (size_t c = 0; c < 3 * sphere.n_faces; c++) {
        drop[c / 3] = drop[c / 3] || sphere.faces[c] == 0;
    }
    open = meshes_without_faces(&sphere, drop);
    free(drop);
    srnf_mesh_clear(&sphere);
    return open;
}

/* ---- Nothing to do --------------------------------------------------------------------------- */

static void sound_mesh_is_left_alone(void **state)
{
    struct srnf_mesh meshes[] = {meshes_sphere(6), meshes_bumpy(5, 3), meshes_box(1.0, 2.0, 3.0)};

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        struct srnf_mend_options options = all;
        struct srnf_mended mended;

        options.merge = 100.0; /* even so */
        mended = mend(&meshes[i], options);
        assert_int_equal(mended.n_changes, 0);
        assert_int_equal(mended.n_refused, 0);
        assert_null(mended.mesh.vertices);
        assert_int_equal(srnf_mend_handles(&meshes[i], 64, NULL, &mended, NULL), SRNF_OK);
        assert_int_equal(mended.n_changes, 0);
        srnf_mesh_clear(&meshes[i]);
    }
}

static void what_is_not_asked_for_is_left_alone(void **state)
{
    struct srnf_mesh sphere = open_sphere(4), soup = meshes_soup(&sphere);
    struct srnf_mended mended =
        mend(&soup, (struct srnf_mend_options){
                        .orient = true, .islands = true, .duplicates = true, .degenerate = true});

    (void)state;
    assert_int_equal(mended.n_changes, 0);
    assert_null(mended.mesh.vertices);
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&sphere);
}

/* ---- One fault each -------------------------------------------------------------------------- */

static void hole_is_closed(void **state)
{
    struct srnf_mesh open = open_sphere(8);
    struct srnf_mended mended = mend(&open, (struct srnf_mend_options){.holes = 2.0});
    const struct srnf_mend_item *hole = change(&mended, "holes-closed");
    struct srnf_mesh whole = meshes_sphere(8);
    struct srnf_mesh_distance d = distance(&open, &mended.mesh);

    (void)state;
    assert_int_equal(mended.n_changes, 1);
    assert_int_equal(hole->count, 1);
    assert_near(hole->position, whole.vertices, 0.05);
    assert_int_equal(mended.mesh.n_vertices, open.n_vertices - (open.n_vertices > 641));
    assert_int_equal(mended.mesh.n_faces, whole.n_faces - 2);
    assert_sound(&mended);
    assert_true(d.max < 0.15);
    assert_true(d.rms > 0.0 && d.rms < 0.02);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&whole);
    srnf_mesh_clear(&open);
}

static void long_hole_is_refused(void **state)
{
    struct srnf_mesh open = open_sphere(8);
    struct srnf_mended mended = mend(&open, (struct srnf_mend_options){.holes = 0.1});
    const struct srnf_mend_item *hole = refusal(&mended, "hole-too-long");

    (void)state;
    assert_int_equal(mended.n_changes, 0);
    assert_int_equal(hole->count, 1);
    assert_non_null(strstr(hole->detail, "more than the 0.1 asked for"));
    srnf_mesh_clear(&open);
}

/* A square hole one diagonal of which is an edge of the mesh already, on the far side: a
   tetrahedron without two of its faces. The other diagonal is one as well: only a vertex in the
   middle closes it. */
static void hole_whose_chords_are_edges(void **state)
{
    struct srnf_mesh tetrahedron = meshes_tetrahedron(), open;
    const bool drop[4] = {true, true, false, false};
    struct srnf_mended mended;

    (void)state;
    open = meshes_without_faces(&tetrahedron, drop);
    mended = mend(&open, (struct srnf_mend_options){.holes = 10.0});
    assert_int_equal(change(&mended, "holes-closed")->count, 1);
    assert_sound(&mended);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&open);
    srnf_mesh_clear(&tetrahedron);
}

static void flipped_patch_is_turned(void **state)
{
    struct srnf_mesh sphere = meshes_sphere(6), before;
    struct srnf_mended mended;
    const struct srnf_mend_item *turned;

    (void)state;
    for (size_t f = 40; f < 55; f++) {
        uint32_t swap = sphere.faces[3 * f];

        sphere.faces[3 * f] = sphere.faces[3 * f + 1];
        sphere.faces[3 * f + 1] = swap;
    }
    before = meshes_copy(&sphere);
    mended = mend(&sphere, (struct srnf_mend_options){.orient = true});
    turned = change(&mended, "faces-turned");
    assert_int_equal(mended.n_changes, 1);
    assert_int_equal(turned->count, 15);
    assert_int_equal(turned->first, 40);
    assert_sound(&mended);
    assert_true(distance(&before, &mended.mesh).max < 1e-15);
    assert_memory_equal(before.faces, sphere.faces, 3 * before.n_faces * sizeof *before.faces);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&before);
    srnf_mesh_clear(&sphere);
}

/* Inside out but for one patch: all the others are turned. */
static void faces_come_to_look_outwards(void **state)
{
    struct srnf_mesh sphere = meshes_inside_out_sphere(4);
    struct srnf_mended mended;

    (void)state;
    for (size_t f = 3; f < 6; f++) {
        uint32_t swap = sphere.faces[3 * f];

        sphere.faces[3 * f] = sphere.faces[3 * f + 1];
        sphere.faces[3 * f + 1] = swap;
    }
    mended = mend(&sphere, (struct srnf_mend_options){.orient = true});
    assert_int_equal(change(&mended, "faces-turned")->count, sphere.n_faces - 3);
    assert_int_equal(change(&mended, "faces-turned")->first, 0);
    assert_sound(&mended);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&sphere);
}

static void one_sided_surface_is_refused(void **state)
{
    struct srnf_mesh klein = meshes_klein_bottle(12, 8);
    struct srnf_mended mended = mend(&klein, (struct srnf_mend_options){.orient = true});

    (void)state;
    assert_int_equal(mended.n_changes, 0);
    assert_int_equal(mended.n_refused, 1);
    assert_int_equal(refusal(&mended, "one-sided")->count, 1);
    srnf_mesh_clear(&klein);
}

static void island_is_removed(void **state)
{
    struct srnf_mesh small = meshes_sphere(2), large = meshes_sphere(5), both;
    struct srnf_mended mended;
    const struct srnf_mend_item *removed;

    (void)state;
    meshes_scale(&small, 0.1);
    meshes_move(&small, 3.0, 0.0, 0.0);
    both = meshes_join(&large, &small);
    mended = mend(&both, (struct srnf_mend_options){.islands = true});
    removed = change(&mended, "islands-removed");
    assert_int_equal(removed->count, 1);
    assert_int_equal(removed->first, large.n_faces);
    assert_near(removed->position, (const double[3]){3.0, 0.0, 0.0}, 0.11);
    assert_int_equal(mended.mesh.n_faces, large.n_faces);
    assert_sound(&mended);
    assert_true(distance(&both, &mended.mesh).max > 2.0);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&large);
    srnf_mesh_clear(&small);
}

/* A second layer over a patch, with vertices of its own at the same points, and one that lies
   1e-6 off it. */
static void duplicate_sheet_is_dropped(void **state)
{
    (void)state;
    for (int noisy = 0; noisy < 2; noisy++) {
        struct srnf_mesh sphere = open_sphere(6), sheet = meshes_sphere(6), both;
        struct srnf_mended mended;
        const struct srnf_mend_item *dropped;
        bool drop[720];

        for (size_t f = 0; f < sheet.n_faces; f++) {
            drop[f] = f < 400 || f >= 420;
        }
        both = meshes_without_faces(&sheet, drop);
        srnf_mesh_clear(&sheet);
        for (size_t i = 0; noisy && i < 3 * both.n_vertices; i++) {
            both.vertices[i] *= 1.0 + 1e-6;
        }
        sheet = meshes_join(&sphere, &both);
        mended = mend(&sheet, (struct srnf_mend_options){
                                  .duplicates = true, .holes = 3.0, .merge = noisy ? 1e-5 : 0.0});
        dropped = change(&mended, "duplicate-faces-dropped");
        assert_int_equal(dropped->count, 20);
        assert_true(dropped->first >= 0 && dropped->first < (int64_t)sheet.n_faces);
        assert_sound(&mended);
        srnf_mended_clear(&mended);
        srnf_mesh_clear(&sheet);
        srnf_mesh_clear(&both);
        srnf_mesh_clear(&sphere);
    }
}

/* Every face has vertices of its own, each a little off. */
static void noisy_split_vertices_are_merged(void **state)
{
    struct srnf_mesh sphere = meshes_sphere(6), soup = meshes_soup(&sphere);
    struct srnf_mended mended;
    struct srnf_mesh_distance d;

    (void)state;
    for (size_t i = 0; i < 3 * soup.n_vertices; i++) {
        soup.vertices[i] += 1e-6 * sin(1000.0 * (double)i);
    }
    mended = mend(&soup, (struct srnf_mend_options){.merge = 1e-5});
    assert_int_equal(change(&mended, "near-vertices-merged")->count,
                     soup.n_vertices - sphere.n_vertices);
    assert_true(change(&mended, "near-vertices-merged")->of_vertex);
    assert_true(change(&mended, "near-vertices-merged")->first > 0);
    assert_int_equal(mended.mesh.n_vertices, sphere.n_vertices);
    assert_sound(&mended);
    d = distance(&soup, &mended.mesh);
    assert_true(d.max > 0.0 && d.max < 5e-6 && d.rms < d.max);
    srnf_mended_clear(&mended);

    mended = mend(&soup, (struct srnf_mend_options){.merge = 1e-9});
    assert_int_equal(mended.n_changes, 0);
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&sphere);
}

static void degenerate_faces_are_dropped(void **state)
{
    struct srnf_mesh sphere = open_sphere(4), needles = meshes_blank(0, 0), grown;
    struct srnf_mended mended;

    (void)state;
    srnf_mesh_clear(&needles);
    needles = meshes_blank(3, 1);
    memcpy(needles.vertices, sphere.vertices + 3, 9 * sizeof *needles.vertices);
    needles.faces[0] = 0;
    needles.faces[1] = needles.faces[2] = 1;
    grown = meshes_join(&sphere, &needles);
    mended = mend(&grown, (struct srnf_mend_options){.degenerate = true});
    assert_int_equal(change(&mended, "degenerate-faces-dropped")->count, 1);
    assert_int_equal(change(&mended, "degenerate-faces-dropped")->first, sphere.n_faces);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&grown);
    srnf_mesh_clear(&needles);
    srnf_mesh_clear(&sphere);
}

/* ---- All at once, and handles ---------------------------------------------------------------- */

static void many_faults_at_once(void **state)
{
    struct srnf_mesh sphere = open_sphere(6), island = meshes_tetrahedron(), both, soup;
    struct srnf_mended mended;

    (void)state;
    for (size_t f = 100; f < 110; f++) {
        uint32_t swap = sphere.faces[3 * f];

        sphere.faces[3 * f] = sphere.faces[3 * f + 1];
        sphere.faces[3 * f + 1] = swap;
    }
    meshes_scale(&island, 0.2);
    meshes_move(&island, 2.0, 2.0, 2.0);
    both = meshes_join(&island, &sphere);
    soup = meshes_soup(&both);
    for (size_t i = 0; i < 3 * soup.n_vertices; i++) {
        soup.vertices[i] += 1e-6 * cos(777.0 * (double)i);
    }
    mended = mend(&soup, all);
    assert_int_equal(change(&mended, "islands-removed")->first, 0);
    assert_int_equal(change(&mended, "faces-turned")->count, 10);
    assert_int_equal(change(&mended, "faces-turned")->first, 104);
    assert_int_equal(change(&mended, "holes-closed")->count, 1);
    assert_sound(&mended);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&soup);
    srnf_mesh_clear(&both);
    srnf_mesh_clear(&island);
    srnf_mesh_clear(&sphere);
}

/* A torus has its tunnel filled or its ring cut; the distance says what that took. */
static void handle_is_cut(void **state)
{
    struct srnf_mesh torus = meshes_torus(1.0, 0.4, 60, 30);
    struct srnf_mended mended = mend(&torus, all);
    struct srnf_mesh_distance d;
    struct srnf_error error = {.element = -1};

    (void)state;
    assert_int_equal(mended.n_changes, 0);
    if (srnf_mend_handles(&torus, 40, NULL, &mended, &error) != SRNF_OK) {
        fail_msg("%s", error.message);
    }
    assert_true(mended.n_changes >= 2);
    assert_int_equal(change(&mended, "made-anew-from-voxels")->count, mended.mesh.n_vertices);
    assert_true(mended.changes[1].count > 0);
    assert_sound(&mended);
    d = distance(&torus, &mended.mesh);
    assert_true(d.rms > 0.0 && d.rms < 0.25 && d.max < 0.8);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&torus);
}

static void handles_of_an_open_mesh_are_refused(void **state)
{
    struct srnf_mesh open = open_sphere(4);
    struct srnf_mended mended = mend(&open, (struct srnf_mend_options){.orient = true});

    (void)state;
    assert_int_equal(srnf_mend_handles(&open, 40, NULL, &mended, NULL), SRNF_OK);
    assert_int_equal(mended.n_changes, 0);
    assert_non_null(strstr(refusal(&mended, "handles-in-doubt")->detail, "boundary edges"));
    srnf_mesh_clear(&open);
}

/* ---- Distance and errors --------------------------------------------------------------------- */

/* Two squares face to face: the distance is the gap; and of spheres of radii 1 and 1.1. */
static void distance_is_exact(void **state)
{
    struct srnf_mesh a = meshes_box(1.0, 1.0, 1.0), b = meshes_box(1.0, 1.0, 1.0);
    struct srnf_mesh_distance d = distance(&a, &b);

    (void)state;
    assert_true(d.max < 1e-15);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
    a = meshes_sphere(20);
    b = meshes_sphere(20);
    meshes_scale(&b, 1.1);
    d = distance(&a, &b);
    assert_true(fabs(d.rms - 0.1) < 5e-4);
    assert_true(fabs(d.max - 0.1) < 2e-3);
    srnf_mesh_clear(&a);
    srnf_mesh_clear(&b);
}

static void wrong_arguments_are_refused(void **state)
{
    struct srnf_mesh open = open_sphere(3), none = {.n_vertices = 0};
    struct srnf_mend_options options = {.merge = -1.0};
    struct srnf_mended mended;
    struct srnf_mesh_distance d;
    struct srnf_error error = {.element = -1};

    (void)state;
    assert_int_equal(srnf_mend(&open, &options, NULL, &mended, &error), SRNF_EINVAL);
    options = (struct srnf_mend_options){.holes = (double)NAN};
    assert_int_equal(srnf_mend(&open, &options, NULL, &mended, &error), SRNF_EINVAL);
    options = (struct srnf_mend_options){.merge = 10.0};
    assert_int_equal(srnf_mend(&open, &options, NULL, &mended, &error), SRNF_EDEGENERATE);
    assert_non_null(strstr(error.message, "no face is left"));
    assert_int_equal(srnf_mend_handles(&open, 3, NULL, &mended, &error), SRNF_EINVAL);
    assert_int_equal(srnf_mesh_distance(&open, &none, NULL, &d), SRNF_EDEGENERATE);
    open.faces[4] = 1u << 30;
    assert_int_equal(srnf_mesh_distance(&open, &open, NULL, &d), SRNF_EINVAL);
    options = all;
    assert_int_equal(srnf_mend(&open, &options, NULL, &mended, &error), SRNF_EINVAL);
    srnf_mesh_clear(&open);
}

static bool counted_down(void *user)
{
    size_t *left = user;

    return *left == 0 || --*left == 0;
}

static void canceled_at_any_question(void **state)
{
    struct srnf_mesh open = open_sphere(6);
    struct srnf_mended mended = {.n_changes = 0};
    size_t asked = 0;
    int status = SRNF_ECANCELED;

    (void)state;
    while (status == SRNF_ECANCELED && asked < 10000) {
        size_t left = ++asked;
        const struct srnf_context context = {.canceled = counted_down, .user = &left};

        status = srnf_mend(&open, &all, &context, &mended, NULL);
        assert_true(status == SRNF_OK || !mended.mesh.vertices);
    }
    assert_int_equal(status, SRNF_OK);
    assert_true(asked > 20);
    assert_sound(&mended);
    srnf_mended_clear(&mended);
    srnf_mesh_clear(&open);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_mesh_is_left_alone),
        cmocka_unit_test(what_is_not_asked_for_is_left_alone),
        cmocka_unit_test(hole_is_closed),
        cmocka_unit_test(long_hole_is_refused),
        cmocka_unit_test(hole_whose_chords_are_edges),
        cmocka_unit_test(flipped_patch_is_turned),
        cmocka_unit_test(faces_come_to_look_outwards),
        cmocka_unit_test(one_sided_surface_is_refused),
        cmocka_unit_test(island_is_removed),
        cmocka_unit_test(duplicate_sheet_is_dropped),
        cmocka_unit_test(noisy_split_vertices_are_merged),
        cmocka_unit_test(degenerate_faces_are_dropped),
        cmocka_unit_test(many_faults_at_once),
        cmocka_unit_test(handle_is_cut),
        cmocka_unit_test(handles_of_an_open_mesh_are_refused),
        cmocka_unit_test(distance_is_exact),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(canceled_at_any_question),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
