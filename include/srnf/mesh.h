/*
 * mesh.h - triangle meshes: files, reports, star-shapedness, maps to the sphere (core/mesh).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_MESH_H
#define SRNF_PUBLIC_MESH_H

#include "srnf/base.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_mesh_format {
    SRNF_MESH_UNKNOWN = 0,
    SRNF_MESH_PLY, /* ascii, binary_little_endian, binary_big_endian */
    SRNF_MESH_OBJ,
    SRNF_MESH_OFF,
    SRNF_MESH_STL,        /* ascii and binary */
    SRNF_MESH_VTK,        /* legacy polydata, ASCII and BINARY */
    SRNF_MESH_GIFTI,      /* ASCII, Base64Binary, GZipBase64Binary; both byte orders */
    SRNF_MESH_FREESURFER, /* binary triangle surface, big-endian, magic ff ff fe */
    SRNF_MESH_GLB,        /* glTF 2.0 in one binary file */
    SRNF_MESH_VTP,        /* VTK's XML polydata */
    SRNF_MESH_GLTF,       /* glTF 2.0 as JSON with its buffers inside */
    SRNF_MESH_MZ3,        /* of Surf Ice */
    SRNF_MESH_FREESURFER_ASCII,
    SRNF_MESH_BYU,       /* Movie.BYU */
    SRNF_MESH_MNI_OBJ,   /* ascii and binary */
    SRNF_MESH_GMSH,      /* 2.2 and 4.1, ascii and binary */
    SRNF_MESH_BRAINVISA, /* ascii and binary */
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
    const struct srnf_context *context; /* asked whether to go on; default NULL: never */
    /* [in/out] bytes that what is packed may still unpack to, counted down, for those who read many
       files; where they do not suffice it is 0 and the read fails (SRNF_ELIMIT). Default NULL: only
       max_memory bounds them. */
    size_t *unpack_left;
};
struct srnf_mesh_limits srnf_mesh_limits_defaults(void);

/* What a reader found out beside the mesh. */
struct srnf_mesh_read_info {
    enum srnf_mesh_format format;
    size_t polygons_triangulated; /* faces with more than three corners, cut into triangles */
    size_t face_count_error;      /* STL: faces that its header promises too many or too few */
    size_t trailing_bytes;        /* STL: behind the last face, ignored */
    bool transform_ignored; /* GIfTI: the point set has a matrix to another space that does more
                                     than move the points; they are taken as they stand */
};

/* The format that the first bytes speak for; SRNF_MESH_UNKNOWN if none. */
enum srnf_mesh_format srnf_mesh_sniff(const void *bytes, size_t size);

/* What the bytes are where they are certainly no mesh that can be read, as one word ("zip",
   "nifti", "pdf", ...); NULL if that cannot be told. What is packed by gzip is looked into. */
const char *srnf_mesh_stranger(const void *bytes, size_t size);

/* Short name as in the HTTP contract ("ply", "obj", "off", "stl", "vtk", "gii", "freesurfer",
   "glb", "vtp", "gltf", ...), and back. */
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
 * SRNF_ELIMIT, SRNF_ENOMEM, SRNF_ECANCELED. Time and memory are bounded by the size of the input
 * and the limits; limits->context is asked after every few milliseconds.
 */
SRNF_CHECKED int srnf_mesh_read(const void *bytes, size_t size, enum srnf_mesh_format format,
                                const struct srnf_mesh_limits *limits, struct srnf_mesh *mesh,
                                struct srnf_mesh_read_info *info, struct srnf_error *error);

/* A growing byte buffer with a ceiling. Zero-initialize; free with srnf_buffer_clear. */
struct srnf_buffer {
    unsigned char *data;
    size_t size, capacity;
    size_t max; /* 0: SRNF_BUFFER_MAX */
};
#define SRNF_BUFFER_MAX ((size_t)1 << 30)
SRNF_CHECKED int srnf_buffer_append(struct srnf_buffer *buffer, const void *bytes, size_t size);
void srnf_buffer_clear(struct srnf_buffer *buffer);

/* A scalar per vertex that travels with a written mesh. Unit and meaning are texts as those of
   struct srnf_mesh_description, or NULL; GLB, VTP and GIfTI carry them. */
struct srnf_mesh_field {
    const char *name;     /* [A-Za-z0-9_]+ */
    const double *values; /* [n_vertices] */
    const char *unit;     /* "mm", "the input's unit", "1", ... */
    const char *meaning;  /* one sentence */
};

