/*
 * test_extract.c - surfaces of labels: genus zero whatever the voxels are, the volume of the
 * voxels, near to the shape that the voxels came from, in its place and outward.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>

#include "core/volume/volumes.h"
#include "support/random.h"

static const int64_t label = VOLUME_LABEL;
static const double unit_affine[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* Extracts the label; the surface is a closed one of genus zero that encloses the voxels' volume.
   */
static void extract(const struct srnf_volume *volume, size_t smoothing,
                    struct srnf_extracted *extracted)
{
    struct srnf_extract_options options = srnf_extract_options_defaults();
    struct srnf_error error = {.message = ""};
    struct srnf_mesh_report report;
    size_t vertices;

    options.smoothing = smoothing;
    if (srnf_extract(volume, &label, 1, &options, NULL, extracted, &error) != SRNF_OK) {
        fail_msg("%s", error.message);
    }
    vertices = extracted->mesh.n_vertices;
    assert_int_equal(srnf_mesh_prepare(&extracted->mesh, true, &report), SRNF_OK);
    assert_int_equal(report.n_problems, 0);
    assert_int_equal(report.genus, 0);
    assert_int_equal(report.repairs.faces_flipped, 0);
    assert_int_equal(extracted->mesh.n_vertices, vertices);
    assert_within(report.volume, extracted->volume, 1e-9 * report.volume);
    assert_within(extracted->volume, extracted->voxel_volume, 1e-3 * extracted->voxel_volume);
    assert_int_equal(extracted->changed, extracted->added + extracted->removed);
}

/* ---- Topology -------------------------------------------------------------------------------- */

/* Any voxels at all: 2^k dense or thin sets of 5 x 4 x 6. */
static void any_voxels_give_genus_zero(void **state)
{
    struct test_random random = test_random_seed(1);
    (void)state;

    for (size_t round = 0; round < 400; round++) {
        struct srnf_volume volume;
        struct srnf_extracted extracted;
        double density = 0.1 + 0.08 * (double)(round % 11);

        volume_make(&volume, 5, 4, 6, unit_affine);
        for (size_t n = 0; n < 5 * 4 * 6; n++) {
            volume_set(&volume, n % 5, n / 5 % 4, n / 20,
                       test_random_uniform(&random, 0, 1) < density);
        }
        if (volume.labels[0].voxels > 0) {
            extract(&volume, round % 40, &extracted);
            srnf_extracted_clear(&extracted);
        }
        srnf_volume_clear(&volume);
    }
}

static void every_pair_and_triple_of_a_block_is_closed(void **state)
{
    (void)state;

    for (unsigned config = 1; config < 256; config++) {
        struct srnf_volume volume;
        struct srnf_extracted extracted;

        volume_make(&volume, 2, 2, 2, unit_affine);
        for (size_t n = 0; n < 8; n++) {
            volume_set(&volume, n & 1, n >> 1 & 1, n >> 2, config >> n & 1);
        }
        extract(&volume, 5, &extracted);
        assert_int_equal(extracted.voxels, volume.labels[0].voxels);
        srnf_extracted_clear(&extracted);
        srnf_volume_clear(&volume);
    }
}

static void fill_block(struct srnf_volume *volume, const size_t low[3], const size_t high[3],
                       bool in)
{
    for (size_t k = low[2]; k < high[2]; k++) {
        for (size_t j = low[1]; j < high[1]; j++) {
            for (size_t i = low[0]; i < high[0]; i++) {
                volume_set(volume, i, j, k, in);
            }
        }
    }
}

#define BLOCK(volume, in, x0, y0, z0, x1, y1, z1) \
    fill_block(volume, (const size_t[3]){x0, y0, z0}, (const size_t[3]){x1, y1, z1}, in)

static void check_place(const struct srnf_extracted *extracted, size_t place,
                        enum srnf_change change, size_t voxels, double x, double y, double z)
{
    const struct srnf_changed_place *found = &extracted->places[place];

    assert_true(place < extracted->n_places);
    assert_int_equal(found->change, change);
    assert_int_equal(found->voxels, voxels);
    assert_within(found->position[0], x, 1e-9);
    assert_within(found->position[1], y, 1e-9);
    assert_within(found->position[2], z, 1e-9);
}

