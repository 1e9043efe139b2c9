/*
 * test_field.c - the SRNF of a surface, its differential, the energy and its derivative, and the
 * measures of a surface: known values, symmetries, adjointness, and derivatives against
 * differences.
 */
#include "core/figures.h"

#define PI 3.14159265358979323846
#define AXES 3

struct fixture {
    struct shapes_surface s;
    double *w, *y, *out, *gradient, *moved;
};

/* A random displacement of the size of f, smoother than white, and a random field. */
static void open_fixture(struct fixture *x, const char *name, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    struct shapes_surface *s = &x->s;
    double factor;

    shapes_open_case(s, shapes_find(name));
    x->w = shapes_doubles(s->count);
    x->y = shapes_doubles(3 * s->points);
    x->out = shapes_doubles(3 * s->points);
    x->gradient = shapes_doubles(s->count);
    x->moved = shapes_doubles(s->count);
    for (size_t l = 0; l <= s->degree; l++) {
        for (size_t i = l * l; i < (l + 1) * (l + 1); i++) {
            for (size_t c = 0; c < 3; c++) {
                x->w[c * s->each + i] =
                    test_random_normal(&random) / ((double)(l + 1) * (double)(l + 1));
            }
        }
    }
    factor = figure_norm(s->count, s->f) / figure_norm(s->count, x->w);
    for (size_t i = 0; i < s->count; i++) {
        x->w[i] *= factor;
    }
    test_random_normals(&random, 3 * s->points, x->y);
}

static void close_fixture(struct fixture *x)
{
    srnf_free(x->moved);
    srnf_free(x->gradient);
    srnf_free(x->out);
    srnf_free(x->y);
    srnf_free(x->w);
    shapes_close(&x->s);
}

static void add(size_t n, double factor, const double *w, const double *f, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = f[i] + factor * w[i];
    }
}

/* ---- Known values ---------------------------------------------------------------------------- */

/* f = A e with A = diag(a, b, c): n = (b c e_x, a c e_y, a b e_z). */
static void ellipsoids_have_their_field(void **state)
{
    const double axes[][AXES] = {{1, 1, 1}, {2.5, 2.5, 2.5}, {1, 1.3, 1.7}, {0.2, 1, 3}};
    struct shapes_surface s;
    double worst = 0.0;
    double volume = 0.0;
    (void)state;

    shapes_open(&s, 15);
    for (size_t k = 0; k < sizeof axes / sizeof axes[0]; k++) {
        const double *a = axes[k];
        const size_t order[AXES] = {3, 1, 2};
        struct srnf_surface_measures measures;

        memset(s.f, 0, s.count * sizeof *s.f);
        for (size_t c = 0; c < AXES; c++) {
            s.f[c * s.each + order[c]] = a[c] * sqrt(4.0 * PI / 3.0);
        }
        shapes_update(&s);
        for (size_t i = 0; i < s.points; i++) {
            size_t row = i / s.grid->n_phi;
            double phi = 2.0 * PI * (double)(i % s.grid->n_phi) / (double)s.grid->n_phi;
            double sine = s.grid->sin_theta[row];
            double n[AXES] = {a[1] * a[2] * sine * cos(phi), a[0] * a[2] * sine * sin(phi),
                              a[0] * a[1] * s.grid->cos_theta[row]};
            double root = sqrt(figure_norm(AXES, n));

            for (size_t c = 0; c < AXES; c++) {
                worst = compare_max(worst, fabs(s.q[c * s.points + i] - n[c] / root));
            }
        }
        srnf_surface_measure(s.sht, s.f, &measures, s.workspace);
        volume = compare_max(volume,
                             fabs(measures.volume / (4.0 * PI / 3.0 * a[0] * a[1] * a[2]) - 1.0));
    }
    figure_below("field of four ellipsoids, largest error", worst, 1e-14);
    figure_below("volume of four ellipsoids, relative error", volume, 1e-13);
    shapes_close(&s);
}

