/*
 * tree.c - the tree of surfaces whose energy graph.c computes: who is whose
 * parent, the elimination of its Laplacian, and its memory.
 *
 * Nodes come before their parents. Eliminating them in this order fills nothing in: with d the
 * weighted degree, the pivot of a node is d minus w^2 / pivot over its free children, and fixed
 * nodes are no unknowns but count in d. The pivots are positive where every part of the free nodes
 * has a fixed neighbour, as on paths and stars.
 *
 * Memory: 19 P doubles for each free node, P = n_theta n_phi, 3 P for each fixed one, and 14 P for
 * each of up to 16 slots.
 */
#include "pullback.h"

#define SLOTS_MAX ((size_t)16)
#define FREE_FIELDS ((size_t)19) /* q, trial, f_theta, f_phi, unit, image: 3 each; inverse */
#define FIXED_FIELDS ((size_t)3) /* q */
#define SLOT_FIELDS ((size_t)14)

/* Free nodes, children, and the pivots of Lap in the order of the nodes. */
static void link_nodes(struct pullback_graph *graph, const size_t *parents, const bool *fixed)
{
    struct pullback_node *node = graph->node;
    size_t used = 0;

    for (size_t i = 0; i < graph->nodes; i++) {
        node[i].parent = parents[i];
        node[i].unknown = fixed[i] ? SIZE_MAX : graph->free;
        if (!fixed[i]) {
            graph->free_node[graph->free++] = i;
        }
        node[i].degree += parents[i] != PULLBACK_ROOT;
        if (parents[i] != PULLBACK_ROOT) {
            node[parents[i]].degree += 1.0;
            node[parents[i]].children++;
        }
    }
    for (size_t i = 0; i < graph->nodes; i++) {
        node[i].first_child = used;
        used += node[i].children;
        node[i].children = 0;
        node[i].pivot = graph->edge_weight * node[i].degree;
    }
    for (size_t i = 0; i < graph->nodes; i++) {
        struct pullback_node *up = parents[i] == PULLBACK_ROOT ? NULL : &node[parents[i]];

        if (up) {
            graph->child[up->first_child + up->children++] = i;
        }
        if (up && !fixed[i]) {
            up->pivot -= graph->edge_weight * graph->edge_weight / node[i].pivot;
        }
    }
}

/* Of one slot; rounded up so that each stays aligned to 64 bytes. */
static size_t workspace_bytes(const struct srnf_sht *sht)
{
    return (srnf_sht_workspace_size(sht, 3) + 63) / 64 * 64;
}

/* The fields of the nodes, a block for each: all together may be a gigabyte, which takes seconds to
   clear. */
static int fill_nodes(struct pullback_graph *graph)
{
    size_t field = 3 * graph->points;

    for (size_t i = 0; i < graph->nodes; i++) {
        struct pullback_node *node = &graph->node[i];
        bool fixed = node->unknown == SIZE_MAX;

        if (srnf_is_canceled(graph->context)) {
            return SRNF_ECANCELED;
        }
        node->memory =
            srnf_alloc(fixed ? FIXED_FIELDS : FREE_FIELDS, graph->points * sizeof(double));
        if (!node->memory) {
            return SRNF_ENOMEM;
        }
        node->q = node->trial = node->memory;
        if (!fixed) {
            node->trial = node->memory + field;
            node->f_theta = node->trial + field;
            node->f_phi = node->f_theta + field;
            node->unit = node->f_phi + field;
            node->image = node->unit + field;
            node->inverse = node->image + field;
        }
    }
    return SRNF_OK;
}

static void fill_slots(struct pullback_graph *graph)
{
    size_t field = 3 * graph->points;
    size_t bytes = workspace_bytes(graph->sht);
    double *next = graph->memory;

    for (size_t k = 0; k < graph->slots; k++) {
        graph->slot[k] = (struct pullback_slot){.w_theta = next,
                                                .w_phi = next + field,
                                                .field = next + 2 * field,
                                                .unit = next + 3 * field,
                                                .root = next + 4 * field,
                                                .inverse = next + 4 * field + graph->points,
                                                .workspace = graph->workspaces + k * bytes};
        next += SLOT_FIELDS * graph->points;
    }
}

static int allocate(struct pullback_graph *graph)
{
    graph->node = srnf_alloc(graph->nodes, sizeof *graph->node);
    graph->free_node = srnf_alloc(graph->nodes, sizeof *graph->free_node);
    graph->child = srnf_alloc(graph->nodes, sizeof *graph->child);
    graph->slot = srnf_alloc(graph->slots, sizeof *graph->slot);
    graph->memory = srnf_alloc(graph->slots * SLOT_FIELDS, graph->points * sizeof(double));
    graph->weight = srnf_alloc(graph->points, sizeof(double));
    graph->diagonal = srnf_alloc(graph->count, sizeof(double));
    graph->workspaces = srnf_alloc(graph->slots, workspace_bytes(graph->sht));
    return graph->node && graph->free_node && graph->child && graph->slot && graph->memory &&
                   graph->weight && graph->diagonal && graph->workspaces
               ? SRNF_OK
               : SRNF_ENOMEM;
}

int pullback_graph_create(struct pullback_graph **out, const struct srnf_sht *sht,
                          const struct srnf_context *context, size_t nodes, const size_t *parents,
                          const bool *fixed, double edge_weight)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    struct pullback_graph *graph = srnf_alloc(1, sizeof *graph);
    int status;

    *out = NULL;
    if (!graph) {
        return SRNF_ENOMEM;
    }
    graph->sht = sht;
    graph->context = context;
    graph->degree = srnf_sht_degree(sht);
    graph->points = grid->n_theta * grid->n_phi;
    graph->count = 3 * srnf_coefficient_count(graph->degree);
    graph->nodes = nodes;
    graph->slots = nodes < SLOTS_MAX ? nodes : SLOTS_MAX;
    graph->edge_weight = edge_weight;
    status = allocate(graph);
    if (status == SRNF_OK) {
        pointwise_weights(grid, graph->weight);
        linear_diagonal(graph->degree, 1.0, 0.25, graph->diagonal);
        link_nodes(graph, parents, fixed);
        fill_slots(graph);
        status = fill_nodes(graph);
    }
    if (status) {
        pullback_graph_destroy(graph);
        return status;
    }
    *out = graph;
    return SRNF_OK;
}

void pullback_graph_destroy(struct pullback_graph *graph)
{
    if (!graph) {
        return;
    }
    for (size_t i = 0; graph->node && i < graph->nodes; i++) {
        srnf_free(graph->node[i].memory);
    }
    srnf_free(graph->node);
    srnf_free(graph->free_node);
    srnf_free(graph->child);
    srnf_free(graph->slot);
    srnf_free(graph->memory);
    srnf_free(graph->weight);
    srnf_free(graph->diagonal);
    srnf_free(graph->workspaces);
    srnf_free(graph);
}
