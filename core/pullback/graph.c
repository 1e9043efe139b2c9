/*
 * graph.c - the energy of a tree of surfaces in the pulled-back metric, and its
 * Gauss-Newton model.
 *
 *   E = w sum over edges (i, j) of ||Q(f_i) - Q(f_j)||^2
 *
 * over the free surfaces, the fixed ones given. A path with fixed ends is a chain; a Karcher mean
 * is a star of chains that meet in a free centre. With the Laplacian Lap of the tree, restricted to
 * the free nodes and multiplied by w,
 *
 *   half the gradient    g_i = J_i' W (Lap q)_i
 *   Gauss-Newton         A = J' (Lap x W) J, J = diag(J_i)
 *   preconditioner       P = Lap^-1 x D^-1, D = diag(1 + l (l + 1) / 4)
 *
 * Since J_i' W J_i is close to a multiple of D (levenberg.c), P leaves only the shapes themselves
 * in the condition. On a tree whose nodes come before their parents (tree.c) Lap^-1 is one
 * sweep to the root and one back, exact.
 *
 * Nodes are worked on in parallel, through the context. Each body writes what belongs to its node
 * alone, and sums over edges run in their order: the bits do not depend on the threads. Cost of a
 * product: one gradient transform and one adjoint for each free node.
 */
#include "pullback.h"

#include <math.h>

#define HESSIAN_STEP 1e-7 /* of ||f||: truncation and rounding then meet near 1e-7 */

/* ---- Parallel loops -------------------------------------------------------------------------- */

typedef void node_body(struct pullback_graph *graph, struct pullback_slot *slot,
                       struct pullback_node *node, size_t index);

struct loop {
    struct pullback_graph *graph;
    node_body *body;
    bool all; /* fixed nodes too */
};

static void run_slot(void *argument, size_t index)
{
    const struct loop *loop = argument;
    struct pullback_graph *graph = loop->graph;
    size_t count = loop->all ? graph->nodes : graph->free;

    for (size_t k = index; k < count && !srnf_is_canceled(graph->context); k += graph->slots) {
        size_t i = loop->all ? k : graph->free_node[k];

        loop->body(graph, &graph->slot[index], &graph->node[i], i);
    }
}

/* Leaves nodes out once the context is canceled, which the graph then says. */
static void for_nodes(struct pullback_graph *graph, bool all, node_body *body)
{
    struct loop loop = {graph, body, all};

    graph->canceled |= srnf_parallel_for(graph->context, graph->slots, run_slot, &loop) != SRNF_OK;
}

/* ---- Energy ---------------------------------------------------------------------------------- */

static void set_field(const struct pullback_graph *graph, const double *unit, const double *root,
                      double *q)
{
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < graph->points; i++) {
            q[c * graph->points + i] = unit[c * graph->points + i] * root[i];
        }
    }
}

/* trial = Q(f) */
static void evaluate(struct pullback_graph *graph, struct pullback_slot *slot,
                     struct pullback_node *node, const double *f)
{
    srnf_sht_gradient(graph->sht, 3, f, slot->w_theta, slot->w_phi, slot->workspace);
    pointwise_normals(graph->points, slot->w_theta, slot->w_phi, slot->unit, slot->root,
                      slot->inverse);
    set_field(graph, slot->unit, slot->root, node->trial);
}

static void evaluate_given(struct pullback_graph *graph, struct pullback_slot *slot,
                           struct pullback_node *node, size_t index)
{
    evaluate(graph, slot, node, graph->in + index * graph->count);
}

static void evaluate_free(struct pullback_graph *graph, struct pullback_slot *slot,
                          struct pullback_node *node, size_t index)
{
    (void)index;
    evaluate(graph, slot, node, graph->in + node->unknown * graph->count);
}

static void evaluate_edge(struct pullback_graph *graph, struct pullback_slot *slot,
                          struct pullback_node *node, size_t index)
{
    const double *other;

