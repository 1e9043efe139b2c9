/*
 * picture.c - triangles into pixels with a depth buffer, at twice the size and averaged; PNG by
 * libpng.
 *
 * Surfaces are drawn as triangulations over a geodesic sphere with their exact normals.
 */
#include "paper/picture.h"

#include <lapacke.h>
#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "paper/report_internal.h"
#include "support/compare.h"

#define FREQUENCY 40
#define SIDE ((size_t)300)
#define OVER ((size_t)2)
#define LARGE (SIDE * OVER)
#define MARGIN 1.12
#define AMBIENT 0.25

struct canvas {
    float (*colour)[3]; /* [LARGE * LARGE] */
    float *depth;
};

/* From dark blue over green to yellow: nodes of a map whose lightness rises evenly. */
static void colour_of(double value, double out[3])
{
    static const double nodes[][3] = {
        {.27, .00, .33}, {.23, .32, .55}, {.13, .57, .55}, {.37, .79, .38}, {.99, .91, .14}};
    const size_t last = sizeof nodes / sizeof nodes[0] - 1;
    double at = fmin(fmax(value, 0.0), 1.0) * (double)last;
    size_t i = at >= (double)last ? last - 1 : (size_t)at;
    double part = at - (double)i;

    for (int c = 0; c < 3; c++) {
        out[c] = (1.0 - part) * nodes[i][c] + part * nodes[i + 1][c];
    }
}

/* Centroid of the vertices of a triangulation, by area. */
static void centroid_of(const struct srnf_mesh *mesh, double centre[3])
{
    double area = 0.0;

    memset(centre, 0, 3 * sizeof(double));
    for (size_t f = 0; f < mesh->n_faces; f++) {
        const double *a = mesh->vertices + 3 * mesh->faces[3 * f];
        const double *b = mesh->vertices + 3 * mesh->faces[3 * f + 1];
        const double *c = mesh->vertices + 3 * mesh->faces[3 * f + 2];
        double u[3];
        double v[3];
        double size;

        for (int k = 0; k < 3; k++) {
            u[k] = b[k] - a[k];
            v[k] = c[k] - a[k];
        }
        size = sqrt(pow(u[1] * v[2] - u[2] * v[1], 2) + pow(u[2] * v[0] - u[0] * v[2], 2) +
                    pow(u[0] * v[1] - u[1] * v[0], 2));
        area += size;
        for (int k = 0; k < 3; k++) {
            centre[k] += size * (a[k] + b[k] + c[k]) / 3.0;
        }
    }
    for (int k = 0; k < 3; k++) {
        centre[k] /= area;
    }
}

/* Largest distance of a vertex from the centroid, with a margin. */
static double reach_of(const struct srnf_mesh *mesh, const double centre[3])
{
    double square = 0.0;

    for (size_t i = 0; i < mesh->n_vertices; i++) {
        double x = mesh->vertices[3 * i] - centre[0];
        double y = mesh->vertices[3 * i + 1] - centre[1];
        double z = mesh->vertices[3 * i + 2] - centre[2];

        square = compare_max(square, x * x + y * y + z * z);
    }
    return MARGIN * sqrt(square);
}

double picture_reach(size_t degree, const double *coefficients)
{
    struct srnf_mesh mesh;
    double centre[3];
    double reach;

    report_must(srnf_surface_triangulate(degree, coefficients, FREQUENCY, &mesh, NULL) == SRNF_OK,
                "out of memory");
    centroid_of(&mesh, centre);
    reach = reach_of(&mesh, centre);
    srnf_mesh_clear(&mesh);
    return reach;
}

struct picture_view picture_view_of(size_t degree, const double *coefficients)
{
    struct picture_view view = {.reach = 0.0};
    struct srnf_mesh mesh;
    double moments[9] = {0};
    double values[3];
    double centre[3];
    double *r = view.rotation;

    report_must(srnf_surface_triangulate(degree, coefficients, FREQUENCY, &mesh, NULL) == SRNF_OK,
                "out of memory");
    centroid_of(&mesh, centre);
    view.reach = reach_of(&mesh, centre);
    for (size_t i = 0; i < mesh.n_vertices; i++) {
        for (int k = 0; k < 3; k++) {
            double x = mesh.vertices[3 * i + (size_t)k] - centre[k];

            for (int l = 0; l < 3; l++) {
                moments[3 * k + l] += x * (mesh.vertices[3 * i + (size_t)l] - centre[l]);
            }
        }
    }
    report_must(LAPACKE_dsyev(LAPACK_COL_MAJOR, 'V', 'L', 3, moments, 3, values) == 0,
                "the axes of a surface cannot be found");
    /* Columns are axes from the shortest to the longest: the longest to the right, the shortest
       towards the viewer, right-handed. */
    for (int k = 0; k < 3; k++) {
        r[k] = moments[6 + k];
        r[6 + k] = moments[k];
    }
    r[3] = r[7] * r[2] - r[8] * r[1];
    r[4] = r[8] * r[0] - r[6] * r[2];
    r[5] = r[6] * r[1] - r[7] * r[0];
    srnf_mesh_clear(&mesh);
    return view;
}

