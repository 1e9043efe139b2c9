/*
 * surface.h - surfaces of a degree, and encoding a mesh as one (core/surface).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_SURFACE_H
#define SRNF_PUBLIC_SURFACE_H

#include "srnf/base.h"
#include "srnf/mesh.h"
#include "srnf/sphere.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

struct srnf_surface_measures {
    double area, volume, centroid[3]; /* volume is signed, the centroid that of area */
};
/* Area, volume and centroid by the quadrature of the transform's grid. workspace: at least
   srnf_surface_workspace_size bytes. coefficients: double[3][(L+1)^2]. */
size_t srnf_surface_workspace_size(const struct srnf_sht *sht);
void srnf_surface_measure(const struct srnf_sht *sht, const double *coefficients,
                          struct srnf_surface_measures *measures, void *workspace);
/*
 * The same of n surfaces, coefficients double[n][3][(L+1)^2].
 * Errors: SRNF_ENOMEM, SRNF_ECANCELED (measures of some are then missing).
 */
SRNF_CHECKED int srnf_surfaces_measure(const struct srnf_sht *sht, size_t n,
                                       const double *coefficients,
                                       const struct srnf_context *context,
                                       struct srnf_surface_measures *measures);

/* The surface at another degree: its series is cut off, or filled up with zeros.
   coefficients: double[3][(from+1)^2]; out: double[3][(to+1)^2], another array. */
void srnf_surface_change_degree(size_t from, const double *coefficients, size_t to, double *out);
/* Moves the surface so that its area centroid, which measures holds, becomes target. */
void srnf_surface_move(size_t degree, double *coefficients, struct srnf_surface_measures *measures,
                       const double target[3]);
/*
 * L2 distance over the sphere of a surface from the truth, as it would be at unit area of the
 * truth: without the terms of degree 0, since an SRNF knows no translations, and with the sign of
 * the truth that gives it a positive volume, as srnf_invert returns (Q(-f) = Q(f)).
 *   truth, coefficients  [in] double[3][(degree+1)^2]
 *   measures             [in] of the truth; its area is above 0
 */
double srnf_surface_error(size_t degree, const double *truth,
                          const struct srnf_surface_measures *measures, const double *coefficients);

/* The surface as a triangle mesh over srnf_mesh_icosphere(frequency), with its exact unit normals
   (double[n_vertices][3], freed with srnf_free) when normals is not NULL. */
SRNF_CHECKED int srnf_surface_triangulate(size_t degree, const double *coefficients,
                                          size_t frequency, struct srnf_mesh *mesh,
                                          double **normals);

/*
 * The mirror image in the plane x = 0, in place (core/surface/mirror.c). A mesh is reflected, x to
 * -x, and its faces are turned: they stay counter-clockwise seen from outside if they were. A
 * surface f(e) becomes M f(M e), M = diag(-1, 1, 1): orientation, area and volume are kept, its
 * SRNF is M Q(f) o M, and distances between surfaces are those between their mirror images. Either
 * is its own inverse, exactly. Left and right structures of a body are mirror images of each other
 * up to their own differences, and no rotation brings one onto the other.
 *   coefficients  [in/out] double[3][(L+1)^2]
 */
void srnf_mesh_mirror(struct srnf_mesh *mesh);
void srnf_surface_mirror(size_t degree, double *coefficients);
/*
 * The same in the plane through the origin with this normal: H = I - 2 n n' in the place of M in
 * space, while the sphere is reflected by M all the same. With n = (1, 0, 0) they are those above,
 * bit by bit; otherwise either is its own inverse to rounding.
 *   normal        [in]     n, of length 1
 *   coefficients  [in/out] double[3][(L+1)^2]
 */
void srnf_mesh_mirror_in(struct srnf_mesh *mesh, const double normal[3]);
void srnf_surface_mirror_in(size_t degree, double *coefficients, const double normal[3]);

/* Distances between a mesh and the surface fitted to it, from both sides: area-weighted over the
   vertices of the mesh and over a triangulation of the surface. In the units of the mesh. */
struct srnf_fit {
    double rms, p95, max;
    double diagonal; /* bounding-box diagonal of the mesh */
};

/* How the sphere is laid on a mesh. */
enum srnf_parameterization {
    SRNF_PARAMETERIZATION_AUTO = 0,
    SRNF_PARAMETERIZATION_STAR = 1,  /* f = r e + c: radial from a centre of the star kernel */
    SRNF_PARAMETERIZATION_AREA = 2,  /* srnf_spherical_map: any mesh of genus 0 */
    SRNF_PARAMETERIZATION_GIVEN = 3, /* by a second mesh of the same faces on a sphere */
};
const char *srnf_parameterization_name(enum srnf_parameterization parameterization);

