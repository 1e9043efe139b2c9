/*
 * schemas_group.c - the inputs and outputs of registration and of the processes on groups
 * and models as JSON Schema (2020-12). As schemas.c, which has the others; what several of
 * them have in common stands once, as macros that end inside an object, here or, where other files
 * have it too, in schemas.h.
 */
#include "api/cohorts.h"
#include "toolkit/schemas.h"

#define COMPONENTS_MAX_TEXT PROCESS_TEXT(PROCESS_COMPONENTS_MAX)
#define PULLBACK_GROUP_MAX_TEXT PROCESS_TEXT(PROCESS_PULLBACK_GROUP_MAX)
#define GROUP_MIN_TEXT PROCESS_TEXT(PROCESS_GROUP_MIN)
#define PENALTY_MAX_TEXT PROCESS_TEXT(PROCESS_PENALTY_MAX)
#define WARP_DEGREE_DEFAULT_TEXT PROCESS_TEXT(PROCESS_WARP_DEGREE_DEFAULT)
#define WARP_DEGREE_MAX_TEXT PROCESS_TEXT(PROCESS_WARP_DEGREE_MAX)

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

const char register_inputs_schema[] = INPUTS_OPENING
    "\"required\":[\"template\",\"moving\"],"
    "\"properties\":{\"template\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN
    "\",\"description\":\"The surface to register to. A mesh is encoded with the "
    "default options.\"},\"moving\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN
    "\",\"description\":\"The surface that is moved. A mesh is encoded with the "
    "default options.\"},\"rotation\":{\"type\":\"boolean\",\"default\":true,"
    "\"description\":\"Rotate the moving surface.\"},"
    "\"reparameterization\":{\"type\":\"boolean\",\"default\":true,"
    "\"description\":\"Warp the sphere under it.\"},\"degree\":{\"type\":\"integer\","
    "\"minimum\":1,\"maximum\":" WARP_DEGREE_MAX_TEXT ",\"default\":" WARP_DEGREE_DEFAULT_TEXT
    ",\"description\":\"Of the fields that generate the warp.\"},"
    "\"penalty\":{\"oneOf\":[{\"enum\":[\"default\",\"none\"]},{\"type\":\"object\","
    "\"additionalProperties\":false,\"properties\":{\"jacobian\":{\"type\":\"number\","
    "\"minimum\":0,\"maximum\":" PENALTY_MAX_TEXT
    ",\"default\":0.003},\"displacement\":{\"type\":\"number\",\"minimum\":0,"
    "\"maximum\":" PENALTY_MAX_TEXT
    ",\"default\":0.01}}}],\"default\":\"default\",\"description\":\"Weights of the "
    "integrals of (1 + J) (log J)^4 and of the squared displacement, against the "
    "squared distance relative to the area of the template.\"},"
    "\"start\":{\"enum\":[\"tournament\",\"rigid\",\"identity\"],"
    "\"default\":\"tournament\",\"description\":\"tournament: many rotations, narrowed "
    "down while the warps grow; rigid: the best rotation; identity: as the surfaces "
    "are.\"},\"commonPose\":{\"type\":\"boolean\",\"default\":false,"
    "\"description\":\"The surfaces share a pose: nothing is rotated, and the start is "
    "identity.\"},\"symmetric\":{\"type\":\"boolean\",\"default\":false,"
    "\"description\":\"Both ways, and the better one counts: the same distance from "
    "either side, that of distances and geodesic, at twice the time. false searches one way "
    "(of ten pairs of real surfaces the distance was up to 11 % "
    "larger).\"},\"exact\":{\"type\":\"boolean\",\"default\":false,"
    "\"description\":\"For surfaces that differ by a warp alone: no penalty, up to "
    "degree 32.\"},"
    "\"handedness\":{\"enum\":[\"check\",\"ignore\"],\"default\":\"check\",\"description\":\""
    "Whether to try the mirror image of the moving surface as well, registered "
    "where names or a quick rigid match suggest two sides, and to warn where it "
    "matches clearly better (warning mirror-images); ignore saves that time.\"}}}";