/* What a written file says of itself, where its format has a place for it. Each is NULL or one line
   of at most 400 printable ASCII characters other than " \ < > and &; GLB, VTP and GIfTI carry all
   three, PLY and OBJ as comments, VTK space and the beginning of the comment in its title, STL the
   space. */
struct srnf_mesh_description {
    const char *name;    /* of the mesh */
    const char *space;   /* of the coordinates: one word, "original" or "normalized" */
    const char *comment; /* one sentence: units and place */
};

/*
 * Writes a mesh: PLY (binary little-endian), OBJ, STL (binary), VTK (legacy polydata, binary), VTP
 * (polydata in XML, base64), GIfTI (base64, gzip) or GLB (glTF 2.0). Fields ride along in PLY
 * (vertex properties), VTK and VTP (point data), GIfTI (shape arrays) and GLB (custom attributes
 * _NAME, and the first one as vertex colours); OBJ and STL cannot carry them.
 *   normals  [in] double[n_vertices][3] or NULL (then GLB computes area-weighted ones)
 * Coordinates are single precision in STL, GIfTI and GLB, double elsewhere.
 * Errors: SRNF_EINVAL (a format that is only read; a text that is not as above), SRNF_ENOMEM,
 * SRNF_ELIMIT.
 */
SRNF_CHECKED int srnf_mesh_write(const struct srnf_mesh *mesh, enum srnf_mesh_format format,
                                 const double *normals, const struct srnf_mesh_field *fields,
                                 size_t n_fields, struct srnf_buffer *out);
/* The same, and the file says what it is.
     description  [in] NULL: says nothing */
SRNF_CHECKED int srnf_mesh_write_described(const struct srnf_mesh *mesh,
                                           enum srnf_mesh_format format, const double *normals,
                                           const struct srnf_mesh_field *fields, size_t n_fields,
                                           const struct srnf_mesh_description *description,
                                           struct srnf_buffer *out);

/* Lossless repairs that srnf_mesh_prepare has made. */
struct srnf_mesh_repairs {
    size_t duplicate_vertices_merged;    /* of each group of equal points, all but one */
    size_t collapsed_faces_dropped;      /* that named a vertex twice, most of them by merging */
    size_t duplicate_faces_dropped;      /* the same three vertices the same way round as another */
    size_t folded_faces_dropped;         /* back to back: flaps without thickness, inner walls */
    size_t touching_vertices_kept_apart; /* equal points that are several vertices all the same,
                                            since the surface touches itself there */
    size_t unreferenced_vertices_dropped;
    size_t faces_flipped; /* all of them, when the whole mesh was inside out; otherwise 0 */
};

/* One thing that keeps a mesh from being analysed. */
struct srnf_mesh_problem {
    int status;       /* SRNF_ENOT_CLOSED .. SRNF_EDEGENERATE */
    size_t count;     /* boundary edges, non-manifold edges or vertices, components, ... */
    int64_t first;    /* lowest number in the file of an offending face (a triangle; of a vertex for
                      fans), from 0; -1 where there is none */
    char detail[256]; /* what, where, and what would help */
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
    /* Least step of the coordinates at their largest size, in single precision where all of them
       fit into it and in double otherwise, over the mean length of an edge. From about 0.1 on the
       surface is as much rounding as shape. */
    double coarseness;
    struct srnf_mesh_repairs repairs;
    size_t n_problems;
    struct srnf_mesh_problem problems[SRNF_MESH_PROBLEMS_MAX]; /* ordered as enum srnf_status */
};

/*
 * Repairs what can be repaired without loss, in place, and reports on topology and size.
 *   mesh          [in/out] vertices may be renumbered, faces dropped; what stays keeps its order
 *   weld_vertices [in]     join vertices with equal coordinates, -0 and 0 alike, and drop the faces
 *                          that vanish by it, unless the mesh means them to be several: where that
 *                          alone makes it one closed surface of genus zero (core/mesh/prepare.c).
 *                          Otherwise vertices and faces stay as their indices say
 *   report        [out]    always complete on success; a mesh with problems is no error
 * Cost O(n log n). Errors: SRNF_EINVAL (an index out of range, a coordinate that is not finite,
 * more than 2^31 / 3 faces), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_mesh_prepare(struct srnf_mesh *mesh, bool weld_vertices,
                                   struct srnf_mesh_report *report);
/* The same, which can be canceled. Errors: SRNF_ECANCELED too; what is left of the mesh is then to
   be cleared, and nothing else.
     context  [in] NULL: not to be canceled */
SRNF_CHECKED int srnf_mesh_prepare_within(struct srnf_mesh *mesh, bool weld_vertices,
                                          const struct srnf_context *context,
                                          struct srnf_mesh_report *report);

