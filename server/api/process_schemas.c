/*
 * process_schemas.c - the inputs and outputs of the processes as JSON Schema (2020-12), for the
 * self-description at /v1/processes.
 *
 * Limits and defaults are the macros of process.h and srnf.h that the validation uses;
 * tests/server/api/test_process_schemas.c tries every one of them.
 */
#include "api/process_schemas.h"

#define COLUMNS_MAX_TEXT PROCESS_TEXT(PROCESS_COLUMNS_MAX)
#define COORDINATE_MAX_TEXT PROCESS_TEXT(PROCESS_COORDINATE_MAX)
#define DEGREE_DEFAULT_TEXT PROCESS_TEXT(PROCESS_DEGREE_DEFAULT)
#define DEGREE_MAX_TEXT PROCESS_TEXT(SRNF_DEGREE_MAX)
#define DEGREE_MIN_TEXT PROCESS_TEXT(SRNF_DEGREE_MIN)
#define ITERATIONS_MAX_TEXT PROCESS_TEXT(PROCESS_ITERATIONS_MAX)
#define ROWS_MAX_TEXT PROCESS_TEXT(PROCESS_ROWS_MAX)
#define SMOOTHING_MAX_TEXT PROCESS_TEXT(PROCESS_SMOOTHING_MAX)
#define STEPS_DEFAULT_TEXT PROCESS_TEXT(PROCESS_STEPS_DEFAULT)
#define STEPS_MAX_TEXT PROCESS_TEXT(PROCESS_STEPS_MAX)
#define STEPS_MIN_TEXT PROCESS_TEXT(PROCESS_STEPS_MIN)
#define TOLERANCE_DEFAULT_TEXT PROCESS_TEXT(PROCESS_TOLERANCE_DEFAULT)
#define TOLERANCE_MAX_TEXT PROCESS_TEXT(PROCESS_TOLERANCE_MAX)
#define TOLERANCE_MIN_TEXT PROCESS_TEXT(PROCESS_TOLERANCE_MIN)

const char encode_inputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"mesh\"],"
    "\"properties\":{"
    "\"mesh\":{\"type\":\"string\",\"pattern\":\"" PROCESS_MESH_PATTERN "\","
    "\"description\":\"The mesh to encode; its report must have no problems.\"},"
    "\"lmax\":{\"type\":\"integer\",\"minimum\":" DEGREE_MIN_TEXT ","
    "\"maximum\":" DEGREE_MAX_TEXT ",\"default\":" DEGREE_DEFAULT_TEXT ","
    "\"description\":\"Degree of the harmonic series; (lmax + 1)^2 coefficients a "
    "coordinate.\"},"
    "\"parameterization\":{\"enum\":[\"auto\",\"star\",\"area\",\"given\"],"
    "\"default\":\"auto\",\"description\":\"How the sphere is laid on the surface. "
    "star: radially from a centre that sees the whole surface; area: by a bijection of "
    "low distortion, for any surface; given: by a sphere that comes with the mesh. auto "
    "takes star where the ball of such centres has a radius of 2 % of the bounding-box "
    "diagonal or a center is given, and area otherwise.\"},"
    "\"sphere\":{\"type\":[\"string\",\"null\"],\"pattern\":\"" PROCESS_MESH_PATTERN "\","
    "\"default\":null,\"description\":\"For the parameterization given: a mesh of the same "
    "faces in the same order, whose vertices lie on a sphere.\"},"
    "\"center\":{\"oneOf\":[{\"const\":\"auto\"},{\"type\":\"array\","
    "\"items\":{\"type\":\"number\",\"minimum\":-" COORDINATE_MAX_TEXT ","
    "\"maximum\":" COORDINATE_MAX_TEXT "},\"minItems\":3,\"maxItems\":3}],"
    "\"default\":\"auto\",\"description\":\"Centre of the rays of star in the units of the "
    "mesh; auto: the centre of the largest ball of points that see the whole "
    "surface.\"},"
    "\"scale\":{\"enum\":[\"unit-area\",\"none\"],\"default\":\"unit-area\","
    "\"description\":\"unit-area divides by the square root of the area, kept as scale "
    "in the record.\"},"
    "\"smoothing\":{\"type\":\"number\",\"minimum\":0,\"maximum\":" SMOOTHING_MAX_TEXT ","
    "\"default\":0,\"description\":\"Sigma of the heat kernel exp(-sigma l (l + 1)) on "
    "the coefficients (of the radius for star), on the unit sphere.\"}}}";