const char register_outputs_schema[] = OUTPUTS_OPENING
    "\"surface\":{\"type\":\"object\",\"description\":\"Record of the moving surface, "
    "registered.\"},\"rotation\":{\"type\":\"array\",\"description\":\"3x3, row by row: of "
    "the moving surface in "
    "space.\"},\"distance\":{\"type\":[\"number\",\"null\"],\"description\":\"L2 distance "
    "of the template's SRNF from the registered SRNF of the moving surface, before its "
    "degree cuts anything off. 0 to 2 at unit area. It depends on degree and penalty "
    "(registration); with symmetric and the defaults it is that of distances and "
    "geodesic.\"},\"distanceBefore\":{\"type\":[\"number\",\"null\"],\"description\":\"The "
    "same for the surfaces as they were given, in their poses and parameterisations: no "
    "measure of shape, and none of what registration "
    "achieved.\"},\"objective\":{\"type\":[\"number\",\"null\"],\"description\":\"What was "
    "minimised: squared distance relative to the area of the template, and the "
    "penalties.\"},\"minJacobian\":{\"type\":[\"number\",\"null\"],\"description\":\"Least "
    "factor by which the warp scales areas of the sphere, on a grid finer by half; above "
    "0, nothing folds. Ten pairs of brain structures, ventricles and asteroids, at degrees "
    "8, 15 and 31, had 0.24 to 0.92. A tenth is doubtful: warning "
    "registration-distorted.\"},\"maxJacobian\":{\"type\":[\"number\",\"null\"],\"description\":"
    "\"The "
    "largest factor. The same pairs had 1.1 to 3.4. Ten is doubtful: warning "
    "registration-distorted.\"},\"inverseConsistency\":{\"type\":[\"number\",\"null\"],"
    "\"description\":\"Relative "
    "gap between the objectives of the two ways, before the better one was kept and "
    "improved: how much one search may miss. The same pairs had up to 0.07. null unless "
    "symmetric.\"},\"ambiguity\":{\"type\":\"object\",\"description\":\"objective: of the "
    "best start in another basin, relative to the best, and angle, between the two maps in "
    "radians; null where there was none. rotationalCurvature: smallest eigenvalue of the "
    "energy over rotations of the sphere; null where none were tried. Up to 1.05, or a "
    "curvature below 0.02 (real ventricles, nearly of revolution, 0.04 to 0.08; other "
    "shapes above 0.1), pose and correspondence are one choice among several: warning "
    "registration-ambiguous.\"},\"truncationError\":{\"type\":[\"number\",\"null\"],"
    "\"description\":\"Distance "
    "of the registered surface's own SRNF from the registered one, relative to the norm of "
    "that, 1 at unit area: what the degree of the surface cuts off. Read it against "
    "distance. Searched both ways, the same pairs had 0.24 to 2.4 of it at degree 8, 0.12 "
    "to 2.7 at 15 and 0.08 to 1.8 at 31, ventricles at most 0.33, 0.22 and 0.14. Above "
    "half of it the registered surface, and paths to it, say little (warning "
    "registration-truncated): encode with a higher lmax. The distance is measured before "
    "the cut.\"},\"iterations\":{\"type\":\"integer\",\"description\":\"Steps over all "
    "starts, degrees and "
    "ways.\"},\"converged\":{\"type\":\"boolean\",\"description\":\"False where stopped is "
    "maxIterations: the steps ran out (warning "
    "registration-not-converged).\"},\"stopped\":{\"enum\":[\"direct\",\"tolerance\","
    "\"stationary\",\"stepRefused\",\"maxIterations\"],\"description\":\"Why "
    "the search ended, at its highest degree; of both ways, where symmetric, the worse reason. "
    "direct: there was none, nothing was warped "
    "or rotated; tolerance: registered to rounding; stationary: the last steps gained too "
    "little; stepRefused: no step, however short, gains anything; maxIterations: the steps "
    "of that degree ran out.\"},\"symmetric\":{\"type\":\"boolean\",\"description\":\"Both "
    "ways were searched: the distance is the same from either "
    "side.\"},\"note\":{\"type\":\"string\",\"description\":\"How it was "
    "searched, in a sentence.\"}," BRIDGED
    "\"registration\":{\"type\":\"object\",\"description\":\"Degree, penalty "
    "and all other options.\"},\"warp\":{\"type\":\"object\",\"description\":\"links: maps "
    "of the sphere to be applied in order, each a rotation (matrix), or exp or exp-inverse "
    "(p to exp_p(w(p)), w = grad phi + p x grad psi, and its inverse; harmonic "
    "coefficients of phi and psi), or series (p to g(p)/|g(p)|; harmonic coefficients x, y and z "
    "of g); grid: where they take the nodes of the template's grid, "
    "and their Jacobian there.\"}," MADE_BY;

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
