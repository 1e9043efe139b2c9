/*
 * smooth.c - smoothing of a dual surface within its cells.
 *
 * G. Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995: a step towards
 * the mean of the neighbours and a slightly larger one away, so that what is long-waved keeps its
 * size. After each step a vertex goes back into what it must not leave (S. Gibson 1998): no point
 * moves by more than a voxel, and centres of voxels stay on their side. The weights are uniform, so
 * that the result is the same in the coordinates of voxels and in those of the world.
 */
#include "topology.h"

#include <string.h>

#define SHRINK 0.5
#define INFLATE (-0.53) /* pass-band 1 / SHRINK + 1 / INFLATE = 0.11 */

struct pass {
    double *sum; /* [n_vertices][3] */
    uint32_t *degree;
};

static void add_neighbours(const struct voxel_net *net, struct pass *pass)
{
    memset(pass->sum, 0, 3 * net->n_vertices * sizeof(double));
    memset(pass->degree, 0, net->n_vertices * sizeof *pass->degree);
    for (size_t p = 0; p < net->n_polygons; p++) {
        size_t begin = net->first[p], end = net->first[p + 1];

        for (size_t c = begin; c < end; c++) {
            uint32_t from = net->corners[c], to = net->corners[c + 1 < end ? c + 1 : begin];

            for (size_t k = 0; k < 3; k++) {
                pass->sum[3 * from + k] += net->vertices[3 * to + k];
            }
            pass->degree[from]++;
        }
    }
}

/* One step of the size given, and back into reach. Every side is one of two polygons, once each way
   round, so each neighbour is added once. */
static void step(struct voxel_net *net, struct pass *pass, double size)
{
    add_neighbours(net, pass);
    for (size_t v = 0; v < net->n_vertices; v++) {
        for (size_t k = 0; k < 3; k++) {
            double *x = &net->vertices[3 * v + k], home = net->home[3 * v + k];
            double reach = (double)net->reach[v];

            *x += size * (pass->sum[3 * v + k] / (double)pass->degree[v] - *x);
            *x = *x < home - reach ? home - reach : *x > home + reach ? home + reach : *x;
        }
    }
}

int voxel_net_smooth(struct voxel_net *net, size_t passes, const struct srnf_context *context)
{
    struct pass pass = {srnf_alloc(net->n_vertices, 3 * sizeof(double)),
                        srnf_alloc(net->n_vertices, sizeof *pass.degree)};
    int status = pass.sum && pass.degree ? SRNF_OK : SRNF_ENOMEM;

    for (size_t n = 0; status == SRNF_OK && n < passes; n++) {
        step(net, &pass, SHRINK);
        step(net, &pass, INFLATE);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
    }
    srnf_free(pass.sum);
    srnf_free(pass.degree);
    return status;
}
