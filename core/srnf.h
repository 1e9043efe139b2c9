/*
 * srnf.h - the one public header of libsrnf: elastic shape analysis of closed surfaces of genus
 * zero by square-root normal fields (SRNFs).
 *
 * Source of the method: Q. Xie, I. Jermyn, S. Kurtek, A. Srivastava, "Numerical Inversion of SRNFs
 * for Efficient Elastic Shape Analysis of Star-Shaped Objects", ECCV 2014; "the paper" below. The
 * glossary of symbols and the derivations that go beyond the paper are in core/README.md.
 *
 * CONVENTIONS, used everywhere and never departed from
 *
 *   Sphere      colatitude theta in (0, pi), longitude phi in [0, 2 pi),
 *               e = (sin theta cos phi, sin theta sin phi, cos theta). Integrals are over the area
 *               of the unit sphere, 4 pi in all.
 *   Grid        n_theta rows of n_phi equispaced longitudes phi_j = 2 pi j / n_phi. Rows run from
 *               north to south: Gauss-Legendre nodes, or equiangular rows
 *               theta_i = pi i / (n_theta - 1) with the poles. The working grid of degree L has
 *               n_theta = ceil(3 (L + 1) / 2), n_phi = 2 n_theta.
 *   Basis       real orthonormal spherical harmonics Y_lm, 0 <= l <= L, at index l*l + l + m:
 *               m > 0 carries cos(m phi), m < 0 sin(|m| phi), no Condon-Shortley sign.
 *   Surface     f : S^2 -> R^3 as double[3][(L+1)^2]: the x block, the y block, the z block.
 *   Fields      scalar fields on the grid as double[n_theta][n_phi]; a batch of b fields is
 *               double[b][n_theta][n_phi]. A vector field is a batch of three.
 *   Normal      n = f_theta x (f_phi / sin theta), outward for f = e.
 *   SRNF        q = n / |n|^(1/2), the zero vector where n = 0; integral of |q|^2 = area.
 *   Action      a rotation O acts as f -> O f and q -> O q; translations leave q unchanged;
 *               Q(-f) = Q(f).
 *
 * The library is pure: no input or output, no global state, no clock, no random device, no locale,
 * no printing. Seeds, threads, progress and cancellation come in as arguments. Every function may
 * be called from any number of threads at once on distinct outputs; objects described as immutable
 * may be shared. The one exception lies in FFTW: see srnf_sht_create.
 */
#ifndef SRNF_H
#define SRNF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SRNF_CHECKED __attribute__((warn_unused_result))

#define SRNF_VERSION "0.1.0"

/* Degrees the library is built and tested for. */
#define SRNF_DEGREE_MIN 4
#define SRNF_DEGREE_MAX 127

/* What srnf_sht_create accepts: no more than memory and the recurrences are fit for. */
#define SRNF_TRANSFORM_DEGREE_MAX ((size_t)1000)
#define SRNF_GRID_ROWS_MAX ((size_t)4096)

/* ---- Status ---------------------------------------------------------------------------------- */

/* 0 is success, negative values are errors (outputs are then untouched or freed), positive ones
   warnings (outputs are valid, and the result says what is wrong with them). */
enum srnf_status {
    SRNF_OK = 0,
    SRNF_ENOMEM = -1,        /* an allocation failed */
    SRNF_EINVAL = -2,        /* an argument is outside its documented range */
    SRNF_ELIMIT = -3,        /* the input is larger than the limits given */
    SRNF_ECANCELED = -4,     /* the caller asked to stop */
    SRNF_EFORMAT = -5,       /* the bytes are in no known mesh format */
    SRNF_EPARSE = -6,        /* the bytes break the rules of their format */
    SRNF_ENOT_CLOSED = -7,   /* the mesh has a boundary */
    SRNF_ENOT_MANIFOLD = -8, /* an edge with three faces or more, or a vertex that joins two fans */
    SRNF_ENOT_ORIENTED = -9, /* neighbouring faces disagree about the outside */
    SRNF_ECOMPONENTS = -10,  /* more than one connected component */
    SRNF_EGENUS = -11,       /* Euler characteristic other than 2 */
    SRNF_EDEGENERATE = -12,  /* no area, no volume, or a face that names one vertex twice */
    SRNF_ENOT_STAR = -13,    /* no point sees the whole surface, or not from the given centre */
    SRNF_ENUMERIC = -14,     /* a factorisation, an eigensolver or a line search broke down */
    SRNF_WNOT_CONVERGED = 1, /* stopped before the tolerance was reached */
};

/* One sentence for each status, never NULL; static storage. */
const char *srnf_strerror(int status);

/* Where and why a call failed. Optional everywhere (NULL is accepted); untouched on success. */
struct srnf_error {
    int status;
    int64_t element;   /* the first offending face, vertex or byte, as message says; -1: none */
    char message[240]; /* one sentence in English that names the member, face or limit */
};

/* ---- Progress, cancellation, threads --------------------------------------------------------- */