/* A block of 12 x 6 x 6 with an arch of one voxel over it: one voxel of the arch goes. */
static void a_thin_handle_is_cut_where_it_is(void **state)
{
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 16, 10, 14, unit_affine);
    BLOCK(&volume, true, 2, 2, 2, 14, 8, 8);
    BLOCK(&volume, true, 4, 4, 8, 5, 5, 12);
    BLOCK(&volume, true, 10, 4, 8, 11, 5, 12);
    BLOCK(&volume, true, 4, 4, 11, 11, 5, 12);
    extract(&volume, 20, &extracted);
    assert_int_equal(extracted.changed, 1);
    assert_int_equal(extracted.removed, 1);
    assert_int_equal(extracted.n_places, 1);
    assert_int_equal(extracted.places[0].change, SRNF_CHANGE_CUT);
    assert_true(extracted.places[0].position[2] >= 8.0);
    assert_within(extracted.places[0].position[1], 4.0, 1e-9);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

/* A tunnel of one voxel through a plate of 2: it is closed rather than the plate cut open. */
static void a_thin_tunnel_is_filled(void **state)
{
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 16, 16, 4, unit_affine);
    BLOCK(&volume, true, 1, 1, 0, 15, 15, 2);
    volume_set(&volume, 9, 11, 0, false);
    volume_set(&volume, 9, 11, 1, false);
    extract(&volume, 20, &extracted);
    assert_int_equal(extracted.changed, 1);
    assert_int_equal(extracted.added, 1);
    assert_int_equal(extracted.places[0].change, SRNF_CHANGE_FILLED);
    assert_within(extracted.places[0].position[0], 9.0, 1e-9);
    assert_within(extracted.places[0].position[1], 11.0, 1e-9);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

static void islands_and_cavities_are_counted_and_located(void **state)
{
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 20, 12, 12, unit_affine);
    BLOCK(&volume, true, 1, 1, 1, 10, 10, 10);
    BLOCK(&volume, false, 4, 4, 4, 7, 7, 7); /* a cavity of 27, with an island of one */
    volume_set(&volume, 5, 5, 5, true);
    BLOCK(&volume, true, 14, 3, 3, 16, 5, 5); /* an island of eight */
    volume_set(&volume, 10, 10, 10, true);    /* one that touches by a corner alone */
    extract(&volume, 20, &extracted);
    assert_int_equal(extracted.voxels, 729 - 27 + 1 + 8 + 1);
    assert_int_equal(extracted.n_places, 3);
    check_place(&extracted, 0, SRNF_CHANGE_CAVITY, 26, 5, 5, 5);
    check_place(&extracted, 1, SRNF_CHANGE_ISLAND, 8, 14.5, 3.5, 3.5);
    check_place(&extracted, 2, SRNF_CHANGE_ISLAND, 1, 10, 10, 10);
    assert_int_equal(extracted.added, 26);
    assert_int_equal(extracted.removed, 9);
    assert_within(extracted.voxel_volume, 729.0, 1e-9);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

/* Voxels that touch along an edge are one piece; nothing is changed, and the surface is a manifold
   there. */
static void contacts_along_edges_stay(void **state)
{
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 12, 12, 4, unit_affine);
    for (size_t i = 1; i < 11; i++) {
        volume_set(&volume, i, i, 1, true);
    }
    extract(&volume, 20, &extracted);
    assert_int_equal(extracted.changed, 0);
    assert_within(extracted.voxel_volume, 10.0, 1e-9);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

static bool in_torus(const double point[3], const void *shape)
{
    const double *radii = shape;
    double r = sqrt(point[0] * point[0] + point[1] * point[1]) - radii[0];

    return r * r + point[2] * point[2] <= radii[1] * radii[1];
}

static void a_torus_is_mended_by_few_voxels(void **state)
{
    static const double wide[2] = {12, 3}, narrow[2] = {6, 5.2};
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_around(&volume, 17, 1.0);
    volume_fill(&volume, in_torus, wide);
    extract(&volume, 20, &extracted);
    assert_in_range(extracted.removed, 20, 45); /* a cross-section has 9 pi = 28 */
    assert_int_equal(extracted.added, 0);
    srnf_extracted_clear(&extracted);
    volume_fill(&volume, in_torus, narrow);
    extract(&volume, 20, &extracted);
    assert_in_range(extracted.added, 1, 12); /* a hole of radius .8 */
    assert_int_equal(extracted.removed, 0);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

static void strict_refuses_to_change(void **state)
{
    struct srnf_extract_options options = {.smoothing = 10, .strict = true};
    struct srnf_error error;
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 8, 8, 8, unit_affine);
    BLOCK(&volume, true, 2, 2, 2, 6, 6, 6);
    assert_int_equal(srnf_extract(&volume, &label, 1, &options, NULL, &extracted, &error), SRNF_OK);
    srnf_extracted_clear(&extracted);
    volume_set(&volume, 0, 0, 0, true);
    assert_int_equal(srnf_extract(&volume, &label, 1, &options, NULL, &extracted, &error),
                     SRNF_EGENUS);
    assert_non_null(strstr(error.message, "1 voxels at 1 places"));
    assert_null(extracted.mesh.vertices);
    srnf_volume_clear(&volume);
}

