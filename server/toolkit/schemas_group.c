/*
 * schemas_group.c - the inputs and outputs of the processes on groups
 * and models as JSON Schema (2020-12). As schemas.c, which has the others; what several of
 * them have in common stands once, as macros that end inside an object, here or, where other files
 * have it too, in schemas.h.
 */
#include "api/cohorts.h"
#include "toolkit/schemas.h"

#define COMPONENTS_MAX_TEXT PROCESS_TEXT(PROCESS_COMPONENTS_MAX)
#define PULLBACK_GROUP_MAX_TEXT PROCESS_TEXT(PROCESS_PULLBACK_GROUP_MAX)
#define GROUP_MIN_TEXT PROCESS_TEXT(PROCESS_GROUP_MIN)

/* ---- What several schemas have in common ----------------------------------------------------- */

#define GROUP_INPUT                                                                             \
    "\"surfaces\":{\"type\":\"array\",\"minItems\":" GROUP_MIN_TEXT                             \
    ",\"maxItems\":" GROUP_MAX_TEXT                                                             \
    ",\"items\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN                    \
    "\"},\"description\":\"The surfaces, or cohort instead. Meshes are encoded with "           \
    "the default "                                                                              \
    "options.\"},\"cohort\":{\"type\":[\"string\",\"null\"],\"pattern\":\"" COHORT_NAME_PATTERN \
    "\",\"default\":null,\"description\":\"Name of a cohort, instead of "                       \
    "surfaces.\"}," MIXED_ROUTES_INPUT ","

#define LABELS                                                                                    \
    "\"labels\":{\"type\":\"array\",\"items\":{\"type\":\"string\"},"                             \
    "\"description\":\"A name for each surface, in order, no two the same: the subject, or else " \
    "the "                                                                                        \
    "name, or else the id, with more in brackets where that is not enough.\"},"                   \
    "\"groups\":{\"type\":[\"array\",\"null\"],\"items\":{\"type\":[\"string\",\"null\"]},"       \
    "\"description\":\"The label of each member of the cohort; null without a cohort.\"},"

/* Of mean alone, and of what is made from the mean SRNF. */
#define MEAN_METHOD                                                                              \
    ",\"method\":{\"enum\":[\"srnf\",\"pullback\"],\"default\":\"srnf\",\"description\":"        \
    "\"srnf: the surface of the mean SRNF. pullback: the surface with the least sum of squared " \
    "lengths of geodesics within the space of surfaces, of at most " PULLBACK_GROUP_MAX_TEXT     \
    " surfaces, at many times the cost; they are registered to the mean of srnf first, where "   \
    "register is true.\"}"

#define PCA_METHOD                                                                              \
    ",\"method\":{\"enum\":[\"srnf\"],\"default\":\"srnf\",\"description\":\"srnf: components " \
    "are straight lines in the space of SRNFs.\"}"

#define MEAN_OUTPUTS                                                                           \
    "\"iterations\":{\"type\":\"integer\"},\"converged\":{\"type\":\"boolean\","               \
    "\"description\":\"False where maxIterations was reached first.\"},"                       \
    "\"history\":{\"type\":\"array\",\"description\":\"[{iteration, change (relative, "        \
    "of the mean SRNF), variance (mean squared distance to it), objective (variance "          \
    "relative to the mean squared norm, and mean penalty: never rises), seconds}].\"}," LABELS \
    "\"distances\":{\"type\":\"array\",\"items\":{\"type\":[\"number\",\"null\"]},"            \
    "\"description\":\"Of each surface from the mean SRNF.\"},"                                \
    "\"relativeEnergy\":{\"type\":[\"number\",\"null\"],\"description\":\"What is lost "       \
    "of the mean SRNF by being that of a surface.\"},\"seconds\":{\"type\":[\"number\","       \
    "\"null\"],\"description\":\"Of the iterations, over all attempts.\"}," BRIDGED_GROUP      \
        REGISTRATION MADE_BY

/* ---- Schemas --------------------------------------------------------------------------------- */

const char distances_inputs_schema[] = INPUTS_OPENING
    "\"required\":[],\"properties\":{" GROUP_INPUT
    "\"register\":{\"type\":\"boolean\",\"default\":true,\"description\":\"Register, "
    "with the default options of register but both ways (symmetric); false: as the surfaces are "
    "parameterised.\"},\"metric\":{\"enum\":[\"srnf\",\"harmonic\",\"srm\",\"icp\"],"
    "\"default\":\"srnf\",\"description\":\"srnf: L2 over the sphere of the difference of "
    "SRNFs, whose squared norm is the area: in the coordinates' unit of length. harmonic: L2 over "
    "the sphere of the difference of the surfaces, centred, after a rotation: in lengths too. srm: "
    "as srnf, by square-root maps |n|^(1/2) f: in squared lengths. icp: root mean square distance "
    "of closest points, after rigid alignment: in lengths. Surfaces of unit area have the root of "
    "their area as unit.\"},"
    "\"handedness\":{\"enum\":[\"check\",\"ignore\"],\"default\":\"check\",\"description\":\""
    "Whether to try members that are left and right ones of the same, by label, "
    "subject or name, mirrored too, in 12 pairs at most, and two members alone, registered, by "
    "metric srnf, whatever they are called; and to warn where that "
    "matches clearly better (warning mirror-images); ignore saves that time.\"}}}";

const char distances_outputs_schema[] = OUTPUTS_OPENING LABELS
    "\"matrix\":{\"type\":\"array\",\"description\":\"Symmetric; also as CSV and .npy "
    "from the job's results. Of metric srnf, entries are the distance that geodesic tells of the "
    "pair, with the same register, where lmax is the larger degree of the two.\"},"
    "\"lmax\":{\"type\":\"integer\",\"description\":\"Degree at which all are compared, the "
    "largest among them; the others are filled up with zeros.\"}," BRIDGED_GROUP REGISTRATION
        MADE_BY;

const char mean_inputs_schema[] =
    INPUTS_OPENING "\"required\":[],\"properties\":{" GROUP_INPUT MEAN_INPUTS MEAN_METHOD "}}";

const char mean_outputs_schema[] = OUTPUTS_OPENING
    "\"surface\":{\"type\":\"object\",\"description\":\"Record of the mean surface, "
    "centred at its area centroid.\"},\"pullback\":{\"type\":[\"object\",\"null\"],"
    "\"description\":\"Of method pullback, null otherwise: segments of each geodesic, variance "
    "(mean squared length), meanVelocity (norm of the mean logarithm at the mean: 0 at a minimum), "
    "moved (distance from the surface of the mean SRNF), iterations, converged, transforms. "
    "distances are then the lengths, relativeEnergy is of that surface; iterations, history and "
    "seconds are of the mean SRNF that it starts from.\"}," MEAN_OUTPUTS;

const char pca_inputs_schema[] =
    INPUTS_OPENING "\"required\":[],\"properties\":{" GROUP_INPUT MEAN_INPUTS PCA_METHOD
                   ",\"components\":{\"type\":[\"integer\",\"null\"],\"minimum\":1,"
                   "\"maximum\":" COMPONENTS_MAX_TEXT
                   ",\"default\":null,\"description\":\"How many to keep at most; null: all above "
                   "rounding.\"}}}";

const char pca_outputs_schema[] =
    OUTPUTS_OPENING "\"model\":{\"type\":\"object\",\"description\":\"Record of the model: mean, "
                    "eigenvalues, explained, cumulative, scores.\"},"
                    "\"compactness\":{\"type\":\"array\",\"description\":\"[{components, value}]: "
                    "variance of the first components together.\"}," MEAN_OUTPUTS;
