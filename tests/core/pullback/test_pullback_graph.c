/*
 * test_pullback_graph.c - the energy of a tree of surfaces against its definition, its gradient,
 * Hessian and Gauss-Newton product against differences and symmetry, its preconditioner against the
 * Laplacian, and the same bits on any number of threads.
 */
#include "pullbacks.h"

#define DEGREE 7
#define NODES ((size_t)8)
#define FREE ((size_t)5)
#define WEIGHT 3.0

/* Two chains and a fixed leaf meet in node 6, below the free root: 0 - 1 - 2 - 6, 3 - 4 - 6, 5 - 6,
   6 - 7; nodes 0, 3 and 5 are fixed. */
static const size_t parents[NODES] = {1, 2, 6, 4, 6, 6, 7, PULLBACK_ROOT};
static const bool fixed[NODES] = {true, false, false, true, false, true, false, false};

struct tree {
    struct shapes_surface s;
    struct pullback_graph *graph;
    double *f; /* [NODES][count] random stars */
    double *x; /* [FREE][count] the free ones */
    size_t n;  /* FREE count */
};

static void open_tree(struct tree *t, const struct srnf_context *context)
{
    shapes_open(&t->s, DEGREE);
    t->n = FREE * t->s.count;
    t->f = shapes_doubles(NODES * t->s.count);
    t->x = shapes_doubles(t->n);
    assert_int_equal(
        pullback_graph_create(&t->graph, t->s.sht, context, NODES, parents, fixed, WEIGHT),
        SRNF_OK);
    assert_int_equal(t->graph->free, FREE);
    for (size_t i = 0; i < NODES; i++) {
        shapes_fill_random_star(&t->s, i + 1, NULL);
        memcpy(t->f + i * t->s.count, t->s.f, t->s.count * sizeof(double));
    }
    for (size_t k = 0; k < FREE; k++) {
        memcpy(t->x + k * t->s.count, t->f + t->graph->free_node[k] * t->s.count,
               t->s.count * sizeof(double));
    }
    (void)pullback_graph_start(t->graph, t->f);
    pullback_graph_linearize(t->graph, t->x);
}

static void close_tree(struct tree *t)
{
    pullback_graph_destroy(t->graph);
    srnf_free(t->f);
    srnf_free(t->x);
    shapes_close(&t->s);
}

/* A random direction without translations, of the size of a surface's small change. */
static double *direction(const struct tree *t, uint64_t seed)
{
    struct test_random random = test_random_seed(seed);
    double *x = shapes_doubles(t->n);

    test_random_normals(&random, t->n, x);
    for (size_t i = 0; i < t->n; i++) {
        x[i] *= i % (t->s.count / 3) == 0 ? 0.0 : 0.1 / (1.0 + (double)(i % (t->s.count / 3)));
    }
    return x;
}

static double energy_at(struct tree *t, double step, const double *along)
{
    double *x = shapes_doubles(t->n);
    double energy;

    for (size_t i = 0; i < t->n; i++) {
        x[i] = t->x[i] + step * along[i];
    }
    energy = pullback_graph_try(t->graph, x);
    srnf_free(x);
    return energy;
}

static void energy_is_the_sum_over_edges(void **state)
{
    struct tree t;
    double sum = 0.0;
    (void)state;

    open_tree(&t, NULL);
    for (size_t i = 0; i + 1 < NODES; i++) {
        double d = pullback_chord(&t.s, t.f + i * t.s.count, t.f + parents[i] * t.s.count);

        sum += WEIGHT * d * d;
    }
    figure_below("energy, relative", fabs(pullback_graph_start(t.graph, t.f) / sum - 1.0), 1e-14);
    figure_below("of the free ones", fabs(pullback_graph_try(t.graph, t.x) / sum - 1.0), 1e-14);
    close_tree(&t);
}

static void gradient_and_hessian_are_those_of_the_energy(void **state)
{
    double errors[4];
    double bends[4];
    struct tree t;
    double *along;
    double *g;
    double *h;
    double slope;
    double bend;
    (void)state;

    open_tree(&t, NULL);
    along = direction(&t, 11);
    g = shapes_doubles(t.n);
    h = shapes_doubles(2 * t.n);
    pullback_graph_gradient(t.graph, g);
    slope = 2.0 * figure_dot(t.n, g, along);
    t.graph->base = t.x;
    t.graph->base_gradient = g;
    t.graph->displaced = h + t.n;
    pullback_graph_hessian(t.graph, along, h);
    bend = 2.0 * figure_dot(t.n, h, along);
    for (size_t k = 0; k < 4; k++) {
        double step = 0.2 / (double)(1U << k);
        double up = energy_at(&t, step, along);
        double down = energy_at(&t, -step, along);
        double middle = energy_at(&t, 0.0, along);

        errors[k] = fabs((up - down) / (2.0 * step) - slope) / fabs(slope);
        bends[k] = fabs((up - 2.0 * middle + down) / (step * step) - bend) / fabs(bend);
    }
    figure_order("slope against differences", 4, errors, 2.0, 2.0, 0.3, 1e-11, 2);
    figure_order("bend against differences", 4, bends, 2.0, 2.0, 0.5, 1e-6, 2);
    srnf_free(h);
    srnf_free(g);
    srnf_free(along);
    close_tree(&t);
}