/* Area of the spheroid (1, 1, c) against its formula, on ever finer grids: the integrand is
   analytic, so the error falls geometrically. */
static void area_converges_with_the_grid(void **state)
{
    const size_t rows[] = {6, 9, 12, 15, 18, 21, 24};
    const size_t count = sizeof rows / sizeof rows[0];
    double c = 1.7;
    double eccentricity = sqrt(1.0 - 1.0 / (c * c));
    double truth = 2.0 * PI * (1.0 + c / eccentricity * asin(eccentricity));
    double errors[sizeof rows / sizeof rows[0]];
    (void)state;

    printf("# area of a spheroid, relative error with rows:");
    for (size_t k = 0; k < count; k++) {
        struct srnf_sht *sht;
        double f[3 * 25] = {0};
        struct srnf_surface_measures measures;
        double *workspace;
        double *q;
        double integral;

        assert_int_equal(srnf_sht_create(&sht, 4, SRNF_GRID_GAUSS_LEGENDRE, rows[k], 0), SRNF_OK);
        workspace = shapes_doubles(srnf_surface_workspace_size(sht) / sizeof(double) + 1);
        q = shapes_doubles(3 * rows[k] * 2 * rows[k]);
        f[3] = f[25 + 1] = sqrt(4.0 * PI / 3.0);
        f[50 + 2] = c * sqrt(4.0 * PI / 3.0);
        srnf_surface_measure(sht, f, &measures, workspace);
        srnf_field(sht, f, q, workspace);
        integral = srnf_inner_product(srnf_sht_grid(sht), q, q);
        assert_true(fabs(integral / measures.area - 1.0) < 1e-14);
        errors[k] = fabs(integral / truth - 1.0);
        printf(" %zu: %.1e", rows[k], errors[k]);
        srnf_free(q);
        srnf_free(workspace);
        srnf_sht_destroy(sht);
    }
    printf("\n");
    for (size_t k = 1; k < count; k++) {
        assert_true(errors[k] < 0.2 * errors[k - 1] || errors[k] < 1e-14);
    }
    assert_true(errors[count - 1] < 1e-11);
}

/* The measures of a surface and of its triangulation are the same up to the facets' h^2. */
static void measures_agree_with_a_triangulation(void **state)
{
    struct test_random random = test_random_seed(5);
    const size_t frequencies[] = {16, 32, 64};
    double areas[3];
    double volumes[3];
    double centroids[3];
    struct shapes_surface s;
    struct srnf_surface_measures measures;
    (void)state;

    shapes_open_case(&s, shapes_find("bumpy star"));
    shapes_move(&s, &random);
    srnf_surface_measure(s.sht, s.f, &measures, s.workspace);
    for (size_t k = 0; k < 3; k++) {
        struct srnf_mesh mesh = {0};
        struct srnf_mesh_report report;

        assert_int_equal(srnf_surface_triangulate(s.degree, s.f, frequencies[k], &mesh, NULL),
                         SRNF_OK);
        assert_int_equal(srnf_mesh_prepare(&mesh, false, &report), SRNF_OK);
        areas[k] = fabs(report.area - measures.area);
        volumes[k] = fabs(report.volume - measures.volume) / measures.volume;
        for (size_t c = 0; c < 3; c++) {
            report.centroid[c] -= measures.centroid[c];
        }
        centroids[k] = figure_norm(3, report.centroid);
        srnf_mesh_clear(&mesh);
    }
    figure_order("area of triangulations", 3, areas, 2.0, 2.0, 0.1, 0.0, 2);
    figure_order("volume of triangulations", 3, volumes, 2.0, 2.0, 0.1, 0.0, 2);
    figure_order("centroid of triangulations", 3, centroids, 2.0, 2.0, 0.2, 0.0, 2);
    shapes_close(&s);
}

