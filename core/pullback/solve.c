/*
 * solve.c - the minimum of the energy of a tree of surfaces: path-straightening, and the
 * Karcher mean, as one nonlinear least-squares problem (see graph.c).
 *
 * Each step solves (A + lambda Lap x D) d = -g by conjugate gradients with the preconditioner P,
 * and goes as far along d as the energy falls, shortened by 0.4 up to six times; a step refused at
 * all lengths is solved again with a larger lambda. The measure of the gradient is relative and
 * free of scale, sqrt(<g, P g> / E): to within the condition of A, the square root of the part of E
 * that is still to be gained.
 *
 * That converges as fast as the straightened path is flat, which is enough for the energy. Where a
 * small gradient is asked for, the last steps are Newton's, with the whole Hessian by differences
 * of gradients: a product of it costs the same two transforms, and the gradient falls to 1e-10 and
 * below in two or three steps. The logarithm needs that, since errors of the path grow on the way
 * back by the exponential.
 *
 * Near the minimum E has no digits left to tell one step from the next, long before the gradient
 * is at rounding. Where a small gradient is asked for, a step may therefore keep E within its
 * rounding, as long as the gradient falls.
 */
#include "pullback.h"

#include <math.h>

#define LAMBDA 1e-6
#define LAMBDA_FACTOR 100.0
#define LAMBDA_REFUSED 1e-4
#define LAMBDA_DOWN 0.1
#define LAMBDA_MAX 1e8
#define SHORTER 0.4
#define SHORTENED ((size_t)6)
#define INNER_TOLERANCE 0.05
#define INNER_CAP ((size_t)40)
#define NEWTON_GRADIENT 1e-3
#define NEWTON_TOLERANCE 1e-4
#define NEWTON_CAP ((size_t)300)
#define ROUNDING 1e-12  /* of E: what a sum over a grid is known to, with room to spare */
#define ZERO 1e-28      /* of ||q||^2 for each edge: the square of rounding, with room to spare */
#define GAIN_SEEN 1e-10 /* part of E that is well above its rounding */
#define BETTER 0.9      /* what a step must bring the gradient below, of the best so far */
#define STALLS 3        /* steps in a row without a better gradient */

struct minimize {
    struct pullback_graph *graph;
    struct pullback_solve *solve;
    size_t n;
    double *memory;
    double *x, *candidate, *gradient, *residual, *step, *inner;
    double zero; /* an energy of nothing but rounding */
    double gain; /* part of the energy that the last step took away */
    double best; /* gradient */
    size_t stalls;
};

/* Copies the free surfaces between f and x. */
static void gather(const struct pullback_graph *graph, const double *f, double *x)
{
    for (size_t k = 0; k < graph->free; k++) {
        linear_copy(graph->count, f + graph->free_node[k] * graph->count, x + k * graph->count);
    }
}

static void scatter(const struct pullback_graph *graph, const double *x, double *f)
{
    for (size_t k = 0; k < graph->free; k++) {
        linear_copy(graph->count, x + k * graph->count, f + graph->free_node[k] * graph->count);
    }
}

/* Gradient and its relative size. */
static void differentiate(struct minimize *m)
{
    pullback_graph_gradient(m->graph, m->gradient);
    pullback_graph_precondition(m->graph, m->gradient, m->residual);
    m->solve->gradient_left =
        m->solve->energy > 0.0
            ? sqrt(fmax(0.0, linear_dot(m->n, m->gradient, m->residual)) / m->solve->energy)
            : 0.0;
}

/* The step by the Hessian or by its Gauss-Newton part. */
static void solve_step(struct minimize *m, bool newton)
{
    struct linear_problem problem = {.n = m->n,
                                     .product =
                                         newton ? pullback_graph_hessian : pullback_graph_product,
                                     .precondition = pullback_graph_precondition,
                                     .argument = m->graph,
                                     .tolerance = INNER_TOLERANCE,
                                     .cap = newton ? NEWTON_CAP : INNER_CAP,
                                     .context = m->graph->context};
    struct linear_figures figures;

    if (newton) {
        problem.tolerance = fmax(NEWTON_TOLERANCE, fmin(INNER_TOLERANCE, m->solve->gradient_left));
    }
    m->graph->base = m->x;
    m->graph->base_gradient = m->gradient;
    m->graph->displaced = m->candidate;
    linear_copy(m->n, m->gradient, m->residual);
    linear_scale(m->n, -1.0, m->residual);
    (void)linear_conjugate_gradients(&problem, m->residual, m->step, m->inner, &figures);
    if (newton) {
        pullback_graph_linearize(m->graph, m->x);
    }
}