/* What a long computation gets from its caller. NULL, or NULL members, mean: silent, not
   cancellable, one thread. parallel_for must call body(argument, i) once for each i in [0, count),
   in any order, on any threads, and return when all calls have returned; results never depend on
   how it spreads them. Where bodies report or ask for cancellation, progress and canceled are
   called from those threads. */
struct srnf_context {
    void *user;
    void (*progress)(void *user, double fraction, const char *message);
    bool (*canceled)(void *user);
    void (*parallel_for)(void *user, size_t count, void (*body)(void *argument, size_t index),
                         void *argument);
    double (*seconds)(void *user); /* a monotonic clock, for histories; NULL: all 0 */
};

/* ---- Spherical harmonic transform (core/sphere) ---------------------------------------------- */

enum srnf_grid_kind {
    SRNF_GRID_GAUSS_LEGENDRE = 0, /* exact quadrature for degree 2 n_theta - 1 */
    SRNF_GRID_EQUIANGULAR = 1,    /* poles, Clenshaw-Curtis weights, exact for degree n_theta - 1 */
};

/* A grid and its quadrature. Immutable. weight is the weight of one node of the row, so that
   n_phi * sum(weight) = 4 pi. */
struct srnf_grid {
    enum srnf_grid_kind kind;
    size_t n_theta, n_phi;
    const double *theta;     /* [n_theta] increasing, in radians */
    const double *cos_theta; /* [n_theta] */
    const double *sin_theta; /* [n_theta] */
    const double *weight;    /* [n_theta] */
};

/* Transform of one degree on one grid: Legendre tables and FFTW plans. Immutable after creation. */
struct srnf_sht;

static inline size_t srnf_coefficient_count(size_t degree)
{
    return (degree + 1) * (degree + 1);
}

/* Rows of the working grid of a degree: ceil(3 (L + 1) / 2). */
static inline size_t srnf_working_rows(size_t degree)
{
    return (3 * (degree + 1) + 1) / 2;
}

/*
 * Creates a transform.
 *   out      [out] the transform, to be freed with srnf_sht_destroy; NULL on error
 *   degree   [in]  0 .. 1000
 *   kind     [in]  the rows
 *   n_theta  [in]  0: the working grid (SRNF_GRID_GAUSS_LEGENDRE); otherwise at least degree + 1
 *                  (Gauss-Legendre) or 2 degree + 1 (equiangular), the least on which analysis is
 *                  exact
 *   n_phi    [in]  0: 2 n_theta; otherwise at least 2 degree + 1
 * Errors: SRNF_EINVAL, SRNF_ENOMEM.
 * Threads: FFTW's planner is shared by the whole process. Creation and destruction are safe from
 * several threads only after fftw_make_planner_thread_safe() has been called once; execution always
 * is.
 */
SRNF_CHECKED int srnf_sht_create(struct srnf_sht **out, size_t degree, enum srnf_grid_kind kind,
                                 size_t n_theta, size_t n_phi);
void srnf_sht_destroy(struct srnf_sht *sht);

const struct srnf_grid *srnf_sht_grid(const struct srnf_sht *sht);
size_t srnf_sht_degree(const struct srnf_sht *sht);

/* Bytes of workspace that one call with this batch needs; aligned as srnf_alloc aligns. */
size_t srnf_sht_workspace_size(const struct srnf_sht *sht, size_t batch);

/*
 * The transform and its relatives, on a batch of fields at once. None allocates; each is re-entrant
 * given its own workspace. coefficients: double[batch][(L+1)^2]; fields:
 * double[batch][n_theta][n_phi]. Inputs and outputs must not overlap.
 *
 *   synthesis          values = sum_lm c_lm Y_lm
 *   synthesis_adjoint  its transpose: c_lm = sum over nodes of Y_lm values (no weights)
 *   analysis           c_lm = sum over nodes of weight Y_lm values: inverts synthesis for degree L
 *   gradient           d_theta = d/dtheta, d_phi = (1 / sin theta) d/dphi (its limit at a pole)
 *   gradient_adjoint   transpose of gradient: c_lm = sum over nodes of Y_theta a + (Y_phi / sin) b
 * The cost is O(batch L^3) for the Legendre part and O(batch L^2 log L) for the Fourier part.
 */
void srnf_sht_synthesis(const struct srnf_sht *sht, size_t batch, const double *coefficients,
                        double *values, void *workspace);
void srnf_sht_synthesis_adjoint(const struct srnf_sht *sht, size_t batch, const double *values,
                                double *coefficients, void *workspace);
void srnf_sht_analysis(const struct srnf_sht *sht, size_t batch, const double *values,
                       double *coefficients, void *workspace);
void srnf_sht_gradient(const struct srnf_sht *sht, size_t batch, const double *coefficients,
                       double *d_theta, double *d_phi, void *workspace);
void srnf_sht_gradient_adjoint(const struct srnf_sht *sht, size_t batch, const double *d_theta,
                               const double *d_phi, double *coefficients, void *workspace);