/* ---- Symmetries ------------------------------------------------------------------------------ */

static void energy_is_invariant(void **state)
{
    struct test_random random = test_random_seed(6);
    struct fixture x;
    struct shapes_surface *s = &x.s;
    double rotation[9];
    double before;
    double after;
    double *gradient;
    (void)state;

    open_fixture(&x, "5 arms", 6);
    gradient = shapes_doubles(s->count);
    add(s->count, 0.1, x.w, s->f, s->f);
    before = srnf_energy(s->sht, s->f, s->q, x.gradient, s->workspace);
    for (size_t k = 0; k < 4; k++) {
        shapes_random_rotation(&random, rotation);
        memcpy(x.moved, s->f, s->count * sizeof *s->f);
        memcpy(x.out, s->q, 3 * s->points * sizeof *s->q);
        shapes_rotate(rotation, s->each, x.moved);
        shapes_rotate(rotation, s->points, x.out);
        for (size_t c = 0; c < 3; c++) {
            x.moved[c * s->each] += 10.0 * test_random_normal(&random);
        }
        after = srnf_energy(s->sht, x.moved, x.out, gradient, s->workspace);
        assert_true(fabs(after / before - 1.0) < 1e-13);
        memcpy(x.moved, x.gradient, s->count * sizeof *s->f);
        shapes_rotate(rotation, s->each, x.moved);
        assert_true(compare_difference(s->count, x.moved, gradient) <
                    1e-13 * figure_norm(s->count, gradient));
    }
    printf("# E = %.17g, moved %.17g\n", before, after);
    srnf_free(gradient);
    close_fixture(&x);
}

/* Q(-f) = Q(f) and Q(c f) = c Q(f); both are exact where the factor is a power of two. */
static void field_is_homogeneous(void **state)
{
    const double factors[] = {-1.0, 4.0, 0x1p-20, 3.7, 1e-12, 1e12};
    struct fixture x;
    struct shapes_surface *s = &x.s;
    (void)state;

    open_fixture(&x, "7 arms", 7);
    for (size_t k = 0; k < sizeof factors / sizeof factors[0]; k++) {
        double c = factors[k];

        for (size_t i = 0; i < s->count; i++) {
            x.moved[i] = c * s->f[i];
        }
        srnf_field(s->sht, x.moved, x.out, s->workspace);
        for (size_t i = 0; i < 3 * s->points; i++) {
            double limit = k < 3 ? 0.0 : 1e-13 * fabs(c);

            assert_true(fabs(x.out[i] - fabs(c) * s->q[i]) <= limit);
        }
    }
    close_fixture(&x);
}

/* ---- The differential ------------------------------------------------------------------------ */

static void differential_is_linear(void **state)
{
    struct fixture x;
    struct shapes_surface *s = &x.s;
    double *one;
    double *two;
    (void)state;

    open_fixture(&x, "3 arms", 8);
    one = shapes_doubles(3 * s->points);
    two = shapes_doubles(3 * s->points);
    srnf_field_differential(s->sht, s->f, x.w, one, s->workspace);
    srnf_field_differential(s->sht, s->f, s->f, two, s->workspace);
    assert_true(compare_difference(3 * s->points, two, s->q) < 1e-13); /* Euler: Q_* f = Q(f) */
    for (size_t i = 0; i < s->count; i++) {
        x.moved[i] = 0.3 * x.w[i] - 1.7 * s->f[i];
    }
    srnf_field_differential(s->sht, s->f, x.moved, x.out, s->workspace);
    for (size_t i = 0; i < 3 * s->points; i++) {
        one[i] = 0.3 * one[i] - 1.7 * two[i];
    }
    figure_below("linearity of Q_*", compare_difference(3 * s->points, one, x.out), 1e-13);
    for (size_t c = 0; c < 3; c++) { /* translations are its null space */
        memset(x.moved, 0, s->count * sizeof *x.moved);
        x.moved[c * s->each] = 1.0;
        srnf_field_differential(s->sht, s->f, x.moved, x.out, s->workspace);
        assert_true(figure_norm(3 * s->points, x.out) == 0.0);
    }
    srnf_free(two);
    srnf_free(one);
    close_fixture(&x);
}

