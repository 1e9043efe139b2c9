/*
 * meshes.h - meshes for tests: shapes with known properties, and shapes with known faults.
 *
 * Each function returns a mesh that the caller clears with srnf_mesh_clear, and ends the program
 * when memory is short. Faces are counter-clockwise from outside unless the name says otherwise.
 */
#ifndef TESTS_MESHES_H
#define TESTS_MESHES_H

#include "srnf.h"

/* A mesh of this size with nothing filled in. */
struct srnf_mesh meshes_blank(size_t n_vertices, size_t n_faces);
struct srnf_mesh meshes_copy(const struct srnf_mesh *mesh);
/* Both meshes, the second one's vertices and faces after the first one's. */
struct srnf_mesh meshes_join(const struct srnf_mesh *a, const struct srnf_mesh *b);
/* Without the faces for which drop[f]; vertices stay. */
struct srnf_mesh meshes_without_faces(const struct srnf_mesh *mesh, const bool *drop);
/* Each face with three vertices of its own, as STL has it. */
struct srnf_mesh meshes_soup(const struct srnf_mesh *mesh);

/* In place. */
void meshes_scale(struct srnf_mesh *mesh, double factor);
void meshes_move(struct srnf_mesh *mesh, double x, double y, double z);
void meshes_stretch(struct srnf_mesh *mesh, double x, double y, double z);
void meshes_turn(struct srnf_mesh *mesh, uint64_t seed); /* by a random rotation */
void meshes_flip(struct srnf_mesh *mesh);

/* Closed, of genus zero. */
struct srnf_mesh meshes_sphere(size_t frequency);
/* r = 1 + .2 cos 2u sin^2 v + .15 cos^3 v + .1 sin 3u sin^3 v on the geodesic sphere. */
struct srnf_mesh meshes_star(size_t frequency);
/* r = 1 + a smooth bump per random direction; star-shaped from the origin. */
struct srnf_mesh meshes_bumpy(size_t frequency, uint64_t seed);
struct srnf_mesh meshes_box(double x, double y, double z); /* edges, centred; 12 faces */
struct srnf_mesh meshes_tetrahedron(void);                 /* (0,0,0) and the three unit vectors */
/* Along x: a cylinder of this length with half-spheres on its ends. */
struct srnf_mesh meshes_capsule(double length, double radius, size_t rings, size_t sides);
/* The same bent in the xz plane through this angle; from half a turn on not star-shaped when it is
   slim. */
struct srnf_mesh meshes_bent_capsule(double length, double radius, double angle, size_t rings,
                                     size_t sides);
struct srnf_mesh meshes_inside_out_sphere(size_t frequency);

/* With one fault each. */
struct srnf_mesh meshes_torus(double major, double minor, size_t rings, size_t sides);
struct srnf_mesh meshes_sphere_with_hole(size_t frequency); /* one face missing */
struct srnf_mesh meshes_two_spheres(size_t frequency);      /* side by side */
struct srnf_mesh meshes_klein_bottle(size_t rings,
                                     size_t sides); /* one-sided, Euler characteristic 0 */
struct srnf_mesh meshes_projective_plane(void);     /* one-sided, Euler characteristic 1 */
struct srnf_mesh meshes_bowtie(void);               /* two tetrahedra that share vertex 0 */
struct srnf_mesh
meshes_shared_edge(void); /* two tetrahedra that share edge 0 1: four faces there */
struct srnf_mesh
meshes_fin(void); /* a tetrahedron with a fifth face on edge 0 1: three faces there */
struct srnf_mesh meshes_one_face_turned(size_t frequency); /* a sphere with face 7 turned */
struct srnf_mesh meshes_flat(void); /* a square, closed by its own back: no volume */

/* Reads a mesh file. False when there is no such file; ends the program when it cannot be read. */
bool meshes_load(const char *path, struct srnf_mesh *mesh);

#endif