/*
 * Harmonic series and their gradients at arbitrary points of the sphere.
 *   points        [in]  double[n][3], unit vectors
 *   coefficients  [in]  double[batch][(L+1)^2]
 *   values        [out] double[batch][n], or NULL
 *   gradients     [out] double[batch][n][3], the tangential gradient as a vector of R^3 (regular at
 *   the
 *                       poles), or NULL
 * Cost O(n L^2 batch). Errors: SRNF_EINVAL (degree above 1000), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_harmonics_at_points(size_t degree, size_t batch, const double *coefficients,
                                          size_t n, const double *points, double *values,
                                          double *gradients);

/* ---- Meshes (core/mesh) ---------------------------------------------------------------------- */

enum srnf_mesh_format {
    SRNF_MESH_UNKNOWN = 0,
    SRNF_MESH_PLY, /* ascii, binary_little_endian, binary_big_endian */
    SRNF_MESH_OBJ,
    SRNF_MESH_OFF,
    SRNF_MESH_STL,        /* ascii and binary */
    SRNF_MESH_VTK,        /* legacy polydata, ASCII and BINARY */
    SRNF_MESH_GIFTI,      /* ASCII, Base64Binary, GZipBase64Binary; both byte orders */
    SRNF_MESH_FREESURFER, /* binary triangle surface, big-endian, magic ff ff fe */
    SRNF_MESH_GLB,        /* written only */
};

/* A triangle mesh. Faces are counter-clockwise seen from outside. */
struct srnf_mesh {
    size_t n_vertices, n_faces;
    double *vertices; /* [n_vertices][3], in the units of the file */
    uint32_t *faces;  /* [n_faces][3], indices below n_vertices */
};
/* Frees what the mesh owns and clears it; the struct itself belongs to the caller. */
void srnf_mesh_clear(struct srnf_mesh *mesh);

struct srnf_mesh_limits {
    size_t max_vertices; /* default 4,000,000 */
    size_t max_faces;    /* default 8,000,000 */
    size_t max_memory;   /* bytes that one read may hold at once, beside the input; default 1 GiB */
};
struct srnf_mesh_limits srnf_mesh_limits_defaults(void);

/* What a reader found out beside the mesh. */
struct srnf_mesh_read_info {
    enum srnf_mesh_format format;
    size_t polygons_triangulated; /* faces with more than three corners, cut into fans */
};

/* The format that the first bytes speak for; SRNF_MESH_UNKNOWN if none. */
enum srnf_mesh_format srnf_mesh_sniff(const void *bytes, size_t size);

/* Short name as in the HTTP contract ("ply", "obj", "off", "stl", "vtk", "gii", "freesurfer",
   "glb"), and back. */
const char *srnf_mesh_format_name(enum srnf_mesh_format format);
enum srnf_mesh_format srnf_mesh_format_from_name(const char *name);

/*
 * Reads a mesh from memory.
 *   bytes, size  [in]  the file's content; any bytes at all are safe
 *   format       [in]  the format, or SRNF_MESH_UNKNOWN to sniff it
 *   limits       [in]  NULL: defaults. Counts promised by a header are checked against them and
 *                      against what the remaining bytes can hold before anything is allocated
 *   mesh         [out] to be cleared; every index is in range, every coordinate finite
 *   info, error  [out] optional
 * Errors: SRNF_EFORMAT, SRNF_EPARSE (element: the byte, face or vertex, as the message says),
 * SRNF_ELIMIT, SRNF_ENOMEM. Time and memory are bounded by the size of the input and the limits.
 */
SRNF_CHECKED int srnf_mesh_read(const void *bytes, size_t size, enum srnf_mesh_format format,
                                const struct srnf_mesh_limits *limits, struct srnf_mesh *mesh,
                                struct srnf_mesh_read_info *info, struct srnf_error *error);

/* A growing byte buffer with a ceiling. Zero-initialise; free with srnf_buffer_clear. */
struct srnf_buffer {
    unsigned char *data;
    size_t size, capacity;
    size_t max; /* 0: SRNF_BUFFER_MAX */
};
#define SRNF_BUFFER_MAX ((size_t)1 << 30)
SRNF_CHECKED int srnf_buffer_append(struct srnf_buffer *buffer, const void *bytes, size_t size);
void srnf_buffer_clear(struct srnf_buffer *buffer);

/* A scalar per vertex that travels with a written mesh. */
struct srnf_mesh_field {
    const char *name;     /* [A-Za-z0-9_]+ */
    const double *values; /* [n_vertices] */
};

/*
 * Writes a mesh: PLY (binary little-endian), OBJ, STL (binary), VTK (legacy polydata, binary) or
 * GLB (glTF 2.0). Fields ride along in PLY (vertex properties), VTK (point data) and GLB (custom
 * attributes _NAME, and the first one as vertex colours); OBJ and STL cannot carry them.
 *   normals  [in] double[n_vertices][3] or NULL (then GLB computes area-weighted ones)
 * Coordinates are single precision in STL and GLB, double elsewhere.
 * Errors: SRNF_EINVAL (a format that is only read), SRNF_ENOMEM, SRNF_ELIMIT.
 */