/* With q = Q(f) - y the derivative of E is 2 Q_*' y, so half of it against w is <Q_* w, y>. */
static void differential_and_gradient_are_adjoint(void **state)
{
    const char *const names[] = {"bumpy star", "bent capsule", "12 arms"};
    (void)state;

    for (size_t k = 0; k < 3; k++) {
        struct fixture x;
        struct shapes_surface *s = &x.s;
        double left;
        double right;
        double size;

        open_fixture(&x, names[k], 9 + k);
        srnf_field_differential(s->sht, s->f, x.w, x.out, s->workspace);
        left = srnf_inner_product(s->grid, x.out, x.y);
        size =
            sqrt(srnf_inner_product(s->grid, x.out, x.out) * srnf_inner_product(s->grid, x.y, x.y));
        for (size_t i = 0; i < 3 * s->points; i++) {
            s->q[i] -= x.y[i];
        }
        (void)srnf_energy(s->sht, s->f, s->q, x.gradient, s->workspace);
        right = 0.5 * figure_dot(s->count, x.gradient, x.w);
        figure_below("<Q_* w, y> - <w, Q_*' y>, relative", fabs(left - right) / size, 1e-14);
        close_fixture(&x);
    }
}

#define WIDTHS 14

/* Central differences: the error falls with the square of the width until rounding. */
static void derivatives_match_differences(void **state)
{
    static const struct {
        const char *name;
        double width;
    } cases[] = {{"bumpy star", 2e-2}, {"bent capsule", 2e-2}, {"5 arms", 2e-3}};
    (void)state;

    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        double field_errors[WIDTHS];
        double energy_errors[WIDTHS];
        struct fixture x;
        struct shapes_surface *s = &x.s;
        double *back;
        double slope;
        double size;

        open_fixture(&x, cases[k].name, 20 + k);
        back = shapes_doubles(3 * s->points);
        srnf_field_differential(s->sht, s->f, x.w, x.y, s->workspace);
        size = sqrt(srnf_inner_product(s->grid, x.y, x.y));
        for (size_t i = 0; i < 3 * s->points; i++) { /* a target that is not Q(f) */
            s->q[i] *= 0.5;
        }
        (void)srnf_energy(s->sht, s->f, s->q, x.gradient, s->workspace);
        slope = figure_dot(s->count, x.gradient, x.w);
        for (size_t i = 0; i < WIDTHS; i++) {
            double h = cases[k].width / (double)(1 << i);
            double ahead;
            double behind;

            add(s->count, h, x.w, s->f, x.moved);
            srnf_field(s->sht, x.moved, x.out, s->workspace);
            ahead = srnf_energy(s->sht, x.moved, s->q, NULL, s->workspace);
            add(s->count, -h, x.w, s->f, x.moved);
            srnf_field(s->sht, x.moved, back, s->workspace);
            behind = srnf_energy(s->sht, x.moved, s->q, NULL, s->workspace);
            for (size_t j = 0; j < 3 * s->points; j++) {
                x.out[j] = (x.out[j] - back[j]) / (2.0 * h) - x.y[j];
            }
            field_errors[i] = sqrt(srnf_inner_product(s->grid, x.out, x.out)) / size;
            energy_errors[i] = fabs((ahead - behind) / (2.0 * h) / slope - 1.0);
        }
        printf("# %s\n", cases[k].name);
        figure_order("Q_*", WIDTHS, field_errors, 2.0, 2.0, 0.1, 1e-9, 4);
        figure_order("derivative of E", WIDTHS, energy_errors, 2.0, 2.0, 0.1, 1e-8, 4);
        srnf_free(back);
        close_fixture(&x);
    }
}

