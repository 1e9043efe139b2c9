/*
 * test_closed_form.c - the closed-form inverse of star-shaped surfaces in their radial
 * parameterization: exact for radii of degree L - 1 about any centre, and found wanting by its own
 * energy everywhere else.
 */
#include "core/figures.h"

#define PI 3.14159265358979323846

/* The largest |f - r e| over the grid, relative to the mean of r. f comes back without its
   centre. */
static double radius_error(struct shapes_surface *s, const double *f, const double *radius)
{
    double *r = shapes_doubles(4 * s->points);
    double *x = r + s->points;
    double mean = radius[0] / sqrt(4.0 * PI);
    double worst = 0.0;

    srnf_sht_synthesis(s->sht, 1, radius, r, s->workspace);
    srnf_sht_synthesis(s->sht, 3, f, x, s->workspace);
    for (size_t i = 0; i < s->points; i++) {
        size_t row = i / s->grid->n_phi;
        double phi = 2.0 * PI * (double)(i % s->grid->n_phi) / (double)s->grid->n_phi;
        double e[3] = {s->grid->sin_theta[row] * cos(phi), s->grid->sin_theta[row] * sin(phi),
                       s->grid->cos_theta[row]};

        for (size_t c = 0; c < 3; c++) {
            worst = compare_max(worst, fabs(x[c * s->points + i] - r[i] * e[c]));
        }
    }
    srnf_free(r);
    return worst / mean;
}

/* Random radii of degree L - 1, about the origin and about centres near and far. */
static void recovers_random_radii(void **state)
{
    const size_t degrees[] = {4, 15, 31, 63};
    (void)state;

    for (size_t k = 0; k < sizeof degrees / sizeof degrees[0]; k++) {
        struct shapes_surface s;
        double *radius;
        double *f;
        double worst = 0.0;
        double energy = 0.0;

        shapes_open(&s, degrees[k]);
        radius = shapes_doubles(s.each);
        f = shapes_doubles(s.count);
        for (uint64_t seed = 1; seed <= 4; seed++) {
            double relative;

            shapes_fill_random_star(&s, seed, radius);
            for (size_t c = 0; c < 3; c++) { /* f = r e + c; the last is far outside */
                s.f[c * s.each] += pow(10.0, (double)seed - 3.0) * (double)(c + 1);
            }
            shapes_update(&s);
            srnf_invert_closed_form(s.sht, s.q, f, &relative, s.workspace);
            worst = compare_max(worst, radius_error(&s, f, radius));
            energy = compare_max(energy, relative);
        }
        printf("# L = %zu, four random stars of area 1, moved: relative energy %.1e\n", degrees[k],
               energy);
        figure_below("largest error of r over its mean", worst, 1e-12);
        assert_true(energy <= 1e-24);
        srnf_free(f);
        srnf_free(radius);
        shapes_close(&s);
    }
}

/* The paper's example; its radius has degree 3. */
static void recovers_the_bumpy_star(void **state)
{
    const size_t degrees[] = {14, 15, 31};
    (void)state;

    for (size_t k = 0; k < sizeof degrees / sizeof degrees[0]; k++) {
        struct shapes_surface s;
        double *f;
        double relative;
        double error;

        shapes_open(&s, degrees[k]);
        shapes_fill(&s, shapes_bumpy, 0.0);
        f = shapes_doubles(s.count);
        srnf_invert_closed_form(s.sht, s.q, f, &relative, s.workspace);
        error = shapes_distance(s.degree, f, s.f);
        printf("# L = %zu: relative energy %.1e, surface error %.1e (the paper reports an energy "
               "of 5.7e-4)\n",
               degrees[k], relative, error);
        assert_true(relative <= 1e-24 && error <= 1e-12);
        srnf_free(f);
        shapes_close(&s);
    }
}

/* A closed form of something else must not look good: its energy tells. */
static void energy_tells_what_is_not_radial(void **state)
{
    (void)state;
    for (size_t k = 0; k < shapes_case_count; k++) {
        const struct shapes_case *which = &shapes_cases[k];
        struct shapes_surface s;
        double *f;
        double relative;
        double error;

        if (which->formula == shapes_bumpy ||
            (which->formula == shapes_ellipsoid && which->parameter == 1.0)) {
            continue;
        }
        shapes_open_case(&s, which);
        f = shapes_doubles(s.count);
        srnf_invert_closed_form(s.sht, s.q, f, &relative, s.workspace);
        error = shapes_distance(s.degree, f, s.f);
        printf("# %s, L = %zu: relative energy %.2e, surface error %.2e\n", which->name, s.degree,
               relative, error);
        assert_true(relative > 1e-2 && error > 1e-2);
        assert_true(compare_finite(s.count, f));
        srnf_free(f);
        shapes_close(&s);
    }
}

static void zero_has_no_energy_to_relate_to(void **state)
{
    struct shapes_surface s;
    double *f;
    double relative = 0.0;
    (void)state;

    shapes_open(&s, 8);
    f = shapes_doubles(s.count);
    srnf_invert_closed_form(s.sht, s.q, f, &relative, s.workspace);
    assert_true(relative == 1.0);
    assert_true(figure_norm(s.count, f) == 0.0);
    for (size_t i = 0; i < s.points; i++) { /* q points inwards everywhere: r = 0 */
        s.q[2 * s.points + i] = -s.grid->cos_theta[i / s.grid->n_phi];
    }
    srnf_invert_closed_form(s.sht, s.q, f, &relative, s.workspace);
    assert_true(figure_norm(s.count, f) < 1e-15);
    assert_true(fabs(relative - 1.0) < 1e-12);
    srnf_free(f);
    shapes_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recovers_random_radii),
        cmocka_unit_test(recovers_the_bumpy_star),
        cmocka_unit_test(energy_tells_what_is_not_radial),
        cmocka_unit_test(zero_has_no_energy_to_relate_to),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
