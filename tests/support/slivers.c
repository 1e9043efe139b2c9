/*
 * slivers.c - meshes of long thin faces. All are turned, so that no face lies along an axis.
 */
#include "support/slivers.h"

#include <math.h>

#include "support/meshes.h"
#include "support/random.h"
#include "support/triangulations.h"

#define TURN 5 /* seed of the rotation */

static struct srnf_mesh turned(struct srnf_mesh mesh)
{
    meshes_turn(&mesh, TURN);
    return mesh;
}

static struct srnf_mesh sphere(size_t faces)
{
    return turned(meshes_sphere((size_t)ceil(sqrt((double)faces / 20.0))));
}

/* Two hubs, each in half of the faces. */
static struct srnf_mesh bipyramid(size_t faces)
{
    return turned(triangulations_bipyramid(faces / 2));
}

static struct srnf_mesh lens(size_t faces)
{
    struct srnf_mesh mesh = triangulations_bipyramid(faces / 2);

    meshes_stretch(&mesh, 1.0, 1.0, 0.01);
    return turned(mesh);
}

static struct srnf_mesh spindle(size_t faces)
{
    struct srnf_mesh mesh = triangulations_bipyramid(faces / 2);

    meshes_stretch(&mesh, 1.0, 1.0, 100.0);
    return turned(mesh);
}

/* A hub on one side, a zigzag of slivers on the other. */
static struct srnf_mesh fan(size_t faces)
{
    return turned(triangulations_fan(faces / 2));
}

/* A bipyramid whose rim goes in and out at each vertex: radial blades. */
static struct srnf_mesh blades(size_t faces)
{
    size_t rim = faces / 4 * 2;
    struct srnf_mesh mesh = triangulations_bipyramid(rim);

    for (size_t v = 0; v < mesh.n_vertices; v++) {
        double *x = mesh.vertices + 3 * v, r = sqrt(x[0] * x[0] + x[1] * x[1]);

        if (r > 0.5 && v % 2 == 0) {
            x[0] *= 0.1;
            x[1] *= 0.1;
        }
    }
    return turned(mesh);
}

/* Spikes of all lengths on a sphere. */
static struct srnf_mesh needles(size_t faces)
{
    struct srnf_mesh mesh = meshes_sphere((size_t)ceil(sqrt((double)faces / 20.0)));
    struct test_random random = test_random_seed(1);

    for (size_t v = 0; v < mesh.n_vertices; v++) {
        double length = exp(test_random_uniform(&random, 0.0, 3.0));

        for (size_t k = 0; k < 3; k++) {
            mesh.vertices[3 * v + k] *= length;
        }
    }
    return turned(mesh);
}

static struct srnf_mesh stretched(size_t faces)
{
    struct srnf_mesh mesh = meshes_sphere((size_t)ceil(sqrt((double)faces / 20.0)));

    meshes_stretch(&mesh, 1.0, 1.0, 1000.0);
    return turned(mesh);
}

static void straight(double t, double x[3])
{
    x[0] = x[1] = 0.0;
    x[2] = 4.0 * t - 2.0;
}

static double even(double t)
{
    (void)t;
    return 1.0;
}

/* As long as four radii, of strips from end to end. */
static struct srnf_mesh tube(size_t faces)
{
    return turned(triangulations_tube(straight, even, 2, faces / 4));
}

/* The same with one end turned against the other: strips lie across each other when seen from the
   side, and the waist is narrow. */
static struct srnf_mesh twisted(size_t faces)
{
    struct srnf_mesh mesh = triangulations_tube(straight, even, 2, faces / 4);
    double angle = 2.6;

    for (size_t v = 0; v < mesh.n_vertices; v++) {
        double *x = mesh.vertices + 3 * v, old[2] = {x[0], x[1]};

        if (x[2] > 0.0) {
            x[0] = cos(angle) * old[0] - sin(angle) * old[1];
            x[1] = sin(angle) * old[0] + cos(angle) * old[1];
        }
    }
    return turned(mesh);
}

/* Random triangulations by insertion: a few hubs of large valence, and slivers of all sizes. */
static struct srnf_mesh stacked(size_t faces)
{
    struct test_random random = test_random_seed(3);

    return turned(triangulations_stacked(faces / 2 + 2, false, &random));
}

const struct sliver_family sliver_families[] = {
    {"sphere", sphere, true},   {"bipyramid", bipyramid, true},
    {"lens", lens, true},       {"spindle", spindle, true},
    {"fan", fan, true},         {"blades", blades, true},
    {"needles", needles, true}, {"stretched", stretched, true},
    {"tube", tube, true},       {"twisted tube", twisted, false},
    {"stacked", stacked, true}, {NULL, NULL, false},
};