/* ---- Where n = 0 ----------------------------------------------------------------------------- */

static bool finite_everywhere(struct fixture *x)
{
    struct shapes_surface *s = &x->s;
    struct srnf_surface_measures measures;
    double energy;

    srnf_field(s->sht, x->moved, x->out, s->workspace);
    if (!compare_finite(3 * s->points, x->out)) {
        return false;
    }
    srnf_field_differential(s->sht, x->moved, x->w, x->out, s->workspace);
    energy = srnf_energy(s->sht, x->moved, s->q, x->gradient, s->workspace);
    srnf_surface_measure(s->sht, x->moved, &measures, s->workspace);
    return compare_finite(3 * s->points, x->out) && compare_finite(s->count, x->gradient) &&
           isfinite(energy) && isfinite(measures.area) && compare_finite(3, measures.centroid);
}

static void degenerate_points_are_harmless(void **state)
{
    struct fixture x;
    struct shapes_surface *s = &x.s;
    double pinched;
    (void)state;

    open_fixture(&x, "bumpy star", 30);
    memset(x.moved, 0, s->count * sizeof *x.moved); /* a point */
    assert_true(finite_everywhere(&x));
    assert_true(figure_norm(3 * s->points, x.out) == 0.0); /* no differential there */
    assert_true(figure_norm(s->count, x.gradient) == 0.0);
    memcpy(x.moved, s->f, s->each * sizeof *s->f); /* a line */
    assert_true(finite_everywhere(&x));
    srnf_field(s->sht, x.moved, x.out, s->workspace);
    assert_true(figure_norm(3 * s->points, x.out) == 0.0);
    memcpy(x.moved, s->f, 2 * s->each * sizeof *s->f); /* a plane */
    assert_true(finite_everywhere(&x));
    for (size_t k = 0; k < 60; k++) { /* close to a point, down to underflow */
        for (size_t i = 0; i < s->count; i++) {
            x.moved[i] = s->f[i] * pow(10.0, -5.0 * (double)k);
        }
        assert_true(finite_everywhere(&x));
    }
    close_fixture(&x);

    /* (e_x, e_y, e_z^3) pinches the whole equator, which is a row of the grid for degree 14;
       e_z^3 = 0.6 e_z + 0.4 P_3(e_z). */
    shapes_open(s, 14);
    assert_true(s->grid->n_theta % 2 == 1);
    x.w = shapes_doubles(s->count);
    x.out = shapes_doubles(3 * s->points);
    x.gradient = shapes_doubles(s->count);
    x.moved = shapes_doubles(s->count);
    x.y = NULL;
    x.moved[3] = x.moved[s->each + 1] = sqrt(4.0 * PI / 3.0);
    x.moved[2 * s->each + 2] = 0.6 * sqrt(4.0 * PI / 3.0);
    x.moved[2 * s->each + 12] = 0.4 * sqrt(4.0 * PI / 7.0);
    x.w[2 * s->each + 6] = 1.0;
    srnf_field(s->sht, x.moved, s->q, s->workspace);
    pinched = fabs(s->q[s->grid->n_theta / 2 * s->grid->n_phi]);
    figure_below("|q| on a pinched equator", pinched, 1e-7);
    assert_true(finite_everywhere(&x));
    close_fixture(&x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ellipsoids_have_their_field),
        cmocka_unit_test(area_converges_with_the_grid),
        cmocka_unit_test(measures_agree_with_a_triangulation),
        cmocka_unit_test(energy_is_invariant),
        cmocka_unit_test(field_is_homogeneous),
        cmocka_unit_test(differential_is_linear),
        cmocka_unit_test(differential_and_gradient_are_adjoint),
        cmocka_unit_test(derivatives_match_differences),
        cmocka_unit_test(degenerate_points_are_harmless),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