/*
 * Prepares a mesh and a sphere for it (srnf_encode_options.sphere): where the two have the same
 * faces in the same order, what is done to the mesh is done to the sphere, whatever its own points
 * are, so that they still correspond. Such a mesh keeps its vertices as they are if it can be
 * encoded so: where points go on the sphere is given for each of them. Other pairs are prepared one
 * by one, welded; what differs then is for srnf_encode to say.
 *   mesh, sphere  [in/out] as srnf_mesh_prepare
 *   report        [out]    of the mesh
 * Cost and errors as srnf_mesh_prepare, for either of them.
 */
SRNF_CHECKED int srnf_mesh_prepare_pair(struct srnf_mesh *mesh, struct srnf_mesh *sphere,
                                        struct srnf_mesh_report *report);
/* The same, which can be canceled, as srnf_mesh_prepare_within. */
SRNF_CHECKED int srnf_mesh_prepare_pair_within(struct srnf_mesh *mesh, struct srnf_mesh *sphere,
                                               const struct srnf_context *context,
                                               struct srnf_mesh_report *report);

/* Star-shapedness. The centre maximizes the margin: the largest t with <n_f, c> + t <= <n_f, v_f>
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
/* The same, which can be canceled. Errors: SRNF_ECANCELED too. */
SRNF_CHECKED int srnf_star_kernel_within(const struct srnf_mesh *mesh,
                                         const struct srnf_context *context,
                                         struct srnf_star *star);

/* The same at a given centre. Errors: SRNF_EINVAL (not finite, beyond 1e100), SRNF_EDEGENERATE,
   SRNF_ENOMEM. */
SRNF_CHECKED int srnf_star_at(const struct srnf_mesh *mesh, const double center[3],
                              struct srnf_star *star);

/* Faces of a mesh that go through each other. */
struct srnf_mesh_crossings {
    size_t pairs;       /* of faces */
    size_t faces[2];    /* the first pair, where there is any */
    double position[3]; /* between the two */
};
/*
 * Finds the pairs of faces of which one goes through the inside of the other, for certain: what
 * touches within rounding, or lies in one plane, does not count (core/mesh/intersect.c).
 * Errors: SRNF_EINVAL (an index out of range, too many faces), SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_mesh_find_crossings(const struct srnf_mesh *mesh,
                                          const struct srnf_context *context,
                                          struct srnf_mesh_crossings *crossings);

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

struct srnf_icp_options {
    size_t max_iterations; /* 0 .. 10000, default 100; 0: the distance where the meshes stand */
    double tolerance;      /* stop when the residual falls by less than this part; default 1e-3 */
};
struct srnf_icp_options srnf_icp_options_defaults(void);

struct srnf_icp {
    double rotation[9], translation[3]; /* x -> R x + t lays the moving mesh on the fixed one */
    double distance; /* root of half of: mean squared distance of the vertices of each mesh from the
                        other one, weighted by area */
    size_t iterations;
    bool converged;
};

/*
 * Rigid alignment by iterated closest points (core/registration/icp.c). The residual counts both
 * ways, so that the distance of (a, b) and (b, a) differs by rounding alone. A local minimum,
 * sought from the pose at hand and from the four in which the principal axes agree.
 *   options  [in] NULL: defaults
 * Neither mesh has to be closed. Errors: SRNF_EINVAL (an index out of range, a coordinate not
 * finite, options), SRNF_EDEGENERATE (no area), SRNF_ENUMERIC, SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_icp(const struct srnf_mesh *fixed, const struct srnf_mesh *moving,
                          const struct srnf_icp_options *options,
                          const struct srnf_context *context, struct srnf_icp *result,
                          struct srnf_error *error);

/* A bijective map of a closed mesh of genus zero to the unit sphere. */
struct srnf_spherical_map {
    double *points;             /* [n_vertices][3], unit vectors; owned, freed with srnf_free */
    double symmetric_dirichlet; /* these three as in struct srnf_distortion */
    double log_area_deviation;
    size_t flipped;
    size_t attempts; /* 1: the first choice of constants did it */
};

/*
 * Low-distortion spherical parameterization by progressive insertion with a barrier energy (method
 * and sources in core/sphere_map/sphere_map.h). The rotation of the map is canonical: in another
 * pose or numbering a mesh gets the same map up to the tolerance of the relaxation (about 0.01 on
 * the unit sphere), or, if it is symmetric to that, another choice of axes. The same mesh always
 * gives the same bits.
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

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
