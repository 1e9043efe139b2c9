/*
 * registrations.h - what the tests of registration share: real surfaces and such, random warps of a
 * given strength, and the exact SRNF of a warped and turned surface.
 */
#ifndef TESTS_SHAPE_REGISTRATIONS_H
#define TESTS_SHAPE_REGISTRATIONS_H

#include "core/figures.h"
#include "registration/registration.h"
#include "support/bodies.h"
#include "support/meshes.h"

#include <stdlib.h>

#define REGISTRATIONS_LOCAL "tests/data/aal_subcortex/"

/* Encodes a mesh file, or a body of bodies.h, into a surface that is open; false, saying so, when
   there is none. */
static inline bool registrations_load(struct shapes_surface *s, const char *path)
{
    struct srnf_mesh mesh = {0};
    struct srnf_mesh_report report;
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded;
    struct srnf_error error = {0};
    int status;

    if (!bodies_load(path, &mesh)) {
        printf("# %s is not there\n", path);
        return false;
    }
    status = srnf_mesh_prepare(&mesh, false, &report);
    options.degree = s->degree;
    if (status == SRNF_OK) {
        status = srnf_encode(&mesh, &report, &options, NULL, &encoded, &error);
    }
    if (status != SRNF_OK) {
        fail_msg("%s: %s %s", path, srnf_strerror(status), error.message);
    }
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    shapes_update(s);
    return true;
}

/* A shape of shapes_cases, a body of bodies.h, or a file; false, saying so, when there is none. */
static inline bool registrations_open(struct shapes_surface *s, size_t degree, const char *what)
{
    shapes_open(s, degree);
    for (size_t k = 0; k < shapes_case_count; k++) {
        if (strcmp(shapes_cases[k].name, what) == 0) {
            shapes_fill(s, shapes_cases[k].formula, shapes_cases[k].parameter);
            return true;
        }
    }
    if (registrations_load(s, what)) {
        return true;
    }
    shapes_close(s);
    return false;
}

/* exp of a random field of degree 4, whose least Jacobian is about least, after a rotation. */
static inline void registrations_warp(struct test_random *random, double least,
                                      struct srnf_warp *warp)
{
    enum { DEGREE = 4, COUNT = (DEGREE + 1) * (DEGREE + 1), NODES = 1000 };
    static const double still[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double rotation[9];
    double base[2 * COUNT] = {0};
    double potentials[2 * COUNT];
    double *points = shapes_doubles(7 * NODES);
    double low = 0.0;
    double high = 2.0;

    memcpy(rotation, still, sizeof rotation);
    if (random) {
        shapes_random_rotation(random, rotation);
    }
    *warp = (struct srnf_warp){0};
    assert_int_equal(warp_append(warp, SRNF_WARP_ROTATION, 0, rotation), SRNF_OK);
    for (size_t k = 0; k < 2 && random; k++) {
        for (size_t l = 1; l <= DEGREE; l++) {
            for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
                base[k * COUNT + i] = test_random_normal(random) / (double)(l * l * (l + 1));
            }
        }
    }
    for (size_t i = 0; i < NODES; i++) {
        double z = 1.0 - (2.0 * (double)i + 1.0) / NODES;
        double phi = 2.399963229728653 * (double)i;

        points[3 * i] = sqrt(1.0 - z * z) * cos(phi);
        points[3 * i + 1] = sqrt(1.0 - z * z) * sin(phi);
        points[3 * i + 2] = z;
    }
    for (int step = 0; step < 30; step++) {
        struct srnf_warp trial = {0};
        double smallest = 1.0;

        for (size_t i = 0; i < 2 * (size_t)COUNT; i++) {
            potentials[i] = 0.5 * (low + high) * base[i];
        }
        assert_int_equal(warp_append(&trial, SRNF_WARP_EXP, DEGREE, potentials), SRNF_OK);
        assert_int_equal(
            srnf_warp_apply(&trial, NODES, points, points + 3 * NODES, points + 6 * NODES),
            SRNF_OK);
        for (size_t i = 0; i < NODES; i++) {
            smallest = compare_min(smallest, points[6 * NODES + i]);
        }
        *(smallest < least ? &high : &low) = 0.5 * (low + high);
        srnf_warp_clear(&trial);
    }
    for (size_t i = 0; i < 2 * (size_t)COUNT; i++) {
        potentials[i] = low * base[i];
    }
    if (least < 1.0) {
        assert_int_equal(warp_append(warp, SRNF_WARP_EXP, DEGREE, potentials), SRNF_OK);
    }
    srnf_free(points);
}

/* out = O sqrt(J) q o gamma on the working grid, exact. */
static inline void registrations_act(const struct shapes_surface *s, const struct srnf_warp *warp,
                                     const double rotation[9], double *out)
{
    size_t n = s->points;
    double *points = shapes_doubles(5 * n);
    double *jacobian = points + 3 * n;
    struct moving moving;
    struct samples samples;

    registration_nodes(s->grid, points, jacobian);
    assert_int_equal(srnf_warp_apply(warp, n, points, points, jacobian), SRNF_OK);
    assert_int_equal(moving_create(&moving, s->degree, s->f, s->degree, NULL), SRNF_OK);
    assert_int_equal(samples_create(&samples, n), SRNF_OK);
    moving_evaluate(&moving, points, &samples);
    for (size_t i = 0; i < 3 * n; i++) {
        out[i % 3 * n + i / 3] = sqrt(jacobian[i / 3]) * samples.q[i];
    }
    shapes_rotate(rotation, n, out);
    samples_clear(&samples);
    moving_clear(&moving);
    srnf_free(points);
}

/* out = O f o gamma, analysed to the degree of s: what an encoder would deliver. */
static inline void registrations_resample(const struct shapes_surface *s,
                                          const struct srnf_warp *warp, const double rotation[9],
                                          double *out)
{
    size_t n = s->points;
    double *points = shapes_doubles(4 * n);
    double *values = shapes_doubles(3 * n);

    registration_nodes(s->grid, points, points + 3 * n);
    assert_int_equal(srnf_warp_apply(warp, n, points, points, NULL), SRNF_OK);
    assert_int_equal(srnf_harmonics_at_points(s->degree, 3, s->f, n, points, values, NULL),
                     SRNF_OK);
    shapes_rotate(rotation, n, values);
    srnf_sht_analysis(s->sht, 3, values, out, s->workspace);
    srnf_free(values);
    srnf_free(points);
}

/* Registers or ends the test. */
static inline void registrations_run(const struct shapes_surface *template_surface,
                                     const double *template_q, const double *moving,
                                     const struct srnf_register_options *options,
                                     struct srnf_registration *out)
{
    struct srnf_error error = {0};
    int status = srnf_register(template_surface->sht, template_q ? NULL : template_surface->f,
                               template_q, moving, options, NULL, NULL, out, &error);

    if (status != SRNF_OK) {
        fail_msg("registration: %s, %s", srnf_strerror(status), error.message);
    }
}

#endif
