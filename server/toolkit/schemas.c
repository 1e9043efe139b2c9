/*
 * schemas.c - the inputs and outputs of the processes as JSON Schema (2020-12), for the
 * self-description at /v1/processes.
 *
 * Limits and defaults are the macros of process.h and srnf.h that the validation uses;
 * tests/server/toolkit/test_process_schemas.c tries every one of them.
 */
#include "toolkit/schemas.h"

#define COLUMNS_MAX_TEXT PROCESS_TEXT(PROCESS_COLUMNS_MAX)
#define DEGREE_MAX_TEXT PROCESS_TEXT(SRNF_DEGREE_MAX)
#define DEGREE_MIN_TEXT PROCESS_TEXT(SRNF_DEGREE_MIN)
#define ITERATIONS_MAX_TEXT PROCESS_TEXT(PROCESS_ITERATIONS_MAX)
#define ROWS_MAX_TEXT PROCESS_TEXT(PROCESS_ROWS_MAX)
#define TOLERANCE_DEFAULT_TEXT PROCESS_TEXT(PROCESS_TOLERANCE_DEFAULT)
#define TOLERANCE_MAX_TEXT PROCESS_TEXT(PROCESS_TOLERANCE_MAX)
#define TOLERANCE_MIN_TEXT PROCESS_TEXT(PROCESS_TOLERANCE_MIN)

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
    "mesh, encoded with the default options, for the method closed-form by star), or its values q "
    "[nTheta][nPhi][3], "
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
    "\"gradientNorm\":{\"type\":[\"number\",\"null\"],\"description\":\"Of the energy in "
    "the coefficients: 0 at a minimum.\"},"
    "\"iterations\":{\"type\":\"integer\"},"
    "\"transforms\":{\"type\":\"number\",\"description\":\"Cost in gradient transforms "
    "of three coordinates.\"},"
    "\"converged\":{\"type\":\"boolean\",\"description\":\"Whether relativeEnergy reached "
    "the tolerance (stopped is then "
    "tolerance).\"},\"stopped\":{\"enum\":[\"tolerance\",\"stationary\",\"maxIterations\","
    "\"closedForm\"],\"description\":\"tolerance: "
    "solved; stationary: a minimum of positive energy; maxIterations: it was still "
    "falling; closedForm: what the method closed-form gives, above the tolerance.\"},"
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
    "\"closedForm\":{\"type\":\"object\",\"description\":\"relativeEnergy of the closed "
    "form; null above 1e-4, where it does not apply: q is not the SRNF of a star-shaped "
    "surface in its radial parameterisation.\"},"
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after defaulting; "
    "q by its digest.\"}," LAST_OUTPUTS;