/* Goes along the step; false when no length of it lowers the energy. */
static bool search_line(struct minimize *m, double *energy)
{
    double allowed = m->solve->gradient > 0.0 ? ROUNDING * m->solve->energy : 0.0;
    double length = 1.0;

    for (size_t k = 0; k <= SHORTENED; k++) {
        linear_copy(m->n, m->x, m->candidate);
        linear_axpy(m->n, length, m->step, m->candidate);
        *energy = pullback_graph_try(m->graph, m->candidate);
        if (*energy < m->solve->energy + allowed) {
            return true;
        }
        length *= SHORTER;
    }
    return false;
}

/* One accepted step; false when there is none. */
static bool advance(struct minimize *m, double *energy)
{
    struct pullback_graph *graph = m->graph;

    bool newton = m->solve->gradient > 0.0 && m->solve->gradient_left < NEWTON_GRADIENT;

    for (;;) {
        double *swap = m->x;

        if (srnf_is_canceled(graph->context)) {
            return false;
        }
        solve_step(m, newton);
        m->solve->steps++;
        if (search_line(m, energy)) {
            m->x = m->candidate;
            m->candidate = swap;
            pullback_graph_linearize(graph, m->x);
            graph->lambda = fmax(LAMBDA, LAMBDA_DOWN * graph->lambda);
            return true;
        }
        if (!newton) {
            graph->lambda = fmax(LAMBDA_FACTOR * graph->lambda, LAMBDA_REFUSED);
        }
        newton = false;
        if (graph->lambda > LAMBDA_MAX || m->solve->steps >= m->solve->max_steps) {
            return false;
        }
    }
}

static void tell(const struct minimize *m)
{
    const struct pullback_solve *solve = m->solve;
    double part = (double)solve->steps / ((double)solve->steps + 3.0);

    srnf_report_progress(m->graph->context,
                         solve->progress_from + part * (solve->progress_to - solve->progress_from),
                         solve->message);
}

/* Whether neither the gradient nor the energy falls any more. */
static bool stalled(struct minimize *m)
{
    bool better = m->solve->gradient_left < BETTER * m->best || m->gain > GAIN_SEEN;

    m->stalls = better ? 0 : m->stalls + 1;
    m->best = fmin(m->best, m->solve->gradient_left);
    return m->solve->gradient > 0.0 && m->stalls >= STALLS;
}

static double square(double x)
{
    return x * x;
}

static int iterate(struct minimize *m)
{
    struct pullback_solve *solve = m->solve;
    bool more = true;

    while (more && !solve->converged) {
        double energy = solve->energy;

        differentiate(m);
        if (srnf_is_canceled(m->graph->context)) {
            return SRNF_ECANCELED;
        }
        if (solve->energy <= m->zero || solve->gradient_left <= solve->gradient) {
            solve->converged = true;
            break;
        }
        if (solve->steps >= solve->max_steps || stalled(m)) {
            break;
        }
        more = advance(m, &energy);
        if (srnf_is_canceled(m->graph->context)) {
            return SRNF_ECANCELED;
        }
        if (!(solve->gradient > 0.0)) {
            double gain = more ? 1.0 - energy / solve->energy : square(solve->gradient_left);

            solve->converged = gain < solve->decrease;
        }
        m->gain = 1.0 - energy / solve->energy;
        solve->energy = energy;
        tell(m);
    }
    return SRNF_OK;
}

int pullback_minimize(struct pullback_graph *graph, double *f, struct pullback_solve *solve)
{
    struct minimize m = {.graph = graph, .solve = solve, .n = graph->free * graph->count};
    int status;

    m.best = HUGE_VAL;
    m.memory = srnf_alloc(8 * m.n, sizeof(double));
    if (!m.memory) {
        return SRNF_ENOMEM;
    }
    m.x = m.memory;
    m.candidate = m.memory + m.n;
    m.gradient = m.memory + 2 * m.n;
    m.residual = m.memory + 3 * m.n;
    m.step = m.memory + 4 * m.n;
    m.inner = m.memory + 5 * m.n;
    gather(graph, f, m.x);
    solve->steps = 0;
    solve->converged = false;
    solve->energy = pullback_graph_start(graph, f);
    if (!isfinite(solve->energy)) {
        srnf_free(m.memory);
        return graph->canceled ? SRNF_ECANCELED : SRNF_ENUMERIC;
    }
    m.zero = ZERO * graph->edge_weight * (double)graph->nodes *
             pointwise_norm2(graph->points, graph->weight, graph->node[0].q);
    pullback_graph_linearize(graph, m.x);
    graph->lambda = LAMBDA;
    status = iterate(&m);
    status = graph->canceled ? SRNF_ECANCELED : status;
    scatter(graph, m.x, f);
    srnf_free(m.memory);
    return status;
}