/* How far a map from a mesh to the unit sphere is from an isometry up to scale. */
struct srnf_distortion {
    double symmetric_dirichlet; /* energy / 4 pi: 4 for an isometry, larger otherwise */
    double log_area_deviation;  /* standard deviation of the log of the area ratio */
    size_t flipped;             /* faces that the map turns over: 0 in what is returned */
};

struct srnf_encode_options {
    size_t degree; /* 4 .. 127; default 31 */
    enum srnf_parameterization parameterization;
    bool center_given; /* otherwise the centre of srnf_star_kernel; asks for the route star */
    double center[3];
    const struct srnf_mesh *sphere; /* of the route given: prepared, the same faces in the same
                                       order, vertices on a sphere of any centre and radius */
    const struct srnf_star *kernel; /* srnf_star_kernel of the mesh, from a caller who has it;
                                       default NULL: it is solved here */
    bool unit_area;                 /* scale to unit area; default true */
    double smoothing; /* sigma >= 0 of the heat kernel exp(-sigma l (l + 1)) on r or f; default 0 */
};
struct srnf_encode_options srnf_encode_options_defaults(void);
/* The route that these options lead to: the one asked for; of auto, star where a centre is given
   and area otherwise, whatever the mesh, so that encodings by default can be compared. */
enum srnf_parameterization srnf_encode_route(const struct srnf_encode_options *options);

struct srnf_encoded {
    size_t degree;
    double *coefficients; /* [3][(L+1)^2], centred at its area centroid; owned, srnf_free */
    double scale;         /* multiplies the surface back to the units of the mesh */
    double origin[3];     /* of the stored surface in the frame of the mesh: x = scale f + origin */
    enum srnf_parameterization route; /* star, area or given */
    char reason[240];                 /* one sentence: why this route */
    struct srnf_star star;            /* of the mesh, whatever the route */
    struct srnf_distortion distortion;
    struct srnf_fit fit;
    struct srnf_surface_measures measures; /* of the surface as stored */
    /* Of the surface, in the units of the mesh, over those of the mesh. */
    double volume_ratio, area_ratio;
};

/*
 * From a prepared mesh without problems to a surface of the given degree, centred and scaled. Star
 * samples r along rays and analyses it to degree L - 1, so that f = r e has degree L exactly; area
 * and given analyse the coordinates as srnf_spherical_map or options->sphere lay them out. Auto
 * takes what srnf_encode_route says; where that fails, no other route takes its place.
 *   report  [in] of srnf_mesh_prepare; its first problem is returned as the error
 * Errors: SRNF_ENOT_CLOSED .. SRNF_ENOT_STAR, SRNF_EINVAL (an option, or a sphere that is none:
 * element is then its first face or vertex at fault), SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_encode(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report,
                             const struct srnf_encode_options *options,
                             const struct srnf_context *context, struct srnf_encoded *encoded,
                             struct srnf_error *error);

/*
 * Where a route puts each vertex of a mesh, as vectors from the centre of the sphere: of star,
 * vertex less centre (options->center, or that of srnf_star_kernel); of area and given, unit
 * vectors. For srnf_warp_between.
 *   report   [in]  of srnf_mesh_prepare
 *   options  [in]  as for srnf_encode
 *   points   [out] double[n_vertices][3]
 * Errors: as srnf_encode.
 */
SRNF_CHECKED int srnf_encode_points(const struct srnf_mesh *mesh,
                                    const struct srnf_mesh_report *report,
                                    const struct srnf_encode_options *options,
                                    const struct srnf_context *context, double *points,
                                    struct srnf_error *error);

/* What an encoding is worth as a picture of its mesh. */
enum srnf_verdict {
    SRNF_FAITHFUL = 0,
    SRNF_POOR,       /* farther from the mesh than is usual at its degree */
    SRNF_UNFAITHFUL, /* another shape: not to be used */
};
struct srnf_judgement {
    enum srnf_verdict verdict;
    double fit;    /* fit.rms / fit.diagonal */
    double max;    /* fit.max / fit.diagonal */
    double volume; /* of the surface, in the units of the mesh, over that of the mesh */
    double area;   /* the same for the area */
    double energy; /* distortion.symmetric_dirichlet */
};

/*
 * Judges an encoding by how far it is from its mesh; the limits, and what they were set by, stand
 * in core/surface/judge.c. A pure function of a few numbers: any thread, no errors.
 *   encoded   [in]  of srnf_encode, as it came
 *   report    [in]  of the mesh that was encoded
 *   smoothed  [in]  the encoding was damped (options->smoothing > 0): then it is never refused for
 *                   being off, which was asked for
 *   judgement [out] the verdict, which is returned as well, and what it rests on
 */
enum srnf_verdict srnf_encode_judge(const struct srnf_encoded *encoded,
                                    const struct srnf_mesh_report *report, bool smoothed,
                                    struct srnf_judgement *judgement);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