static double *distances(size_t degree, const double *coefficients, const double *reference,
                         size_t *count)
{
    size_t n = 3 * srnf_coefficient_count(degree);
    double *difference = srnf_alloc(n, sizeof(double));
    double *values;
    double *out;
    struct srnf_mesh sphere;

    report_must(srnf_mesh_icosphere(FREQUENCY, &sphere) == SRNF_OK, "out of memory");
    values = srnf_alloc(3 * sphere.n_vertices, sizeof(double));
    out = srnf_alloc(sphere.n_vertices, sizeof(double));
    report_must(difference && values && out, "out of memory");
    for (size_t i = 0; i < n; i++) {
        bool constant = i % (n / 3) == 0; /* l = 0: translations do not count */

        difference[i] = constant ? 0.0 : coefficients[i] - reference[i];
    }
    report_must(srnf_harmonics_at_points(degree, 3, difference, sphere.n_vertices, sphere.vertices,
                                         values, NULL) == SRNF_OK,
                "out of memory");
    *count = sphere.n_vertices;
    for (size_t i = 0; i < *count; i++) {
        out[i] =
            sqrt(pow(values[i], 2) + pow(values[*count + i], 2) + pow(values[2 * *count + i], 2));
    }
    srnf_mesh_clear(&sphere);
    srnf_free(values);
    srnf_free(difference);
    return out;
}

double picture_largest(size_t degree, const double *coefficients, const double *reference)
{
    double largest = 0.0;
    size_t n;
    double *d = distances(degree, coefficients, reference, &n);

    for (size_t i = 0; i < n; i++) {
        largest = compare_max(largest, d[i]);
    }
    srnf_free(d);
    return largest;
}

/* A vertex in the picture: x and y in pixels, depth, and its colour. */
struct corner {
    double x, y, z, colour[3];
};

static double edge(const struct corner *a, const struct corner *b, double x, double y)
{
    return (b->x - a->x) * (y - a->y) - (b->y - a->y) * (x - a->x);
}

static size_t pixel(double at)
{
    return !(at > 0.0) ? 0 : at >= (double)(LARGE - 1) ? LARGE - 1 : (size_t)at;
}

static void fill(struct canvas *canvas, const struct corner *a, const struct corner *b,
                 const struct corner *c)
{
    double area = edge(a, b, c->x, c->y);
    size_t right = pixel(ceil(fmax(a->x, fmax(b->x, c->x))));
    size_t bottom = pixel(ceil(fmax(a->y, fmax(b->y, c->y))));

    if (!(area > 0.0)) { /* turned away, or without extent */
        return;
    }
    for (size_t y = pixel(fmin(a->y, fmin(b->y, c->y))); y <= bottom; y++) {
        for (size_t x = pixel(fmin(a->x, fmin(b->x, c->x))); x <= right; x++) {
            double u = edge(b, c, (double)x, (double)y) / area;
            double v = edge(c, a, (double)x, (double)y) / area;
            double w = 1.0 - u - v;
            double z = u * a->z + v * b->z + w * c->z;
            size_t at = y * LARGE + x;

            if (u < 0.0 || v < 0.0 || w < 0.0 || z <= (double)canvas->depth[at]) {
                continue;
            }
            canvas->depth[at] = (float)z;
            for (int k = 0; k < 3; k++) {
                canvas->colour[at][k] =
                    (float)(u * a->colour[k] + v * b->colour[k] + w * c->colour[k]);
            }
        }
    }
}

/* What the vertices become in the view. y of the picture runs downwards. */
static struct corner *project(const struct srnf_mesh *mesh, const double *normals,
                              const struct picture_view *view, const double *field, double highest)
{
    struct corner *corners = srnf_alloc(mesh->n_vertices, sizeof *corners);
    double centre[3];

    report_must(corners != NULL, "out of memory");
    centroid_of(mesh, centre);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        double p[3] = {0};
        double light = 0.0;
        double base[3] = {.78, .74, .68};

        for (size_t k = 0; k < 3; k++) {
            double x = mesh->vertices[3 * i + k] - centre[k];

            for (size_t row = 0; row < 3; row++) {
                p[row] += view->rotation[3 * row + k] * x;
            }
            light += view->rotation[6 + k] * normals[3 * i + k];
        }
        if (field) {
            colour_of(highest > 0.0 ? field[i] / highest : 0.0, base);
        }
        corners[i].x = (1.0 + p[0] / view->reach) * 0.5 * (double)LARGE;
        corners[i].y = (1.0 - p[1] / view->reach) * 0.5 * (double)LARGE;
        corners[i].z = p[2];
        for (int k = 0; k < 3; k++) {
            corners[i].colour[k] = base[k] * (AMBIENT + (1.0 - AMBIENT) * fmax(light, 0.0));
        }
    }
    return corners;
}

