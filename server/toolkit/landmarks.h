/*
 * landmarks.h - the input "landmarks" of processes that register a pair: points that correspond, by
 * the vertices of the meshes or by positions; where they lie on the spheres; and what a
 * registration leaves between them.
 */
#ifndef SRNFD_TOOLKIT_LANDMARKS_H
#define SRNFD_TOOLKIT_LANDMARKS_H

#include "toolkit/pair.h"
#include "toolkit/table.h"

#define LANDMARKS_GIVEN_MAX 64 /* SRNF_LANDMARKS_MAX */
#define LANDMARKS_WEIGHT_MAX 1000000

/* As typed. */
struct landmarks_input {
    size_t n;                           /* 0: none */
    const char *names[2];               /* of the lists */
    json_t *ends[2];                    /* [n] vertices and positions */
    bool held_out[LANDMARKS_GIVEN_MAX]; /* measured, and nothing more */
    double weight;                      /* INFINITY: exact */
};

/*
 * The row of the table of a process whose typed inputs have a struct landmarks_input called
 * landmarks. own: landmarks_of_register, whose lists are called template and moving as its surfaces
 * are, or landmarks_of_geodesic, with from and to.
 */
#define LANDMARKS_INPUT(typed, own_)                                                             \
    {                                                                                            \
        "landmarks", INPUT_OWN, offsetof(struct typed, landmarks),                               \
            "Points that correspond: two lists of as many, each point the number of a vertex "   \
            "of the mesh (from 0) that the surface comes from, or a position [x, y, z] in the "  \
            "coordinates of that. The nearest point of the surface stands for it. weight: of "   \
            "the mean squared angle, in radians on the sphere, between where the warp takes "    \
            "the points and where they belong, in what is minimized; exact: it takes them "      \
            "there. heldOut: numbers of landmarks (from 0) that the search does not see, which " \
            "tell how well it does elsewhere.",                                                  \
            .own = &(own_)                                                                       \
    }
extern const struct input_own landmarks_of_register, landmarks_of_geodesic;

#define LANDMARKS_OUTPUT                                                                         \
    {                                                                                            \
        "landmarks", OUTPUT_OBJECT_OR_NULL,                                                      \
            "null where none were given. points: for each its angle, what the registration "     \
            "leaves on the sphere, in radians; its distance, the same along a straight line "    \
            "between points of the moving surface, in the units of its input; heldOut; and "     \
            "offFixed (of the list template or from) and offMoving (moving or to), how far the " \
            "points that were given are from the surfaces, in the units of each. guiding and "   \
            "heldOut: count, maxAngle, rmsAngle, maxDistance, "                                  \
            "rmsDistance of both kinds; null where there are none of the kind. weight."          \
    }

/* For complete: vertices that the meshes do not have, or surfaces without a mesh, are problems. The
   inputs that name the surfaces are those of own. degree: of the warp. */
void landmarks_complete(struct process_inputs *inputs, const char *first, const char *second,
                        long degree);
/* For check: notes a problem where landmarks guide a search that is not made, since this input has
   this value. */
void landmarks_exclude(struct process_inputs *inputs, const char *name, bool value);

/* ---- What landmarks of a pair and of a group share ------------------------------------------- */

#define LANDMARKS_POINTS_SCHEMA                                                              \
    "{\"type\":\"array\",\"minItems\":1,\"maxItems\":" PROCESS_TEXT(                         \
        LANDMARKS_GIVEN_MAX) ",\"items\":{\"oneOf\":[{\"type\":\"integer\",\"minimum\":0},"  \
                             "{\"type\":\"array\",\"minItems\":3,\"maxItems\":3,\"items\":{" \
                             "\"type\":\"number\"}}]}}"
#define LANDMARKS_MORE_SCHEMA                                                                      \
    "\"weight\":{\"oneOf\":[{\"const\":\"exact\"},{\"type\":\"number\",\"exclusiveMinimum\":0,"    \
    "\"maximum\":" PROCESS_TEXT(LANDMARKS_WEIGHT_MAX) "}],\"default\":\"exact\"},"                 \
                                                      "\"heldOut\":{\"type\":\"array\",\"items\":" \
                                                      "{\"type\":\"integer\",\"minimum\":0},"      \
                                                      "\"default\":[]}"

/* A list of points, of /inputs/landmarks/name (new reference); NULL with a problem noted. */
json_t *landmarks_read_points(struct process_inputs *inputs, const json_t *value, const char *name);
/* "exact" or a number (new reference); NULL with a problem noted. */
json_t *landmarks_read_weight(struct process_inputs *inputs, const json_t *value);
/* Numbers of landmarks below n, rising (new reference); NULL with a problem noted. */
json_t *landmarks_read_held_out(struct process_inputs *inputs, const json_t *value, size_t n);
/* The vertices in a list, /inputs/landmarks/name, against the mesh of a surface, which `whose`
   stands for in words. */
void landmarks_check_vertices(struct process_inputs *inputs, const json_t *points, const char *name,
                              const char *id, const char *whose);
/* Places points, canonical, on a surface.
     points, off  [out] [n][3] on its sphere, and [n] from there, in the units of the place
   As landmarks_place. */
int landmarks_place_points(struct jobs_run *run, const json_t *given,
                           const struct surface_place *place, size_t degree,
                           const double *coefficients, double *points, double *off,
                           struct jobs_result *result);
/* |f(a) - f(b)| of n pairs of points of the sphere of a surface, as it is stored. Returns an enum
   srnf_status. */
int landmarks_distances(size_t degree, const double *coefficients, size_t n, const double *a,
                        const double *b, double *distances);
/* count, maxAngle, rmsAngle, maxDistance, rmsDistance of one kind of n landmarks, or null where
   there are none; angles and distances: [members][n]. New reference. */
json_t *landmarks_summary(size_t members, size_t n, const bool *held_out, bool kind,
                          const double *angles, const double *distances);
/* Warns of points that are none of their surface, of area `area` as it is stored. input: the list
   that has them, in words. */
void landmarks_warn_off(json_t *document, const char *input, const char *id, double scale,
                        double area, size_t n, const double *off);

/* ---- A pair ---------------------------------------------------------------------------------- */

/* Where the landmarks of a pair are. */
struct landmarks {
    const struct landmarks_input *input;
    size_t n;
    double *points[2]; /* [n][3] on the spheres of the ends */
    double *off[2];    /* [n] from the positions to the surfaces, in the units of the input */
    double *guiding;   /* [2][n][3] those that are not held out */
    struct srnf_landmarks pairs;
};
/* Places those of the input on a pair that was loaded, and has the search guided by those that are
   not held out. Returns 0, or a negative status with the problem set; landmarks_clear in any case,
   after the registration. */
int landmarks_place(struct jobs_run *run, const struct landmarks_input *input, struct pair *pair,
                    struct landmarks *landmarks, struct jobs_result *result);
void landmarks_clear(struct landmarks *landmarks);
/* LANDMARKS_OUTPUT, and the warnings of points that are off their surfaces, into the document of a
   registered pair. Returns 0, or a negative status with the problem set. */
int landmarks_report(struct jobs_run *run, const struct landmarks *landmarks,
                     const struct pair *pair, json_t *document, struct jobs_result *result);
/* Where landmarks raise the distance, a warp that the degree truncates follows from that, and no
   higher degree helps: registration-truncated goes. landmarks_report does so with its document. */
void landmarks_settle(json_t *document);

#endif