    (void)index;
    node->edge = 0.0;
    if (node->parent == PULLBACK_ROOT) {
        return;
    }
    other = graph->node[node->parent].trial;
    for (size_t i = 0; i < 3 * graph->points; i++) {
        slot->field[i] = node->trial[i] - other[i];
    }
    node->edge = graph->edge_weight * pointwise_norm2(graph->points, graph->weight, slot->field);
}

static double sum_edges(struct pullback_graph *graph)
{
    double sum = 0.0;

    for_nodes(graph, true, evaluate_edge);
    for (size_t i = 0; i < graph->nodes; i++) {
        sum += graph->node[i].edge;
    }
    return sum;
}

double pullback_graph_start(struct pullback_graph *graph, const double *f)
{
    graph->in = f;
    for_nodes(graph, true, evaluate_given);
    graph->transforms += (double)graph->nodes;
    return sum_edges(graph);
}

double pullback_graph_try(struct pullback_graph *graph, const double *x)
{
    graph->in = x;
    for_nodes(graph, false, evaluate_free);
    graph->transforms += (double)graph->free;
    return sum_edges(graph);
}

static void linearize(struct pullback_graph *graph, struct pullback_slot *slot,
                      struct pullback_node *node, size_t index)
{
    (void)index;
    srnf_sht_gradient(graph->sht, 3, graph->in + node->unknown * graph->count, node->f_theta,
                      node->f_phi, slot->workspace);
    pointwise_normals(graph->points, node->f_theta, node->f_phi, node->unit, slot->root,
                      node->inverse);
    set_field(graph, node->unit, slot->root, node->q);
}

void pullback_graph_linearize(struct pullback_graph *graph, const double *x)
{
    graph->in = x;
    for_nodes(graph, false, linearize);
    graph->transforms += (double)graph->free;
}

/* ---- Gradient and product -------------------------------------------------------------------- */

static void adjoint(struct pullback_graph *graph, struct pullback_slot *slot,
                    const struct pullback_node *node)
{
    double *out = graph->out + node->unknown * graph->count;

    pointwise_differential_adjoint(graph->points, node->f_theta, node->f_phi, node->unit,
                                   node->inverse, graph->weight, slot->field, slot->w_theta,
                                   slot->w_phi);
    srnf_sht_gradient_adjoint(graph->sht, 3, slot->w_theta, slot->w_phi, out, slot->workspace);
    for (size_t c = 0; c < 3; c++) {
        out[c * graph->count / 3] = 0.0;
    }
}

/* field = weight (degree q - sum of the neighbours' q) */
static void gradient_of_node(struct pullback_graph *graph, struct pullback_slot *slot,
                             struct pullback_node *node, size_t index)
{
    size_t size = 3 * graph->points;

    (void)index;
    linear_copy(size, node->q, slot->field);
    linear_scale(size, graph->edge_weight * node->degree, slot->field);
    for (size_t k = 0; k < node->children; k++) {
        size_t child = graph->child[node->first_child + k];

        linear_axpy(size, -graph->edge_weight, graph->node[child].q, slot->field);
    }
    if (node->parent != PULLBACK_ROOT) {
        linear_axpy(size, -graph->edge_weight, graph->node[node->parent].q, slot->field);
    }
    adjoint(graph, slot, node);
}

void pullback_graph_gradient(struct pullback_graph *graph, double *g)
{
    graph->out = g;
    for_nodes(graph, false, gradient_of_node);
    graph->transforms += (double)graph->free;
}

static void image_of_node(struct pullback_graph *graph, struct pullback_slot *slot,
                          struct pullback_node *node, size_t index)
{
    (void)index;
    srnf_sht_gradient(graph->sht, 3, graph->in + node->unknown * graph->count, slot->w_theta,
                      slot->w_phi, slot->workspace);
    pointwise_differential(graph->points, node->f_theta, node->f_phi, node->unit, node->inverse,
                           slot->w_theta, slot->w_phi, node->image);
}

