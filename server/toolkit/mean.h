/*
 * mean.h - what the processes that begin with the mean of a group share: the inputs that say how it
 * is computed, the mean itself, and what results tell of it.
 */
#ifndef SRNFD_TOOLKIT_MEAN_H
#define SRNFD_TOOLKIT_MEAN_H

#include "compute/mean.h"
#include "toolkit/group.h"
#include "toolkit/group_doubts.h"
#include "toolkit/group_landmarks.h"
#include "toolkit/registration_options.h"
#include "toolkit/routes.h"

struct store_maps; /* store/surface.h */

/* ---- Inputs ---------------------------------------------------------------------------------- */

struct mean_input {
    bool registered, common_pose;
    double tolerance;
    long lmax, max_iterations;
    int method;                             /* place among the choices of the process */
    struct group_landmarks_input landmarks; /* none where the process does not take them */
};

/* Rows of a table whose typed inputs have a struct mean_input called mean. replaced: the input that
   stands in place of them, or NULL. */
#define MEAN_INPUTS(typed, replaced)                                                              \
    {"register",                                                                                  \
     INPUT_BOOLEAN,                                                                               \
     offsetof(struct typed, mean.registered),                                                     \
     "Register every surface to the mean, with the default options of register; false: as they "  \
     "are parameterized.",                                                                        \
     .fallback = 1,                                                                               \
     .unless = replaced},                                                                         \
        {"commonPose", INPUT_BOOLEAN, offsetof(struct typed, mean.common_pose),                   \
         "The surfaces share a pose: nothing is rotated. Keeps correspondence better in aligned " \
         "data.",                                                                                 \
         .unless = replaced},                                                                     \
        {"tolerance",                                                                             \
         INPUT_REAL,                                                                              \
         offsetof(struct typed, mean.tolerance),                                                  \
         "On the change of the mean SRNF in one iteration, relative to its norm. Where surfaces " \
         "are registered, the mean is also found when its objective falls by less than this "     \
         "part of itself twice in a row.",                                                        \
         .lowest = PROCESS_MEAN_TOLERANCE_MIN,                                                    \
         .highest = PROCESS_MEAN_TOLERANCE_MAX,                                                   \
         .fallback = PROCESS_MEAN_TOLERANCE_DEFAULT,                                              \
         .unless = replaced},                                                                     \
        {"lmax",                                                                                  \
         INPUT_INTEGER,                                                                           \
         offsetof(struct typed, mean.lmax),                                                       \
         "Degree of the mean; the surfaces are cut or filled up to it. Default: the largest of "  \
         "theirs.",                                                                               \
         .lowest = SRNF_DEGREE_MIN,                                                               \
         .highest = SRNF_DEGREE_MAX,                                                              \
         .derived = true,                                                                         \
         .unless = replaced},                                                                     \
    {                                                                                             \
        "maxIterations", INPUT_INTEGER, offsetof(struct typed, mean.max_iterations),              \
            "Iterations after which the mean is a result as it is, with converged false and, "    \
            "above 1, the warning mean-not-converged.",                                           \
            .lowest = 1, .highest = PROCESS_MEAN_ITERATIONS_MAX,                                  \
            .fallback = PROCESS_MEAN_ITERATIONS_DEFAULT, .unless = replaced                       \
    }
/* Of processes whose results have MEAN_RESULT_OUTPUTS; mean_complete judges them. */
#define MEAN_LANDMARKS_INPUT(typed) GROUP_LANDMARKS_INPUT(struct typed, mean.landmarks)
/* The method of all that needs the mean SRNF itself. */
#define MEAN_SRNF_METHOD(typed, text, replaced)                            \
    {                                                                      \
        "method", INPUT_CHOICE, offsetof(struct typed, mean.method), text, \
            .choices = mean_srnf_methods, .unless = replaced               \
    }
extern const char *const mean_srnf_methods[];

/* For complete: sets lmax, by default the degree of the group, and checks the memory for `copies`
   fields of each surface. */
void mean_complete(struct process_inputs *inputs, size_t copies);
/* The same with bytes beside these fields, of a group of n at that degree. */
typedef double mean_bytes(const struct process_inputs *inputs, size_t n, long degree);
void mean_complete_beside(struct process_inputs *inputs, size_t copies, mean_bytes *more);
/* How many of so many there are of a mean, and its components, that compares no pairs of a group so
   large (COMPUTE_PAIRS_MAX): the registered ones alone. */
size_t mean_copies(const struct process_inputs *inputs, size_t copies);

/* ---- The mean -------------------------------------------------------------------------------- */

