/*
 * net.c - the dual surface of a set of voxels.
 *
 * S. Gibson, "Constrained elastic surface nets", MICCAI 1998, with a vertex for each sheet as in
 * G. Nielson, "Dual marching cubes", IEEE Visualization 2004. A cell is the cube between eight
 * centres of voxels. In a cell, voxels of the set are joined along faces and edges of voxels,
 * voxels outside along faces; a sheet parts one component of the set from one outside, and has one
 * vertex. Every pair of voxels that share a face, one in the set and one outside, gives a polygon
 * through the sheets of the four cells around it.
 *
 * The polygons are a closed manifold (the dual of that of marching cubes with ambiguous faces
 * joined), but for one case: two voxels of the set that touch along an edge alone, with the same
 * two sheets around both sides of it. Two sides of polygons would then be the same edge; each gets
 * a vertex of its own in its middle (spare_vertex).
 */
#include "topology.h"

#include <math.h>
#include <string.h>

#define NO_SHEET 15
#define SPARE_REACH 0.2f
#define CELL_REACH 0.5f

/* The sheets of the 256 cells: corner c is at (c & 1, c >> 1 & 1, c >> 2), edge 4 k + e runs along
   axis k from the e-th corner that has bit k clear. */
struct sheets {
    unsigned char count[256];
    unsigned char of_edge[256][12]; /* NO_SHEET: not crossed */
};

struct spare {
    uint64_t key; /* 0: free */
    uint32_t vertex;
};

struct making {
    const struct voxel_box *box;
    const struct srnf_context *context;
    struct voxel_net *net;
    struct sheets sheets;
    uint32_t *first_vertex; /* [voxels of the box]: of the cell at this voxel and the next ones */
    struct spare *spares;
    size_t n_slots, n_ambiguous;
};

/* ---- Sheets ---------------------------------------------------------------------------------- */

static size_t edge_corner(size_t edge)
{
    size_t axis = edge / 4, e = edge % 4;

    return (e & (((size_t)1 << axis) - 1)) | ((e >> axis) << (axis + 1));
}

/* The components of corners of one kind; two are joined where they differ in at most `bits`. */
static void label_corners(unsigned corners, int bits, unsigned char label[8])
{
    for (size_t c = 0; c < 8; c++) {
        if (corners >> c & 1) {
            label[c] = (unsigned char)c;
        }
    }
    for (size_t round = 0; round < 8; round++) {
        for (size_t a = 0; a < 8; a++) {
            for (size_t b = 0; b < 8; b++) {
                if ((corners >> a & corners >> b & 1) && label[b] < label[a] &&
                    __builtin_popcount((unsigned)(a ^ b)) <= bits) {
                    label[a] = label[b];
                }
            }
        }
    }
}

static void fill_sheets(struct sheets *sheets)
{
    for (unsigned config = 0; config < 256; config++) {
        unsigned char label[8] = {0}, pairs[12], n = 0;

        label_corners(config, 2, label);
        label_corners(~config & 255, 1, label);
        for (size_t edge = 0; edge < 12; edge++) {
            size_t a = edge_corner(edge), b = a | (size_t)1 << edge / 4;
            bool a_in = config >> a & 1, b_in = config >> b & 1;
            unsigned char pair =
                (unsigned char)(a_in ? label[a] * 8 + label[b] : label[b] * 8 + label[a]);
            unsigned char sheet = 0;

            sheets->of_edge[config][edge] = NO_SHEET;
            if (a_in == b_in) {
                continue;
            }
            while (sheet < n && pairs[sheet] != pair) {
                sheet++;
            }
            pairs[sheet] = pair;
            n = sheet == n ? (unsigned char)(n + 1) : n;
            sheets->of_edge[config][edge] = sheet;
        }
        sheets->count[config] = n;
    }
}

/* Which corners of the cell are in the set. */
static unsigned config_of(const struct voxel_box *box, size_t cell)
{
    unsigned config = 0;

    for (size_t c = 0; c < 8; c++) {
        size_t at = cell + (c & 1) * box->stride[0] + (c >> 1 & 1) * box->stride[1] +
                    (c >> 2) * box->stride[2];

        config |= (unsigned)(box->voxels[at] == VOXEL_IN) << c;
    }
    return config;
}

/* ---- Vertices -------------------------------------------------------------------------------- */

static void set_vertex(struct voxel_net *net, size_t vertex, const double at[3],
                       const double home[3], float reach)
{
    memcpy(net->vertices + 3 * vertex, at, 3 * sizeof(double));
    memcpy(net->home + 3 * vertex, home, 3 * sizeof(double));
    net->reach[vertex] = reach;
}