const char encode_outputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"properties\":{"
    "\"surface\":{\"type\":\"object\",\"description\":\"Record of the surface.\"},"
    "\"fit\":{\"type\":\"object\",\"description\":\"Distances between mesh and surface "
    "from both sides, area-weighted: rms, p95, max in the units of the mesh, and "
    "relativeToDiagonal.\"},"
    "\"route\":{\"enum\":[\"star\",\"area\",\"given\"]},"
    "\"reason\":{\"type\":\"string\",\"description\":\"Why this route, in a "
    "sentence.\"},"
    "\"starShaped\":{\"type\":\"object\",\"description\":\"value, center, margin "
    "(units of the mesh), violatingAreaFraction (of the faces that the centre sees "
    "from behind).\"},"
    "\"distortion\":{\"type\":\"object\",\"description\":\"Of the map to the sphere: "
    "symmetricDirichlet (energy / 4 pi, 4 for an isometry), logAreaDeviation (standard "
    "deviation of the log of the area ratio), flipped (faces turned over: 0).\"},"
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after "
    "defaulting.\"}," LAST_OUTPUTS;

const char invert_inputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"srnf\"],"
    "\"properties\":{"
    "\"srnf\":{\"oneOf\":[{\"type\":\"object\",\"required\":[\"surface\"],"
    "\"additionalProperties\":false,"
    "\"properties\":{"
    "\"surface\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}}},{"
    "\"type\":\"object\",\"required\":[\"lmax\",\"nTheta\",\"nPhi\",\"q\"],"
    "\"additionalProperties\":false,"
    "\"properties\":{"
    "\"lmax\":{\"type\":\"integer\",\"minimum\":" DEGREE_MIN_TEXT ","
    "\"maximum\":" DEGREE_MAX_TEXT "},"
    "\"nTheta\":{\"type\":\"integer\",\"minimum\":5,\"maximum\":" ROWS_MAX_TEXT "},"
    "\"nPhi\":{\"type\":\"integer\",\"minimum\":9,\"maximum\":" COLUMNS_MAX_TEXT "},"
    "\"q\":{\"type\":\"array\"}}}],\"description\":\"The SRNF: of a surface (or of a "
    "mesh, encoded with the default options), or its values q [nTheta][nPhi][3], "
    "nested or flat, on the Gauss-Legendre grid with nTheta at least lmax + 1 and nPhi "
    "at least 2 lmax + 1.\"},"
    "\"initial\":{\"oneOf\":[{\"enum\":[\"auto\",\"sphere\",\"star\"]},{"
    "\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}],"
    "\"default\":\"auto\",\"description\":\"Where the search starts: the unit sphere, "
    "turned to fit; the closed form; a surface. auto takes the closed form where it is "
    "good and the sphere otherwise. Of the methods that search only: with closed-form "
    "and spectral it is left out or auto.\"},"
    "\"method\":{\"enum\":[\"auto\",\"gauss-newton\",\"spectral\",\"gradient\","
    "\"closed-form\"],\"default\":\"auto\",\"description\":\"gauss-newton: "
    "Levenberg-Marquardt with conjugate gradients; spectral: the linear eigenproblem, "
    "for exact SRNFs; gradient: descent as in the paper; closed-form: for star-shaped "
    "surfaces in their radial parameterisation.\"},"
    "\"lmax\":{\"type\":\"integer\",\"minimum\":" DEGREE_MIN_TEXT ","
    "\"maximum\":" DEGREE_MAX_TEXT ",\"description\":\"Degree of the result. Default: "
    "that of the surface, or of srnf.\"},"
    "\"tolerance\":{\"type\":\"number\",\"minimum\":" TOLERANCE_MIN_TEXT ","
    "\"maximum\":" TOLERANCE_MAX_TEXT ",\"default\":" TOLERANCE_DEFAULT_TEXT ","
    "\"description\":\"On the energy relative to the squared norm of q.\"},"
    "\"maxIterations\":{\"type\":[\"integer\",\"null\"],\"minimum\":1,"
    "\"maximum\":" ITERATIONS_MAX_TEXT ",\"default\":null,\"description\":\"null: the "
    "method's own limit, which is a failure when it is reached. A number given here "
    "makes the surface reached by then a result, with converged false.\"}}}";