SRNF_CHECKED int srnf_mesh_write(const struct srnf_mesh *mesh, enum srnf_mesh_format format,
                                 const double *normals, const struct srnf_mesh_field *fields,
                                 size_t n_fields, struct srnf_buffer *out);

/* Lossless repairs that srnf_mesh_prepare has made. */
struct srnf_mesh_repairs {
    size_t duplicate_vertices_merged; /* only where the format has no shared vertices (STL) */
    size_t unreferenced_vertices_dropped;
    size_t faces_flipped; /* all of them, when the whole mesh was inside out; otherwise 0 */
};

/* One thing that keeps a mesh from being analysed. */
struct srnf_mesh_problem {
    int status;    /* SRNF_ENOT_CLOSED .. SRNF_EDEGENERATE */
    size_t count;  /* boundary edges, non-manifold edges or vertices, components, ... */
    int64_t first; /* lowest index of an offending face (vertex for fans), -1 where there is none */
    char detail[160];
};
#define SRNF_MESH_PROBLEMS_MAX 8

struct srnf_mesh_report {
    bool closed;          /* every edge has two faces or more */
    bool edge_manifold;   /* no edge has more than two */
    bool vertex_manifold; /* the faces around each vertex form one fan */
    bool oriented;        /* the two faces of an edge traverse it in opposite directions */
    size_t components;
    int64_t euler_characteristic;
    int64_t genus; /* of a closed, manifold, oriented, connected mesh; -1 otherwise */
    double area;   /* in squared units */
    double volume; /* signed, of the mesh after the repairs, in cubed units */
    double bounding_box_diagonal;
    double centroid[3]; /* of area */
    struct srnf_mesh_repairs repairs;
    size_t n_problems;
    struct srnf_mesh_problem problems[SRNF_MESH_PROBLEMS_MAX]; /* ordered as enum srnf_status */
};

/*
 * Repairs what can be repaired without loss, in place, and reports on topology and size.
 *   mesh            [in/out] vertices may be renumbered; faces keep their order
 *   merge_vertices  [in]     join vertices with equal coordinates, -0 and 0 alike (for STL)
 *   report          [out]    always complete on success; a mesh with problems is no error
 * Cost O(n log n). Errors: SRNF_EINVAL (an index out of range, a coordinate that is not finite,
 * more than 2^31 / 3 faces), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_mesh_prepare(struct srnf_mesh *mesh, bool merge_vertices,
                                   struct srnf_mesh_report *report);

/* Star-shapedness. The centre maximises the margin: the largest t with <n_f, c> + t <= <n_f, v_f>
   for every face, n_f its unit normal; t > 0 is the radius of a ball of points that see the whole
   surface. */
struct srnf_star {
    bool value; /* margin > 0 beyond rounding */
    double center[3];
    double margin;                  /* in units of length; negative: no point sees everything */
    double violating_area_fraction; /* of the faces that the centre sees from behind */
};

/*
 * Best centre by linear programming (the dual simplex problem in four rows, GLPK), for a closed and
 * oriented mesh. Faces of zero area are left out.
 * Errors: SRNF_EDEGENERATE (no face with an area), SRNF_ENUMERIC, SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_star_kernel(const struct srnf_mesh *mesh, struct srnf_star *star);

/* The same at a given centre. Errors: SRNF_EINVAL (not finite, beyond 1e100), SRNF_EDEGENERATE,
   SRNF_ENOMEM. */
SRNF_CHECKED int srnf_star_at(const struct srnf_mesh *mesh, const double center[3],
                              struct srnf_star *star);

/* Spatial index over the triangles of a mesh (bounding-volume hierarchy). Immutable; keeps a
   pointer to the mesh, which must outlive it. */
struct srnf_index;
SRNF_CHECKED int srnf_index_create(struct srnf_index **out, const struct srnf_mesh *mesh);
void srnf_index_destroy(struct srnf_index *index);

/* Largest t >= 0 at which origin + t direction meets the mesh; watertight across shared edges of a
   closed mesh. Returns false, and leaves t alone, where the ray meets nothing. face is optional. */
bool srnf_index_ray(const struct srnf_index *index, const double origin[3],
                    const double direction[3], double *t, uint32_t *face);

/* Squared distance from a point to the mesh; nearest[3] and face may be NULL. */
double srnf_index_distance2(const struct srnf_index *index, const double point[3],
                            double nearest[3], uint32_t *face);

/* A bijective map of a closed mesh of genus zero to the unit sphere. */
struct srnf_spherical_map {
    double *points;             /* [n_vertices][3], unit vectors; owned, freed with srnf_free */
    double symmetric_dirichlet; /* these three as in struct srnf_distortion */
    double log_area_deviation;
    size_t flipped;
    size_t attempts; /* 1: the first choice of constants did it */
};