/* ---- Geometry -------------------------------------------------------------------------------- */

/* Mean distance of the vertices from the ellipsoid, to first order. */
static double distance_from(const struct ellipsoid *e, const struct srnf_mesh *mesh)
{
    double sum = 0.0;

    for (size_t v = 0; v < mesh->n_vertices; v++) {
        double f = -1.0, g = 0.0;

        for (size_t k = 0; k < 3; k++) {
            double r = e->radius[k], d = (mesh->vertices[3 * v + k] - e->center[k]) / r;

            f += d * d;
            g += d * d / (r * r);
        }
        sum += fabs(f) / (2.0 * sqrt(g));
    }
    return sum / (double)mesh->n_vertices;
}

static void volume_and_distance_converge(void **state)
{
    static const struct ellipsoid shapes[2] = {{{10, 10, 10}, {.1, .2, -.3}},
                                               {{14, 9, 6}, {.1, .2, -.3}}};
    (void)state;

    for (size_t s = 0; s < 2; s++) {
        const double *r = shapes[s].radius;
        double truth = 4.18879020478639 * r[0] * r[1] * r[2];

        for (double h = 2.0; h >= 0.5; h /= 2.0) {
            struct srnf_volume volume;
            struct srnf_extracted extracted;

            volume_around(&volume, 16, h);
            volume_fill(&volume, in_ellipsoid, &shapes[s]);
            extract(&volume, 30, &extracted);
            assert_int_equal(extracted.changed, 0);
            assert_within(extracted.volume, truth, 0.006 * h * h * truth);
            assert_within(distance_from(&shapes[s], &extracted.mesh), 0.0, 0.09 * h);
            assert_true(extracted.max_offset < 0.05 * h);
            srnf_extracted_clear(&extracted);
            srnf_volume_clear(&volume);
        }
    }
}

/* Voxels of 0.7 x 1.1 x 2.3 mm, turned, and reflected by the sign. */
static void oblique_affine(double affine[12], double sign)
{
    static const double axes[9] = {0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6};
    const double size[3] = {0.7 * sign, 1.1, 2.3};

    for (size_t r = 0; r < 3; r++) {
        affine[4 * r + 3] = 100.0 * (double)r - 30.0;
        for (size_t k = 0; k < 3; k++) {
            affine[4 * r + k] = axes[3 * r + k] * size[k];
            affine[4 * r + 3] -= affine[4 * r + k] * 20.0;
        }
    }
}

static void affines_are_applied_and_outward(void **state)
{
    const struct ellipsoid ball = {{9, 9, 9}, {-30, 70, 170}};
    (void)state;

    for (int turn = 0; turn < 2; turn++) {
        struct srnf_volume volume;
        struct srnf_extracted extracted;
        double affine[12];

        oblique_affine(affine, turn ? -1.0 : 1.0);
        volume_make(&volume, 41, 41, 41, affine);
        volume_fill(&volume, in_ellipsoid, &ball);
        extract(&volume, 30, &extracted);
        assert_true(extracted.volume > 0.0); /* outward, also where the affine reflects */
        assert_within(extracted.volume, 3053.63, 60.0); /* voxels of 2.3 mm */
        assert_within(distance_from(&ball, &extracted.mesh), 0.0, 0.15);
        assert_false(extracted.at_border);
        srnf_extracted_clear(&extracted);
        srnf_volume_clear(&volume);
    }
}

static void a_label_at_the_border_is_closed_there(void **state)
{
    const struct ellipsoid ball = {{6, 6, 6}, {0, 0, 0}};
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 8, 8, 8, unit_affine);
    volume_fill(&volume, in_ellipsoid, &ball);
    extract(&volume, 30, &extracted);
    assert_true(extracted.at_border);
    assert_int_equal(extracted.changed, 0);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