const char invert_outputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"properties\":{"
    "\"surface\":{\"type\":\"object\",\"description\":\"Record of the surface: "
    "positive volume, centred at its area centroid.\"},"
    "\"energy\":{\"type\":\"number\",\"description\":\"||Q(f) - q||^2.\"},"
    "\"relativeEnergy\":{\"type\":\"number\",\"description\":\"The same divided by "
    "||q||^2.\"},"
    "\"gradientNorm\":{\"type\":[\"number\",\"null\"]},"
    "\"iterations\":{\"type\":\"integer\"},"
    "\"transforms\":{\"type\":\"number\",\"description\":\"Cost in gradient transforms "
    "of three coordinates.\"},"
    "\"converged\":{\"type\":\"boolean\"},"
    "\"stopped\":{\"type\":\"string\",\"description\":\"tolerance, stationary (a "
    "minimum of positive energy) or maxIterations.\"},"
    "\"method\":{\"type\":\"string\",\"description\":\"The method that produced the "
    "result.\"},"
    "\"history\":{\"type\":\"array\",\"description\":\"[{iteration, energy, seconds, "
    "transforms}].\"},"
    "\"certificate\":{\"type\":[\"object\",\"null\"],\"description\":\"residual, "
    "secondEigenvalue, threshold, unique; null where it was not computed.\"},"
    "\"smallestSingularValue\":{\"type\":[\"number\",\"null\"]},"
    "\"surfaceErrorBound\":{\"type\":[\"number\",\"null\"],\"description\":\"L2 "
    "distance to the true surface, in the units of q.\"},"
    "\"surfaceError\":{\"type\":[\"number\",\"null\"],\"description\":\"L2 distance to "
    "the surface given, translations left out, at unit area; null where there is none "
    "of this degree.\"},"
    "\"flipped\":{\"type\":\"boolean\",\"description\":\"The mirror image was found "
    "first.\"},"
    "\"closedForm\":{\"type\":\"object\",\"description\":\"relativeEnergy of the "
    "closed form.\"},"
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after defaulting; "
    "q by its digest.\"}," LAST_OUTPUTS;

const char geodesic_inputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"from\",\"to\"],"
    "\"properties\":{"
    "\"from\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\","
    "\"description\":\"Surface at t = 0; a mesh is encoded with the default "
    "options.\"},"
    "\"to\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\","
    "\"description\":\"Surface at t = 1; a mesh is encoded with the default "
    "options.\"},"
    "\"steps\":{\"type\":\"integer\",\"minimum\":" STEPS_MIN_TEXT ","
    "\"maximum\":" STEPS_MAX_TEXT ",\"default\":" STEPS_DEFAULT_TEXT ","
    "\"description\":\"Surfaces, both ends included.\"},"
    "\"register\":{\"type\":\"boolean\",\"default\":true,"
    "\"description\":\"Register the second end to the first, with the default options "
    "of register; false: both as they are parameterised.\"},"
    "\"method\":{\"enum\":[\"srnf\",\"closed-form\",\"linear\",\"pullback\"],"
    "\"default\":\"srnf\",\"description\":\"srnf inverts the points of the straight "
    "line between the SRNFs numerically, closed-form by the formula for "
    "star-shaped surfaces, linear blends the surfaces. pullback is the geodesic "
    "within the space of surfaces, by straightening the path in the metric that "
    "the SRNF pulls back to it; it takes 3 surfaces or more.\"}}}";

const char geodesic_outputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"properties\":{"
    "\"surfaces\":{\"type\":\"array\","
    "\"items\":{\"type\":\"object\"},\"description\":\"Records of the surfaces from t "
    "= 0 to t = 1.\"},"
    "\"times\":{\"type\":\"array\","
    "\"items\":{\"type\":\"number\"}},"
    "\"distance\":{\"type\":\"number\",\"description\":\"Length of the straight line "
    "in the space of SRNFs.\"},"
    "\"length\":{\"type\":\"number\",\"description\":\"Sum of the distances between "
    "neighbouring surfaces.\"},"
    "\"energies\":{\"type\":\"object\",\"description\":\"geodesic, closedForm, linear: "
    "squared distance of each surface's SRNF from the straight line, for the surfaces "
    "returned, the closed form and the linear blend.\"},"
    "\"relativeEnergies\":{\"type\":\"object\",\"description\":\"The same divided by "
    "the squared norm of the point on the line.\"},"
    "\"transforms\":{\"type\":\"number\",\"description\":\"Cost in gradient "
    "transforms.\"},"
    "\"pullback\":{\"type\":[\"object\",\"null\"],\"description\":\"Of method "
    "pullback, null otherwise: energy, length and speedVariation (standard "
    "deviation over mean) of the path in the pulled-back metric, speeds of its "
    "segments; the same three of the straight line between the surfaces (linear) "
    "and of the inverted straight line between the SRNFs (inverted); iterations, "
    "converged, gradient (relative).\"},"
    "\"registration\":{\"type\":[\"object\",\"null\"],\"description\":\"distance, "
    "distanceBefore, objective, minJacobian, maxJacobian, truncationError, iterations, "
    "converged, and its options; null where nothing was registered.\"},"
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after "
    "defaulting.\"}," LAST_OUTPUTS;