/* The quadratic form of the product, by the differentials at both ends of each edge. */
static double edge_form(const struct tree *t, const double *x)
{
    double *images = shapes_doubles(NODES * 3 * t->s.points);
    double sum = 0.0;

    for (size_t k = 0; k < FREE; k++) {
        size_t i = t->graph->free_node[k];

        srnf_field_differential(t->s.sht, t->f + i * t->s.count, x + k * t->s.count,
                                images + i * 3 * t->s.points, t->s.workspace);
    }
    for (size_t i = 0; i + 1 < NODES; i++) {
        double d = pullback_apart(&t->s, images + i * 3 * t->s.points,
                                  images + parents[i] * 3 * t->s.points);

        sum += WEIGHT * d * d;
    }
    srnf_free(images);
    return sum;
}

/* out = (Lap x D) x, entry by entry. */
static void laplacian(const struct tree *t, const double *x, double *out)
{
    for (size_t k = 0; k < FREE; k++) {
        const struct pullback_node *node = &t->graph->node[t->graph->free_node[k]];

        for (size_t i = 0; i < t->s.count; i++) {
            double value = node->degree * x[k * t->s.count + i];

            for (size_t l = 0; l < FREE; l++) {
                size_t a = t->graph->free_node[k];
                size_t b = t->graph->free_node[l];

                value -= parents[a] == b || parents[b] == a ? x[l * t->s.count + i] : 0.0;
            }
            out[k * t->s.count + i] = WEIGHT * t->graph->diagonal[i] * value;
        }
    }
}

static void product_is_symmetric_and_gauss_newton(void **state)
{
    struct tree t;
    double *x;
    double *y;
    double *ax;
    double *ay;
    (void)state;

    open_tree(&t, NULL);
    x = direction(&t, 21);
    y = direction(&t, 22);
    ax = shapes_doubles(t.n);
    ay = shapes_doubles(t.n);
    t.graph->lambda = 0.0;
    pullback_graph_product(t.graph, x, ax);
    pullback_graph_product(t.graph, y, ay);
    figure_below("asymmetry", fabs(figure_dot(t.n, ax, y) / figure_dot(t.n, x, ay) - 1.0), 1e-12);
    figure_below("quadratic form", fabs(figure_dot(t.n, ax, x) / edge_form(&t, x) - 1.0), 1e-12);
    t.graph->lambda = 0.3;
    pullback_graph_product(t.graph, x, ay);
    laplacian(&t, x, y);
    for (size_t i = 0; i < t.n; i++) {
        ax[i] += 0.3 * y[i];
    }
    figure_below("damping", compare_difference(t.n, ax, ay), 1e-12 * figure_norm(t.n, ay));
    srnf_free(ay);
    srnf_free(ax);
    srnf_free(y);
    srnf_free(x);
    close_tree(&t);
}

static void preconditioner_inverts_the_laplacian(void **state)
{
    struct tree t;
    double *r;
    double *z;
    double *back;
    (void)state;

    open_tree(&t, NULL);
    r = direction(&t, 31);
    z = shapes_doubles(t.n);
    back = shapes_doubles(t.n);
    pullback_graph_precondition(t.graph, r, z);
    laplacian(&t, z, back);
    figure_below("Lap x D after P", compare_difference(t.n, r, back), 1e-14);
    srnf_free(back);
    srnf_free(z);
    srnf_free(r);
    close_tree(&t);
}

static void bits_do_not_depend_on_threads(void **state)
{
    double *first = NULL;
    double energy = 0.0;
    (void)state;

    for (size_t k = 0; k < GROUP_SPREADS; k++) {
        struct group_watch watch;
        struct srnf_context context = group_context(&watch, group_threads[k]);
        double *out;
        double *x;
        struct tree t;

        open_tree(&t, &context);
        x = direction(&t, 41);
        out = shapes_doubles(2 * t.n);
        pullback_graph_gradient(t.graph, out);
        pullback_graph_product(t.graph, x, out + t.n);
        if (k == 0) {
            energy = pullback_graph_try(t.graph, t.x);
            first = out;
        } else {
            assert_true(energy == pullback_graph_try(t.graph, t.x));
            assert_memory_equal(first, out, 2 * t.n * sizeof(double));
            srnf_free(out);
        }
        srnf_free(x);
        close_tree(&t);
    }
    srnf_free(first);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_is_the_sum_over_edges),
        cmocka_unit_test(gradient_and_hessian_are_those_of_the_energy),
        cmocka_unit_test(product_is_symmetric_and_gauss_newton),
        cmocka_unit_test(preconditioner_inverts_the_laplacian),
        cmocka_unit_test(bits_do_not_depend_on_threads),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    openblas_set_num_threads(1);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