/*
 * Low-distortion spherical parameterisation by progressive insertion with a barrier energy (method
 * and sources in core/mesh/spherical.h). The rotation of the map is canonical: in another pose or
 * numbering a mesh gets the same map up to the tolerance of the relaxation (about 0.01 on the unit
 * sphere), or, if it is symmetric to that, another choice of axes. The same mesh always gives the
 * same bits.
 *   mesh  [in] closed, manifold, oriented, connected, of genus 0
 * Errors: SRNF_ENOT_CLOSED .. SRNF_EDEGENERATE (the mesh is not what it has to be, or has no
 * area), SRNF_EINVAL (an index out of range, a vertex without faces, too many faces),
 * SRNF_ENUMERIC (no valid map found), SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_spherical_map(const struct srnf_mesh *mesh,
                                    const struct srnf_context *context,
                                    struct srnf_spherical_map *map, struct srnf_error *error);

/* Geodesic sphere: the icosahedron with each edge cut in frequency parts, 20 frequency^2 faces, on
   the unit sphere. Errors: SRNF_EINVAL (0 or above 400), SRNF_ENOMEM. */
SRNF_CHECKED int srnf_mesh_icosphere(size_t frequency, struct srnf_mesh *mesh);

/* ---- Surfaces (core/shape) ------------------------------------------------------------------- */

struct srnf_surface_measures {
    double area, volume, centroid[3]; /* volume is signed, the centroid that of area */
};
/* Area, volume and centroid by the quadrature of the transform's grid. workspace: at least
   srnf_surface_workspace_size bytes. coefficients: double[3][(L+1)^2]. */
size_t srnf_surface_workspace_size(const struct srnf_sht *sht);
void srnf_surface_measure(const struct srnf_sht *sht, const double *coefficients,
                          struct srnf_surface_measures *measures, void *workspace);

/* The surface as a triangle mesh over srnf_mesh_icosphere(frequency), with its exact unit normals
   (double[n_vertices][3], freed with srnf_free) when normals is not NULL. */
SRNF_CHECKED int srnf_surface_triangulate(size_t degree, const double *coefficients,
                                          size_t frequency, struct srnf_mesh *mesh,
                                          double **normals);

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
    bool unit_area;                 /* scale to unit area; default true */
    double smoothing; /* sigma >= 0 of the heat kernel exp(-sigma l (l + 1)) on r or f; default 0 */
};
struct srnf_encode_options srnf_encode_options_defaults(void);
/* The route that auto takes for a mesh of this bounding-box diagonal: star or area. */
enum srnf_parameterization srnf_encode_route(const struct srnf_star *star, double diagonal);

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
};

/*
 * From a prepared mesh without problems to a surface of the given degree, centred and scaled. Star
 * samples r along rays and analyses it to degree L - 1, so that f = r e has degree L exactly; area
 * and given analyse the coordinates as srnf_spherical_map or options->sphere lay them out. Auto
 * takes what srnf_encode_route says, and the other route where that fails.
 *   report  [in] of srnf_mesh_prepare; its first problem is returned as the error
 * Errors: SRNF_ENOT_CLOSED .. SRNF_ENOT_STAR, SRNF_EINVAL (an option, or a sphere that is none:
 * element is then its first face or vertex at fault), SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_encode(const struct srnf_mesh *mesh, const struct srnf_mesh_report *report,
                             const struct srnf_encode_options *options,
                             const struct srnf_context *context, struct srnf_encoded *encoded,
                             struct srnf_error *error);

/* ---- SRNFs (core/shape) ---------------------------------------------------------------------- */

/*
 * SRNF of a surface on the grid of sht: q double[3][n_theta][n_phi]. workspace as for
 * srnf_surface_measure. The degree of sht is the degree of the surface.
 */
void srnf_field(const struct srnf_sht *sht, const double *coefficients, double *q, void *workspace);

/*
 * The differential Q_*f(w) (the paper, section 3; formula in core/README.md): out
 * double[3][n_theta][n_phi]. Where n = 0 the differential does not exist and 0 is returned.
 */
void srnf_field_differential(const struct srnf_sht *sht, const double *coefficients,
                             const double *direction, double *out, void *workspace);

/*
 * E(f) = ||Q(f) - q||^2 and, when gradient is not NULL, its derivative in the coefficients,
 * double[3][(L+1)^2] (the paper, Eq. 1 to 5, in the orthonormal basis).
 */
double srnf_energy(const struct srnf_sht *sht, const double *coefficients, const double *q,
                   double *gradient, void *workspace);

/* integral of <a, b> over the sphere, a and b double[3][n_theta][n_phi]. */
double srnf_inner_product(const struct srnf_grid *grid, const double *a, const double *b);

/*
 * Closed-form inverse (the paper, Eq. 9): r = sqrt(|q| <q, e>), f = r e, analysed to the degree of
 * sht. Exact to rounding when q is the SRNF of a star-shaped surface in its radial parameterisation
 * about any centre with r of degree L - 1; anything else must be checked with srnf_energy. Where
 * <q, e> < 0, r = 0.
 *   relative_energy [out] E(f) / ||q||^2; 1 when q = 0
 */