/* Takes a free neighbour's part out of the field and out of damped. */
static void subtract_neighbour(const struct pullback_graph *graph, struct pullback_slot *slot,
                               size_t neighbour, double *damped)
{
    const struct pullback_node *other = &graph->node[neighbour];

    if (other->unknown != SIZE_MAX) {
        linear_axpy(3 * graph->points, -graph->edge_weight, other->image, slot->field);
        linear_axpy(graph->count, -graph->edge_weight, graph->in + other->unknown * graph->count,
                    damped);
    }
}

static void product_of_node(struct pullback_graph *graph, struct pullback_slot *slot,
                            struct pullback_node *node, size_t index)
{
    double *out = graph->out + node->unknown * graph->count;
    double *damped = slot->unit; /* double[count]: there are fewer coefficients than points */
    double own = graph->edge_weight * node->degree;

    (void)index;
    linear_copy(3 * graph->points, node->image, slot->field);
    linear_scale(3 * graph->points, own, slot->field);
    linear_copy(graph->count, graph->in + node->unknown * graph->count, damped);
    linear_scale(graph->count, own, damped);
    for (size_t k = 0; k < node->children; k++) {
        subtract_neighbour(graph, slot, graph->child[node->first_child + k], damped);
    }
    if (node->parent != PULLBACK_ROOT) {
        subtract_neighbour(graph, slot, node->parent, damped);
    }
    adjoint(graph, slot, node);
    for (size_t i = 0; i < graph->count; i++) {
        out[i] += graph->lambda * graph->diagonal[i] * damped[i];
    }
}

void pullback_graph_product(void *argument, const double *x, double *out)
{
    struct pullback_graph *graph = argument;

    graph->in = x;
    graph->out = out;
    for_nodes(graph, false, image_of_node);
    for_nodes(graph, false, product_of_node);
    graph->transforms += 2.0 * (double)graph->free;
}

/* Moves the linearization: it belongs to no accepted surface afterwards. */
void pullback_graph_hessian(void *argument, const double *x, double *out)
{
    struct pullback_graph *graph = argument;
    size_t n = graph->free * graph->count;
    double size = sqrt(linear_dot(n, x, x));
    double step =
        size > 0.0 ? HESSIAN_STEP * sqrt(linear_dot(n, graph->base, graph->base)) / size : 1.0;

    linear_copy(n, graph->base, graph->displaced);
    linear_axpy(n, step, x, graph->displaced);
    pullback_graph_linearize(graph, graph->displaced);
    pullback_graph_gradient(graph, out);
    linear_axpy(n, -1.0, graph->base_gradient, out);
    linear_scale(n, 1.0 / step, out);
}

/* The free parent of a free node, or NULL. */
static const struct pullback_node *free_parent(const struct pullback_graph *graph, size_t k)
{
    size_t parent = graph->node[graph->free_node[k]].parent;

    return parent == PULLBACK_ROOT || graph->node[parent].unknown == SIZE_MAX
               ? NULL
               : &graph->node[parent];
}

void pullback_graph_precondition(void *argument, const double *r, double *z)
{
    const struct pullback_graph *graph = argument;
    size_t count = graph->count;

    for (size_t i = 0; i < graph->free * count; i++) {
        double d = graph->diagonal[i % count];

        z[i] = d > 0.0 ? r[i] / d : 0.0;
    }
    for (size_t k = 0; k < graph->free; k++) {
        const struct pullback_node *up = free_parent(graph, k);
        double pivot = graph->node[graph->free_node[k]].pivot;

        if (up) {
            linear_axpy(count, graph->edge_weight / pivot, z + k * count, z + up->unknown * count);
        }
    }
    for (size_t k = graph->free; k-- > 0;) {
        const struct pullback_node *up = free_parent(graph, k);

        if (up) {
            linear_axpy(count, graph->edge_weight, z + up->unknown * count, z + k * count);
        }
        linear_scale(count, 1.0 / graph->node[graph->free_node[k]].pivot, z + k * count);
    }
}
