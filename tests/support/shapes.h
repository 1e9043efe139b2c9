/*
 * shapes.h - surfaces whose truth is known, for tests of inversion, geodesics and encoding.
 *
 * A formula gives a point for each direction e of the sphere. It is sampled on the working grid and
 * analysed to a degree; what comes out of that is the true surface, band-limited exactly, whatever
 * the formula's own spectrum is. Surfaces have unit area and no l = 0 terms until they are moved.
 * Everything here ends the program when memory is short.
 */
#ifndef TESTS_SHAPES_H
#define TESTS_SHAPES_H

#include "srnf.h"
#include "support/random.h"

struct shapes_case {
    const char *name;
    void (*formula)(const double e[3], double parameter, double x[3]);
    double parameter;
    size_t degree;
    bool star;   /* some point sees the whole surface */
    bool unique; /* the certificate must say so; where false it must not */
};

/* Stars, ellipsoids, bent capsules, and bodies with three to twelve arms bent out of their
   plane. */
extern const struct shapes_case shapes_cases[];
extern const size_t shapes_case_count;

/* A case by its name; ends the program when there is none. */
const struct shapes_case *shapes_find(const char *name);

/* A surface, its SRNF and what computing with them needs. */
struct shapes_surface {
    struct srnf_sht *sht; /* on the working grid */
    const struct srnf_grid *grid;
    size_t degree, points;
    size_t each, count; /* (L+1)^2 and three times that */
    double *f;          /* [3][each] */
    double *q;          /* [3][points] */
    void *workspace;    /* srnf_surface_workspace_size bytes */
};

void shapes_open(struct shapes_surface *s, size_t degree); /* f and q are 0 */
void shapes_open_case(struct shapes_surface *s, const struct shapes_case *which);
void shapes_close(struct shapes_surface *s);

/* Fills f by a formula, scales to unit area, and computes q. */
void shapes_fill(struct shapes_surface *s,
                 void (*formula)(const double e[3], double parameter, double x[3]),
                 double parameter);
/* f = r e with a random r > 0 of degree L - 1, whose coefficients are kept in radius, [L^2], at the
   scale of f; radius may be NULL. */
void shapes_fill_random_star(struct shapes_surface *s, uint64_t seed, double *radius);
/* Encodes a mesh of tests/data/aal_subcortex by its structure's name, "L_thalamus"; false when the
   file is not there. */
bool shapes_fill_structure(struct shapes_surface *s, const char *structure,
                           enum srnf_parameterization route);
/* A random rotation (SO(3)) and a translation of about the surface's size. */
void shapes_move(struct shapes_surface *s, struct test_random *random);
/* q of f. */
void shapes_update(struct shapes_surface *s);
/* Adds white noise on the grid to q, of the given norm relative to that of q. */
void shapes_add_noise(struct shapes_surface *s, double amplitude, struct test_random *random);

/* L2 distance of two surfaces of one degree, translations apart. */
double shapes_distance(size_t degree, const double *a, const double *b);
/* Applies a rotation, row-major, to n vectors stored as double[3][n]. */
void shapes_rotate(const double rotation[9], size_t n, double *x);
void shapes_random_rotation(struct test_random *random, double rotation[9]);
/* Best centre of a triangulation of f (srnf_star_kernel). */
struct srnf_star shapes_star(size_t degree, const double *f);

/* Zeroed memory, to be freed with srnf_free. */
double *shapes_doubles(size_t n);

/* The formulas. parameter: none; semi-axis along z (1, 1.3, parameter); angle of the bend; arms. */
void shapes_bumpy(const double e[3], double parameter, double x[3]);
void shapes_ellipsoid(const double e[3], double parameter, double x[3]);
void shapes_capsule(const double e[3], double parameter, double x[3]);
void shapes_arms(const double e[3], double parameter, double x[3]);

#endif