void srnf_invert_closed_form(const struct srnf_sht *sht, const double *q, double *coefficients,
                             double *relative_energy, void *workspace);

enum srnf_inversion_method {
    SRNF_INVERT_AUTO = 0,
    SRNF_INVERT_GAUSS_NEWTON = 1,
    SRNF_INVERT_SPECTRAL = 2,
    SRNF_INVERT_GRADIENT = 3,
    SRNF_INVERT_CLOSED_FORM = 4,
};

enum srnf_initial {
    SRNF_INITIAL_AUTO = 0,    /* the closed form where it is good, the sphere otherwise */
    SRNF_INITIAL_SPHERE = 1,  /* R e with R in SO(3) maximising <R e, q>, at the area of q */
    SRNF_INITIAL_STAR = 2,    /* the closed form */
    SRNF_INITIAL_SURFACE = 3, /* coefficients given */
};

enum srnf_stop {
    SRNF_STOP_TOLERANCE = 0,  /* relative energy at or below the tolerance */
    SRNF_STOP_STATIONARY = 1, /* the energy no longer falls: a minimum with positive energy */
    SRNF_STOP_MAX_ITERATIONS = 2,
    SRNF_STOP_CANCELED = 3,
};
const char *srnf_stop_name(enum srnf_stop stop);

struct srnf_invert_options {
    enum srnf_inversion_method method;
    enum srnf_initial initial;
    const double *surface; /* [3][(L+1)^2] for SRNF_INITIAL_SURFACE */
    double tolerance;      /* on the relative energy; default 1e-12, 1e-30 .. 1 */
    size_t max_iterations; /* 0: the method's own (LM 200 steps, gradient 20,000) */
    bool certify; /* singular value and certificate too (costly above degree 31); default true */
};
struct srnf_invert_options srnf_invert_options_defaults(void);
struct srnf_iteration {
    double energy;     /* raw E */
    double seconds;    /* since the start, by context->seconds */
    double transforms; /* cost so far in gradient transforms of three coordinates */
};

struct srnf_certificate {
    bool computed;   /* false: too large, not asked for, not converged, or q not exact */
    double residual; /* smallest eigenvalue of T against int |grad f|^2, in [0, 1], at the result */
    double second_eigenvalue; /* the next one; 0 where it drowned in rounding */
    double threshold;         /* what it must exceed to mean anything */
    bool unique; /* the surface is the only one of its degree, up to sign and translation */
};

struct srnf_inversion {
    double *coefficients; /* [3][(L+1)^2], positive volume, l = 0 terms 0; owned, srnf_free */
    double energy, relative_energy;
    double gradient_norm; /* of E in the coefficients */
    size_t iterations;
    bool converged;
    enum srnf_stop stopped;
    enum srnf_inversion_method method; /* that produced the result */
    size_t n_history;
    struct srnf_iteration *history; /* [n_history], owned */
    double transforms;
    bool flipped;                   /* -f was found first and turned */
    double smallest_singular_value; /* of Q_* off the translations; 0: not computed */
    double surface_error_bound; /* L2 distance to the true surface, see core/README.md; < 0: none */
    struct srnf_certificate certificate;
    double closed_form_relative_energy;
};

/*
 * Finds f with Q(f) = q (recipe and theory in core/README.md).
 *   sht      [in]  degree and grid
 *   q        [in]  double[3][n_theta][n_phi]
 * Returns SRNF_OK, SRNF_WNOT_CONVERGED (result valid, converged false), or SRNF_EINVAL (q is 0 or
 * not finite), SRNF_ENOMEM, SRNF_ECANCELED, SRNF_ENUMERIC.
 */
SRNF_CHECKED int srnf_invert(const struct srnf_sht *sht, const double *q,
                             const struct srnf_invert_options *options,
                             const struct srnf_context *context, struct srnf_inversion *result,
                             struct srnf_error *error);
void srnf_inversion_clear(struct srnf_inversion *result);

enum srnf_geodesic_method {
    SRNF_GEODESIC_SRNF = 0,        /* each point of the straight line in Q inverted numerically */
    SRNF_GEODESIC_CLOSED_FORM = 1, /* ... by the closed form */
    SRNF_GEODESIC_LINEAR = 2,      /* straight line between the surfaces */
};

struct srnf_geodesic_options {
    enum srnf_geodesic_method method;
    size_t steps; /* surfaces, both ends included; 2 .. 101, default 7 */
};
struct srnf_geodesic_options srnf_geodesic_options_defaults(void);
struct srnf_geodesic {
    size_t degree, steps;
    double *coefficients;       /* [steps][3][(L+1)^2] */
    double *times;              /* [steps], 0 to 1 */
    double *energy_geodesic;    /* [steps] ||Q(f_t) - q_t||^2 of the surfaces returned */
    double *energy_closed_form; /* [steps] the same of the closed form (the paper, Fig. 4) */
    double *energy_linear;      /* [steps] the same of (1 - t) f_0 + t f_1 */
    double distance;            /* ||Q(f_0) - Q(f_1)||: the length of the straight line in Q */
    double length;              /* sum of ||Q(f_i+1) - Q(f_i)|| along the surfaces returned */
    double transforms;
};