/* The vertices of a cell lie in the middle of where its edges cross. */
static void place_cell(struct making *making, unsigned config, const double origin[3],
                       uint32_t first)
{
    const struct sheets *sheets = &making->sheets;
    const double home[3] = {origin[0] + 0.5, origin[1] + 0.5, origin[2] + 0.5};

    for (size_t sheet = 0; sheet < sheets->count[config]; sheet++) {
        double sum[3] = {0.0, 0.0, 0.0};
        size_t n = 0;

        for (size_t edge = 0; edge < 12; edge++) {
            if (sheets->of_edge[config][edge] == sheet) {
                for (size_t k = 0; k < 3; k++) {
                    sum[k] += (double)(edge_corner(edge) >> k & 1) + (k == edge / 4 ? 0.5 : 0.0);
                }
                n++;
            }
        }
        for (size_t k = 0; k < 3; k++) {
            sum[k] = origin[k] + sum[k] / (double)n;
        }
        set_vertex(making->net, first + sheet, sum, home, CELL_REACH);
    }
}

/* Whether exactly two voxels of a square, on a diagonal, are in the set. */
static bool is_ambiguous(const struct voxel_box *box, size_t at, size_t a, size_t b)
{
    const unsigned char *v = box->voxels + at;
    bool p = v[0] == VOXEL_IN, q = v[a] == VOXEL_IN, r = v[a + b] == VOXEL_IN, s = v[b] == VOXEL_IN;

    return p == r && q == s && p != q;
}

/* Calls visit for every cell of the box, with its place and index. */
static int each_cell(struct making *making,
                     void (*visit)(struct making *, size_t at, const size_t place[3]))
{
    const struct voxel_box *box = making->box;
    size_t place[3];

    for (place[2] = 0; place[2] + 1 < box->shape[2]; place[2]++) {
        if (srnf_is_canceled(making->context)) {
            return SRNF_ECANCELED;
        }
        for (place[1] = 0; place[1] + 1 < box->shape[1]; place[1]++) {
            for (place[0] = 0; place[0] + 1 < box->shape[0]; place[0]++) {
                visit(making, place[0] + place[1] * box->stride[1] + place[2] * box->stride[2],
                      place);
            }
        }
    }
    return SRNF_OK;
}

static void count_cell(struct making *making, size_t at, const size_t place[3])
{
    const struct voxel_box *box = making->box;
    struct voxel_net *net = making->net;

    (void)place;
    making->first_vertex[at] = (uint32_t)net->n_vertices;
    net->n_vertices += making->sheets.count[config_of(box, at)];
    for (size_t k = 0; k < 3; k++) {
        net->n_polygons +=
            (box->voxels[at] == VOXEL_IN) != (box->voxels[at + box->stride[k]] == VOXEL_IN);
        making->n_ambiguous += is_ambiguous(box, at, box->stride[k], box->stride[(k + 1) % 3]);
    }
}

static void fill_cell(struct making *making, size_t at, const size_t place[3])
{
    unsigned config = config_of(making->box, at);

    if (making->sheets.count[config] > 0) {
        const double origin[3] = {(double)place[0], (double)place[1], (double)place[2]};

        place_cell(making, config, origin, making->first_vertex[at]);
    }
}

/* ---- Polygons -------------------------------------------------------------------------------- */

/* The vertex of a cell's sheet that the edge from voxel `from` along the axis crosses. */
static uint32_t cell_vertex(const struct making *making, size_t cell, size_t from, size_t axis)
{
    const struct voxel_box *box = making->box;
    size_t difference = from - cell, corner = 0, edge = 0;

    for (size_t k = 3; k-- > 0;) {
        if (difference >= box->stride[k]) {
            difference -= box->stride[k];
            corner |= (size_t)1 << k;
        }
    }
    while (edge_corner(4 * axis + edge) != corner) {
        edge++;
    }
    return making->first_vertex[cell] +
           making->sheets.of_edge[config_of(box, cell)][4 * axis + edge];
}

/* The vertex in the middle of the segment that parts voxel `out` from the rest of its square; the
   square is that of `at` and the axes a, b. Both polygons that share the segment ask for it. */
static uint32_t spare_vertex(struct making *making, size_t at, size_t a, size_t b, size_t out,
                             const double middle[3], const double corner[3])
{
    uint64_t key = ((uint64_t)at * 3 + (3 - a - b)) * 4 + 1;
    size_t slot;

    key += out == at                            ? 0
           : out == at + making->box->stride[a] ? 1
           : out == at + making->box->stride[b] ? 2
                                                : 3;
    slot = (size_t)((key * UINT64_C(0x9e3779b97f4a7c15)) >> 20) % making->n_slots;
    while (making->spares[slot].key && making->spares[slot].key != key) {
        slot = (slot + 1) % making->n_slots;
    }
    if (!making->spares[slot].key) {
        double home[3];

        making->spares[slot] =
            (struct spare){.key = key, .vertex = (uint32_t)making->net->n_vertices};
        for (size_t k = 0; k < 3; k++) {
            home[k] = 0.5 * (middle[k] + corner[k]);
        }
        set_vertex(making->net, making->net->n_vertices++, home, home, SPARE_REACH);
    }
    return making->spares[slot].vertex;
}

/* Adds the vertex between two corners of a polygon where their side is not the only edge of the
   two. The polygon is around the edge from voxel `from` along `axis`; the side crosses the square
   of that edge and of axis `other`, on its far side (up) or near side. */