struct group_mean {
    const struct group_input *members;
    bool positions; /* where the parts of subjects are counts too: no part may be turned */
    struct srnf_register_options options;
    struct compute_mean_inputs inputs; /* registration points to options, or is NULL */
    struct group_landmarks landmarks;
    struct compute_mean_outputs outputs;
};

/* Loads the group and computes what is asked of it.
     more  [in] fit, components, share and pullback of what compute_mean takes
   Returns 0, or a negative status with the problem in result; group_mean_clear in any case. mean
   must stay where it is, and members outlive it. */
int group_mean_compute(struct jobs_run *run, const struct group_input *members,
                       const struct mean_input *asked, struct compute_mean_inputs more,
                       struct group_mean *mean, struct jobs_result *result);
void group_mean_clear(struct group_mean *mean);
/* [n] the surfaces whose SRNFs the fields of the members are: of a mean that registers none. NULL
   of others. */
const double *const *mean_surfaces(const struct group_mean *mean);

/* ---- Results --------------------------------------------------------------------------------- */

/* Members of results that mean_set_members sets, but for those of GROUP_LABELS_OUTPUTS. */
#define MEAN_LOSS_OUTPUT                                                \
    {                                                                   \
        "relativeEnergy", OUTPUT_NUMBER_OR_NULL,                        \
            "What is lost of the mean SRNF by being that of a surface." \
    }
/* The same of a process whose result is not the mean. */
#define MEAN_MEMBERS_OUTPUTS                                                       \
    {"iterations", OUTPUT_INTEGER, "Of the mean."},                                \
        {"converged", OUTPUT_BOOLEAN,                                              \
         "False where maxIterations was reached first (mean-not-converged)."},     \
        {"history", OUTPUT_OBJECTS, "As in mean."}, MEAN_LOSS_OUTPUT,              \
        {"seconds", OUTPUT_NUMBER_OR_NULL, "Of the mean."}, BRIDGED_GROUP_OUTPUTS, \
        REGISTRATION_OUTPUT
/* And of one whose result it is. */
#define MEAN_RESULT_OUTPUTS                                                                      \
    {"iterations", OUTPUT_INTEGER, "Of the mean."},                                              \
        {"converged", OUTPUT_BOOLEAN,                                                            \
         "False where maxIterations was reached first (mean-not-converged)."},                   \
        {"history", OUTPUT_OBJECTS,                                                              \
         "[{iteration, change (relative, of the mean SRNF), variance (mean squared distance to " \
         "it), objective (variance relative to the mean squared norm, and mean penalty: never "  \
         "rises, unless members of one subject are turned to lie alike), seconds}]."},           \
        GROUP_LABELS_OUTPUTS,                                                                    \
        {"distances", OUTPUT_NUMBERS_OR_NULLS, "Of each surface from the mean SRNF."},           \
        MEAN_LOSS_OUTPUT,                                                                        \
        {"seconds", OUTPUT_NUMBER_OR_NULL, "Of the iterations, over all attempts."},             \
        GROUP_LANDMARKS_OUTPUT, BRIDGED_GROUP_OUTPUTS, REGISTRATION_OUTPUT

/* Of the mean surface: the mean of those of the members. */
double mean_scale(struct jobs_run *run, const struct group_mean *mean);

/* Stores the mean surface with maps, or NULL for none; its record, or NULL with the problem set. */
json_t *mean_keep_surface(struct jobs_run *run, const char *process, const char *name,
                          const struct group_mean *mean, const struct store_maps *maps,
                          struct jobs_result *result);

/* iterations, converged, history, relativeEnergy, seconds, registration, bridged and
   bridgedSurfaces. */
void mean_set_members(json_t *document, const struct group_mean *mean);
/* All of MEAN_RESULT_OUTPUTS, and the warnings of the members and the mean. Takes the document over
   and returns it, or NULL with the problem set. */
json_t *mean_finish(struct jobs_run *run, const struct group_mean *mean, json_t *document,
                    struct jobs_result *result);

/* The warning of a mean that still moved when its iterations ran out; a single iteration was asked
   for as such. */
void mean_warn_converged(const struct group_mean *mean, json_t *document);
/* That, and warnings of what the members are called, and of the same content twice. */
void mean_warn_members(struct jobs_run *run, const struct group_mean *mean, json_t *document);
/* Adds the warnings of group_doubts.h; of `doubts` the classes and their names are read. Takes the
   document over as mean_finish does. */
json_t *mean_warn(struct jobs_run *run, const struct group_mean *mean, struct group_doubts doubts,
                  json_t *document, struct jobs_result *result);

#endif