/*
 * Geodesic between two surfaces as they are parameterised (the paper, section 4.1). The points are
 * inverted in order; each starts from the best of the path extrapolated so far, the linear blend
 * and the closed form.
 *   from, to  [in] double[3][(L+1)^2]
 * Errors as srnf_invert. The result is freed with srnf_geodesic_clear.
 */
SRNF_CHECKED int srnf_geodesic(const struct srnf_sht *sht, const double *from, const double *to,
                               const struct srnf_geodesic_options *options,
                               const struct srnf_context *context, struct srnf_geodesic *result,
                               struct srnf_error *error);
void srnf_geodesic_clear(struct srnf_geodesic *result);

/* ---- Registration (core/shape) --------------------------------------------------------------- */

enum srnf_register_start {
    SRNF_START_TOURNAMENT = 0, /* many rotations, narrowed down while the fields grow */
    SRNF_START_RIGID = 1,      /* the best rotation, refined */
    SRNF_START_IDENTITY = 2,
};

struct srnf_register_options {
    bool rotation;           /* turn the values; default true */
    bool reparameterization; /* warp the domain; default true. false: rotations of the domain only
                                where start is not identity */
    size_t degree;           /* of the fields that generate the warp, 1 .. 32; default 12 */
    double penalty_jacobian; /* weight of integral (1 + J) (log J)^4; default 0.003 */
    double penalty_displacement; /* weight of min integral |e - O' sqrt(J) gamma|^2; default 0.01 */
    enum srnf_register_start start;
    bool common_pose; /* the data share a pose: no rotation anywhere, start identity */
    bool symmetric;   /* both ways, the lower objective, swap polish: equal for (a, b) and (b, a) */
    bool exact;       /* no penalty, up to degree 32: for surfaces that differ by a warp alone */
};
struct srnf_register_options srnf_register_options_defaults(void);

/* A warp gamma as a chain of maps, applied in order: enough to replay it on any points. */
enum srnf_warp_kind {
    SRNF_WARP_ROTATION = 0,    /* values: double[9], row-major */
    SRNF_WARP_EXP = 1,         /* p -> exp_p(w(p)), w = grad phi + p x grad psi; values:
                                  double[2][(degree+1)^2], phi and psi */
    SRNF_WARP_EXP_INVERSE = 2, /* the inverse of that map */
};
struct srnf_warp_link {
    enum srnf_warp_kind kind;
    size_t degree;
    double *values;
};
struct srnf_warp {
    size_t n_links, capacity;
    struct srnf_warp_link *links;
};
void srnf_warp_clear(struct srnf_warp *warp);
/* gamma at points [n][3], and its Jacobian [n] (or NULL). Errors: SRNF_ENOMEM, SRNF_ENUMERIC. */
SRNF_CHECKED int srnf_warp_apply(const struct srnf_warp *warp, size_t n, const double *points,
                                 double *warped, double *jacobian);

struct srnf_registration {
    double *coefficients; /* [3][(L+1)^2] of O f2 o gamma, analysed to the degree of the pair */
    double *q;          /* [3][n_theta][n_phi] O sqrt(J) q2 o gamma on the template's grid, exact */
    double rotation[9]; /* O, row-major */
    struct srnf_warp warp;
    double *points;                    /* [n_theta][n_phi][3] gamma on the template's grid */
    double *jacobian;                  /* [n_theta][n_phi] */
    double distance;                   /* ||q1 - O sqrt(J) q2 o gamma||, on the search's grid */
    double distance_before;            /* ||q1 - q2|| */
    double objective;                  /* distance^2 / ||q1||^2 + penalties */
    double min_jacobian, max_jacobian; /* on half as many rows again, 72 at least */
    double inverse_consistency; /* symmetric only: relative gap of the objectives of the two ways */
    double
        ambiguity_objective; /* objective of the best start in another basin / the best; 0: none */
    double ambiguity_angle;  /* rms angle between the two maps, radians */
    double
        rotational_curvature; /* smallest eigenvalue of the energy over rotations of the domain */
    double truncation_error;  /* ||q of coefficients - q|| relative to ||q|| */
    size_t iterations;
    bool converged;
};
void srnf_registration_clear(struct srnf_registration *registration);

/*
 * Registers a moving surface to a template: min over O in SO(3) and gamma in Diff+(S^2) of
 * ||q1 - O (q2, gamma)|| with penalties (core/shape/registration.h). Every accepted step keeps
 * orientation.
 *   sht               [in] degree and grid of both surfaces
 *   template_surface  [in] double[3][(L+1)^2], or NULL when template_q is given
 *   template_q        [in] double[3][n_theta][n_phi], or NULL: from template_surface
 *   moving            [in] double[3][(L+1)^2]
 *   warm              [in] a registration of the same pair to start from, or NULL
 * Errors: SRNF_EINVAL, SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED. symmetric needs
 * template_surface.
 */