static void add_spare(struct making *making, size_t from, size_t axis, size_t other, bool up)
{
    const struct voxel_box *box = making->box;
    size_t at = up ? from : from - box->stride[other], third = 3 - axis - other;
    size_t a = axis < other ? axis : other, b = axis < other ? other : axis;
    size_t cells[2] = {at, at - box->stride[third]}, place[3];
    size_t far = from + box->stride[axis], facing = up ? at + box->stride[other] : at;
    size_t out = box->voxels[from] == VOXEL_IN ? far : from;
    double middle[3], corner[3];

    if (!is_ambiguous(box, at, box->stride[a], box->stride[b])) {
        return;
    }
    /* The square's other segment crosses the edge that faces this one. */
    for (size_t i = 0; i < 2; i++) {
        if (cell_vertex(making, cells[i], from, axis) !=
            cell_vertex(making, cells[i], facing, axis)) {
            return;
        }
    }
    place[0] = at % box->stride[1];
    place[1] = at % box->stride[2] / box->stride[1];
    place[2] = at / box->stride[2];
    for (size_t k = 0; k < 3; k++) {
        size_t step = out - at;
        bool along =
            k == a ? (step == box->stride[a] || step == box->stride[a] + box->stride[b])
                   : k == b && (step == box->stride[b] || step == box->stride[a] + box->stride[b]);

        middle[k] = (double)place[k] + (k == third ? 0.0 : 0.5);
        corner[k] = (double)place[k] + (along ? 1.0 : 0.0);
    }
    making->net->corners[making->net->n_corners++] =
        spare_vertex(making, at, a, b, out, middle, corner);
}

/* The polygon around the edge from a voxel along an axis, outward. */
static void add_polygon(struct making *making, size_t from, size_t axis)
{
    const struct voxel_box *box = making->box;
    struct voxel_net *net = making->net;
    size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    /* The four cells, counter-clockwise as seen from the far end, and the side to the next. */
    const struct {
        size_t cell, other;
        bool up;
    } around[4] = {
        {from - box->stride[u] - box->stride[v], v, false},
        {from - box->stride[v], u, true},
        {from, v, true},
        {from - box->stride[u], u, false},
    };
    bool reversed = box->voxels[from] != VOXEL_IN;

    net->first[net->n_polygons++] = net->n_corners;
    for (size_t i = 0; i < 4; i++) {
        size_t n = reversed ? 3 - i : i, side = reversed ? (n + 3) % 4 : n;

        net->corners[net->n_corners++] = cell_vertex(making, around[n].cell, from, axis);
        add_spare(making, from, axis, around[side].other, around[side].up);
    }
}

static void add_polygons(struct making *making, size_t at, const size_t place[3])
{
    const struct voxel_box *box = making->box;

    (void)place;
    for (size_t k = 0; k < 3; k++) {
        if ((box->voxels[at] == VOXEL_IN) != (box->voxels[at + box->stride[k]] == VOXEL_IN)) {
            add_polygon(making, at, k);
        }
    }
}

/* ---- The whole ------------------------------------------------------------------------------- */

void voxel_net_clear(struct voxel_net *net)
{
    srnf_free(net->vertices);
    srnf_free(net->home);
    srnf_free(net->reach);
    srnf_free(net->corners);
    srnf_free(net->first);
    *net = (struct voxel_net){.n_vertices = 0};
}

static bool make_room(struct making *making)
{
    struct voxel_net *net = making->net;
    size_t vertices = net->n_vertices + 2 * making->n_ambiguous;

    net->vertices = srnf_alloc(vertices, 3 * sizeof(double));
    net->home = srnf_alloc(vertices, 3 * sizeof(double));
    net->reach = srnf_alloc(vertices, sizeof *net->reach);
    net->corners = srnf_alloc(net->n_polygons, 8 * sizeof *net->corners);
    net->first = srnf_alloc(net->n_polygons + 1, sizeof *net->first);
    making->n_slots = 4 * making->n_ambiguous + 1;
    making->spares = srnf_alloc(making->n_slots, sizeof *making->spares);
    net->n_polygons = 0;
    return net->vertices && net->home && net->reach && net->corners && net->first && making->spares;
}

int voxel_net_make(const struct voxel_box *box, const struct srnf_context *context,
                   struct voxel_net *net)
{
    struct making making = {.box = box, .context = context, .net = net};
    int status;

    *net = (struct voxel_net){.n_vertices = 0};
    fill_sheets(&making.sheets);
    making.first_vertex = srnf_alloc(box->count, sizeof *making.first_vertex);
    status = making.first_vertex ? each_cell(&making, count_cell) : SRNF_ENOMEM;
    if (status == SRNF_OK && !make_room(&making)) {
        status = SRNF_ENOMEM;
    }
    status = status == SRNF_OK ? each_cell(&making, fill_cell) : status;
    status = status == SRNF_OK ? each_cell(&making, add_polygons) : status;
    if (status == SRNF_OK) {
        net->first[net->n_polygons] = net->n_corners;
    } else {
        voxel_net_clear(net);
    }
    srnf_free(making.first_vertex);
    srnf_free(making.spares);
    return status;
}