static void labels_are_joined(void **state)
{
    static const int64_t both[2] = {VOLUME_LABEL, 9};
    struct srnf_volume volume;
    struct srnf_label *labels = srnf_alloc(2, sizeof *labels);
    struct srnf_extracted extracted;
    (void)state;

    assert_non_null(labels);
    volume_make(&volume, 12, 6, 6, unit_affine);
    BLOCK(&volume, true, 1, 1, 1, 11, 5, 5);
    for (size_t n = 0; n < 12 * 6 * 6; n++) {
        volume.voxels[n] = (uint16_t)(volume.voxels[n] * (n % 12 < 6 ? 1 : 2));
    }
    labels[0] = (struct srnf_label){.value = VOLUME_LABEL, .voxels = 80};
    labels[1] = (struct srnf_label){.value = 9, .voxels = 80};
    srnf_free(volume.labels);
    volume.labels = labels;
    volume.n_labels = 2;
    assert_int_equal(srnf_extract(&volume, both, 2, NULL, NULL, &extracted, NULL), SRNF_OK);
    assert_int_equal(extracted.voxels, 160);
    assert_within(extracted.volume, 160.0, 1e-6);
    srnf_extracted_clear(&extracted);
    assert_int_equal(srnf_extract(&volume, both + 1, 1, NULL, NULL, &extracted, NULL), SRNF_OK);
    assert_within(extracted.volume, 80.0, 1e-6);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

/* ---- Refusals -------------------------------------------------------------------------------- */

static void wrong_arguments_are_refused(void **state)
{
    static const int64_t absent = 8;
    struct srnf_extract_options options = {.smoothing = SRNF_SMOOTHING_PASSES_MAX + 1};
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    struct srnf_error error;
    (void)state;

    volume_make(&volume, 3, 3, 3, unit_affine);
    volume_set(&volume, 1, 1, 1, true);
    assert_int_equal(srnf_extract(&volume, &absent, 1, NULL, NULL, &extracted, &error),
                     SRNF_EINVAL);
    assert_non_null(strstr(error.message, "no voxels of label 8"));
    assert_int_equal(srnf_extract(&volume, &label, 0, NULL, NULL, &extracted, &error), SRNF_EINVAL);
    assert_int_equal(srnf_extract(&volume, &label, 1, &options, NULL, &extracted, &error),
                     SRNF_EINVAL);
    srnf_volume_clear(&volume);
}

/* A single voxel is smoothed less than asked for. */
static void what_is_thin_is_smoothed_less(void **state)
{
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    (void)state;

    volume_make(&volume, 3, 3, 3, unit_affine);
    volume_set(&volume, 1, 1, 1, true);
    extract(&volume, 200, &extracted);
    assert_true(extracted.smoothing < 200);
    assert_true(extracted.max_offset <= 0.75);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

static bool at_last(void *user)
{
    size_t *left = user;

    *left -= *left > 0;
    return *left == 0;
}

static void it_can_be_canceled_anywhere(void **state)
{
    const struct ellipsoid ball = {{6, 6, 6}, {8, 8, 8}};
    struct srnf_volume volume;
    struct srnf_extracted extracted;
    int status = SRNF_ECANCELED;
    (void)state;

    volume_make(&volume, 17, 17, 17, unit_affine);
    volume_fill(&volume, in_ellipsoid, &ball);
    for (size_t asked = 1; status == SRNF_ECANCELED; asked++) {
        size_t left = asked;
        struct srnf_context context = {.user = &left, .canceled = at_last};

        status = srnf_extract(&volume, &label, 1, NULL, &context, &extracted, NULL);
        assert_true(status == SRNF_OK || extracted.mesh.vertices == NULL);
        assert_true(asked < 100000);
    }
    assert_int_equal(status, SRNF_OK);
    srnf_extracted_clear(&extracted);
    srnf_volume_clear(&volume);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_voxels_give_genus_zero),
        cmocka_unit_test(every_pair_and_triple_of_a_block_is_closed),
        cmocka_unit_test(a_thin_handle_is_cut_where_it_is),
        cmocka_unit_test(a_thin_tunnel_is_filled),
        cmocka_unit_test(islands_and_cavities_are_counted_and_located),
        cmocka_unit_test(contacts_along_edges_stay),
        cmocka_unit_test(a_torus_is_mended_by_few_voxels),
        cmocka_unit_test(strict_refuses_to_change),
        cmocka_unit_test(volume_and_distance_converge),
        cmocka_unit_test(affines_are_applied_and_outward),
        cmocka_unit_test(a_label_at_the_border_is_closed_there),
        cmocka_unit_test(labels_are_joined),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(what_is_thin_is_smoothed_less),
        cmocka_unit_test(it_can_be_canceled_anywhere),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