SRNF_CHECKED int srnf_register(const struct srnf_sht *sht, const double *template_surface,
                               const double *template_q, const double *moving,
                               const struct srnf_register_options *options,
                               const struct srnf_registration *warm,
                               const struct srnf_context *context,
                               struct srnf_registration *registration, struct srnf_error *error);

/* ---- Statistics (core/stats) ----------------------------------------------------------------- */

/*
 * Symmetric matrix of distances between n surfaces, double[n][n], diagonal 0. Pairs run in parallel
 * through the context. options NULL: as parameterised, no registration; otherwise symmetric is set.
 *   surfaces  [in] n pointers to double[3][(L+1)^2]
 * Errors: as srnf_register; the matrix is then undefined.
 */
SRNF_CHECKED int srnf_distances(const struct srnf_sht *sht, size_t n, const double *const *surfaces,
                                const struct srnf_register_options *options,
                                const struct srnf_context *context, double *matrix,
                                struct srnf_error *error);

struct srnf_mean_options {
    const struct srnf_register_options *registration; /* NULL: as parameterised */
    double tolerance;      /* relative change of the mean q; default 1e-3 */
    size_t max_iterations; /* default 20 */
    /* Called after each iteration with all that is needed to go on from there: a caller that keeps
       the bytes can hand them back as `resume`. Optional. */
    void (*checkpoint)(void *user, const void *bytes, size_t size);
    void *checkpoint_user;
    const void *resume; /* of the same surfaces and options, or NULL */
    size_t resume_size;
};
struct srnf_mean_options srnf_mean_options_defaults(void);
struct srnf_mean_iteration {
    double change;   /* ||mu_k - mu_k-1|| / ||mu_k|| */
    double variance; /* mean squared distance to the mean q */
    double seconds;
};
struct srnf_mean {
    size_t n;
    double *coefficients;   /* [3][(L+1)^2] the mean surface: mean_q inverted once */
    double *mean_q;         /* [3][n_theta][n_phi] */
    double *registered_q;   /* [n][3][n_theta][n_phi] the subjects, registered to the mean */
    double *distances;      /* [n] to the mean */
    double relative_energy; /* of the inversion of mean_q: what is lost by being a surface */
    size_t iterations;
    bool converged;
    struct srnf_mean_iteration *history; /* [iterations] */
};
void srnf_mean_clear(struct srnf_mean *mean);

/*
 * Karcher mean (the paper, Algorithm 2): register all to the mean SRNF, average, keep the
 * parameterisation centred, repeat; one inversion at the end. Starts from the medoid of the
 * unregistered distances, or from the plain mean in a common pose. Subjects run in parallel.
 */
SRNF_CHECKED int srnf_karcher_mean(const struct srnf_sht *sht, size_t n,
                                   const double *const *surfaces,
                                   const struct srnf_mean_options *options,
                                   const struct srnf_context *context, struct srnf_mean *mean,
                                   struct srnf_error *error);

/* Principal components of registered SRNFs about their mean, with quadrature weights: eigenvectors
   of the n x n Gram matrix. Signs are fixed: the largest entry of each score column is positive. */
struct srnf_pca {
    size_t n, components;
    double *eigenvalues; /* [components] variances (divided by n - 1), decreasing, above rounding */
    double *explained;   /* [components] shares of the total variance; */
    double total_variance;
    double *modes;  /* [components][3][n_theta][n_phi], orthonormal */
    double *scores; /* [n][components] */
};
void srnf_pca_clear(struct srnf_pca *pca);
/* max_components 0: all above rounding. registered_q: [n][3][n_theta][n_phi]. */
SRNF_CHECKED int srnf_pca_fit(const struct srnf_grid *grid, size_t n, const double *mean_q,
                              const double *registered_q, size_t max_components,
                              struct srnf_pca *pca);
/* Scores of another q in the frozen model, and the norm of what the modes cannot represent. */
void srnf_pca_project(const struct srnf_grid *grid, const struct srnf_pca *pca,
                      const double *mean_q, const double *q, double *scores, double *residual);
/* q = mean_q + sum_k scores[k] mode_k */
void srnf_pca_reconstruct(const struct srnf_grid *grid, const struct srnf_pca *pca,
                          const double *mean_q, const double *scores, double *q);
/* Standard normal scores times sqrt(eigenvalue) from a seed: a counter-based generator, the same
   numbers on every machine. scores: [count][components]. */
void srnf_pca_sample(const struct srnf_pca *pca, uint64_t seed, size_t count, size_t components,
                     double *scores);

/* ---- Memory ---------------------------------------------------------------------------------- */

/* All allocation of the library goes through these two (core/memory.c): count * size bytes, zeroed,
   aligned to 64 bytes; NULL when that overflows or is not to be had. A test replaces that file to
   make the n-th allocation fail. */
void *srnf_alloc(size_t count, size_t size) __attribute__((malloc));
void srnf_free(void *pointer);

#ifdef __cplusplus
}
#endif

#endif
