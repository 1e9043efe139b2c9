/*
 * simple.c - simple voxels.
 *
 * G. Bertrand and G. Malandain, "A new characterization of three-dimensional simple points",
 * Pattern Recognition Letters 15 (1994), for the pair (18, 6+): a voxel is simple where its
 * neighbours in the set, and those outside, are one component each in its geodesic neighbourhood.
 *
 * Why that is right for the surface of net.c: the voxel's own ball touches those of its neighbours
 * along a part C of its boundary, which is a sphere. A neighbour across a face or an edge touches
 * it, two of them are connected on the sphere where they are joined within a block, and all are
 * components of the 18-neighbours, with corners as links. The rest D of the sphere consists of the
 * neighbours across faces that are outside, connected where a path over faces joins them within a
 * block. Where both C and D are connected and not empty, C is a disc, and a ball that is attached
 * or removed along a disc leaves the topology as it was.
 */
#include "topology.h"

static size_t bit_of(int x, int y, int z)
{
    return (size_t)(9 * (z + 1) + 3 * (y + 1) + x + 1);
}

static int distance_of(size_t a, size_t b)
{
    int sum = 0, most = 0;

    for (size_t k = 0, power = 1; k < 3; k++, power *= 3) {
        int difference = (int)(a / power % 3) - (int)(b / power % 3);

        difference = difference < 0 ? -difference : difference;
        sum += difference;
        most = difference > most ? difference : most;
    }
    return most == 1 ? sum : 0;
}

void simple_tables_fill(struct simple_tables *tables, const struct voxel_box *box)
{
    const size_t centre = 13;

    *tables = (struct simple_tables){.sides = 0};
    for (size_t a = 0; a < 27; a++) {
        int x = (int)(a % 3) - 1, y = (int)(a / 3 % 3) - 1, z = (int)(a / 9) - 1;

        tables->offset[a] = x * (ptrdiff_t)box->stride[0] + y * (ptrdiff_t)box->stride[1] +
                            z * (ptrdiff_t)box->stride[2];
        for (size_t b = 0; b < 27; b++) {
            int distance = distance_of(a, b);

            if (a != centre && b != centre) {
                tables->faces[a] |= distance == 1 ? UINT32_C(1) << b : 0;
                tables->edges[a] |= distance == 1 || distance == 2 ? UINT32_C(1) << b : 0;
            }
        }
        tables->sides |= distance_of(a, centre) == 1 ? UINT32_C(1) << a : 0;
        tables->corners |= distance_of(a, centre) == 3 ? UINT32_C(1) << a : 0;
    }
    for (size_t cell = 0; cell < 8; cell++) {
        for (size_t corner = 1; corner < 8; corner++) {
            int x = corner & 1 ? (cell & 1 ? 1 : -1) : 0, y = corner & 2 ? (cell & 2 ? 1 : -1) : 0;
            int z = corner & 4 ? (cell & 4 ? 1 : -1) : 0;

            tables->cells[cell] |= UINT32_C(1) << bit_of(x, y, z);
        }
    }
}

/* What is reached from the seed within the mask. */
static uint32_t flood(uint32_t seed, uint32_t within, const uint32_t near[27])
{
    uint32_t reached = seed, front = seed;

    while (front) {
        uint32_t next = 0;

        for (uint32_t left = front; left; left &= left - 1) {
            next |= near[__builtin_ctz(left)];
        }
        front = next & within & ~reached;
        reached |= front;
    }
    return reached;
}

static uint32_t lowest(uint32_t bits)
{
    return bits & (~bits + 1);
}

/* The neighbours outside across faces that a path within blocks joins to the first of them. */
static uint32_t reached_outside(const struct simple_tables *tables, uint32_t out)
{
    uint32_t reached = lowest(out & tables->sides), before;

    do {
        before = reached;
        for (size_t cell = 0; cell < 8; cell++) {
            uint32_t mask = tables->cells[cell], seed = reached & mask;

            if (seed) {
                reached |= flood(seed, out & mask, tables->faces) & tables->sides;
            }
        }
    } while (reached != before);
    return reached;
}

bool simple_voxel(const struct simple_tables *tables, const unsigned char *voxels, size_t at)
{
    const unsigned char *centre = voxels + at;
    uint32_t in = 0, out, touching;

    for (size_t b = 0; b < 27; b++) {
        in |= centre[tables->offset[b]] == VOXEL_IN ? UINT32_C(1) << b : 0;
    }
    in &= ~(UINT32_C(1) << 13);
    out = ~in & ((UINT32_C(1) << 27) - 1) & ~(UINT32_C(1) << 13);
    touching = in & ~tables->corners;
    if (!touching || !(out & tables->sides)) {
        return false;
    }
    return (touching & ~flood(lowest(touching), in, tables->edges)) == 0 &&
           (out & tables->sides & ~reached_outside(tables, out)) == 0;
}