static void encode(const struct canvas *canvas, struct picture *picture)
{
    unsigned char *bytes = malloc(3 * SIDE * SIDE);
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)SIDE,
                       .height = (png_uint_32)SIDE,
                       .format = PNG_FORMAT_RGB};
    png_alloc_size_t size = 0;

    report_must(bytes != NULL, "out of memory");
    for (size_t i = 0; i < 3 * SIDE * SIDE; i++) {
        size_t x = i / 3 % SIDE;
        size_t y = i / 3 / SIDE;
        double sum = 0.0;

        for (size_t k = 0; k < OVER * OVER; k++) {
            size_t at = (y * OVER + k / OVER) * LARGE + x * OVER + k % OVER;

            sum += (double)canvas->colour[at][i % 3];
        }
        sum = fmin(fmax(sum / (double)(OVER * OVER), 0.0), 1.0);
        bytes[i] = (unsigned char)(255.0 * sum + 0.5);
    }
    report_must(png_image_write_to_memory(&image, NULL, &size, 0, bytes, 0, NULL) != 0,
                "a picture cannot be encoded");
    picture->png = malloc(size);
    report_must(picture->png != NULL &&
                    png_image_write_to_memory(&image, picture->png, &size, 0, bytes, 0, NULL) != 0,
                "a picture cannot be encoded");
    picture->size = size;
    free(bytes);
}

/* field: a value for each vertex of the icosphere, from 0 to highest; NULL: one colour. */
static struct picture draw(size_t degree, const double *coefficients,
                           const struct picture_view *view, const double *field, double highest)
{
    struct picture picture = {NULL, 0};
    struct canvas canvas = {malloc(LARGE * LARGE * sizeof *canvas.colour),
                            malloc(LARGE * LARGE * sizeof *canvas.depth)};
    struct srnf_mesh mesh;
    double *normals = NULL;
    struct corner *corners;

    report_must(canvas.colour && canvas.depth &&
                    srnf_surface_triangulate(degree, coefficients, FREQUENCY, &mesh, &normals) ==
                        SRNF_OK,
                "out of memory");
    for (size_t i = 0; i < LARGE * LARGE; i++) {
        canvas.depth[i] = -INFINITY;
        canvas.colour[i][0] = canvas.colour[i][1] = canvas.colour[i][2] = 1.0f;
    }
    corners = project(&mesh, normals, view, field, highest);
    for (size_t f = 0; f < mesh.n_faces; f++) {
        /* y runs downwards: what is counter-clockwise in space is clockwise here */
        fill(&canvas, &corners[mesh.faces[3 * f]], &corners[mesh.faces[3 * f + 2]],
             &corners[mesh.faces[3 * f + 1]]);
    }
    encode(&canvas, &picture);
    srnf_free(corners);
    srnf_free(normals);
    srnf_mesh_clear(&mesh);
    free(canvas.colour);
    free(canvas.depth);
    return picture;
}

struct picture picture_draw(size_t degree, const double *coefficients,
                            const struct picture_view *view, const double *reference,
                            double highest)
{
    struct picture picture;
    double *field = NULL;
    size_t n;

    if (reference) {
        field = distances(degree, coefficients, reference, &n);
    }
    picture = draw(degree, coefficients, view, field, highest);
    srnf_free(field);
    return picture;
}

/* Bilinear in the angles; beyond the first and the last row, the row's value. */
static double interpolate(const struct srnf_grid *grid, const double *values, const double e[3])
{
    double theta = acos(fmin(fmax(e[2], -1.0), 1.0));
    double column = (atan2(e[1], e[0]) / (2.0 * acos(-1.0)) + 1.0) * (double)grid->n_phi;
    size_t left = (size_t)column;
    size_t row = 0;
    double along = column - (double)left;
    double down;
    double rows[2];

    while (row + 2 < grid->n_theta && grid->theta[row + 1] < theta) {
        row++;
    }
    down = (theta - grid->theta[row]) / (grid->theta[row + 1] - grid->theta[row]);
    down = fmin(fmax(down, 0.0), 1.0);
    for (size_t k = 0; k < 2; k++) {
        const double *at = values + (row + k) * grid->n_phi;

        rows[k] = (1.0 - along) * at[left % grid->n_phi] + along * at[(left + 1) % grid->n_phi];
    }
    return (1.0 - down) * rows[0] + down * rows[1];
}

struct picture picture_draw_field(size_t degree, const double *coefficients,
                                  const struct picture_view *view, const struct srnf_grid *grid,
                                  const double *values, double highest)
{
    struct picture picture;
    struct srnf_mesh sphere;
    double *field;

    report_must(srnf_mesh_icosphere(FREQUENCY, &sphere) == SRNF_OK, "out of memory");
    field = srnf_alloc(sphere.n_vertices, sizeof(double));
    report_must(field != NULL, "out of memory");
    for (size_t i = 0; i < sphere.n_vertices; i++) {
        field[i] = interpolate(grid, values, sphere.vertices + 3 * i);
    }
    picture = draw(degree, coefficients, view, field, highest);
    srnf_free(field);
    srnf_mesh_clear(&sphere);
    return picture;
}

void picture_clear(struct picture *picture)
{
    free(picture->png);
    picture->png = NULL;
}
