/*
 * schemas_transport.c - the inputs and outputs of shoot, transport and transfer as JSON
 * Schema (2020-12). As schemas.c, which has the others.
 */
#include "toolkit/schemas.h"

#define TIMES_MAX_TEXT PROCESS_TEXT(PROCESS_TIMES_MAX)
#define TIME_MAX_TEXT PROCESS_TEXT(PROCESS_TIME_MAX)

#define METHOD                                                                                    \
    "\"method\":{\"enum\":[\"srnf\",\"pullback\"],\"default\":\"srnf\",\"description\":\"srnf: "  \
    "straight "                                                                                   \
    "lines in the space of SRNFs, inverted numerically. pullback: geodesics within the space of " \
    "surfaces, in the metric that the SRNF pulls back to it, at many times the cost.\"}"

/* A path in the pulled-back metric. */
#define LEG                                                                                        \
    "segments, energy, length, speedVariation, iterations, residual (relative: the gradient of a " \
    "geodesic, "                                                                                   \
    "what the equations of an exponential were left with), converged"

const char shoot_inputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"surface\",\"velocity\"],"
    "\"properties\":{\"surface\":{\"type\":\"string\","
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\",\"description\":\"Surface at t = 0; a mesh "
    "is encoded with the default options.\"},\"velocity\":{\"oneOf\":[{\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"toward\"],"
    "\"properties\":{\"toward\":{\"type\":\"string\","
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}}},{\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"coefficients\"],"
    "\"properties\":{\"coefficients\":{\"type\":\"object\",\"required\":[\"lmax\",\"x\","
    "\"y\",\"z\"]}}},{\"type\":\"object\",\"additionalProperties\":false,"
    "\"required\":[\"srnf\"],\"properties\":{\"srnf\":{\"type\":\"object\","
    "\"required\":[\"lmax\",\"nTheta\",\"nPhi\",\"q\"]}}}],\"description\":\"What it moves "
    "by in one unit of time. toward: the difference of the SRNFs to that surface; "
    "coefficients: the motion of the points, harmonic, of at most the degree of the "
    "surface; srnf: a field in the space of SRNFs on the working grid of its degree "
    "(nTheta = ceil(3 (lmax + 1) / 2), nPhi = 2 nTheta; with register false), as transport "
    "gives it. In the units of the stored coefficients.\"},\"times\":{\"type\":\"array\","
    "\"items\":{\"type\":\"number\",\"minimum\":-" TIME_MAX_TEXT ",\"maximum\":" TIME_MAX_TEXT
    "},\"minItems\":1,"
    "\"maxItems\":" TIMES_MAX_TEXT
    ",\"default\":[0.0,0.25,0.5,0.75,1.0],\"description\":\"Times of the "
    "surfaces, in any order, negative ones too.\"},\"register\":{\"type\":\"boolean\","
    "\"default\":true,\"description\":\"Register the surface that the velocity is toward, "
    "with the default options of register but both ways; false: as it is parameterised.\"},"
    "\"commonPose\":{\"type\":\"boolean\",\"default\":false,\"description\":\"Where "
    "surfaces are registered: they share a pose, and nothing is rotated.\"}," METHOD "}}";

const char shoot_outputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"properties\":{\"surfaces\":{\"type\":\"array\",\"items\":{\"type\":\"object\"},"
    "\"description\":\"Records of the surfaces at the times.\"},"
    "\"times\":{\"type\":\"array\",\"items\":{\"type\":\"number\"}},"
    "\"energies\":{\"type\":\"array\",\"description\":\"Squared distance of each surface's "
    "SRNF from the line.\"},\"relativeEnergies\":{\"type\":\"array\",\"description\":\"The "
    "same divided by the squared norm of the point on the line.\"},"
    "\"transforms\":{\"type\":\"number\",\"description\":\"Cost in gradient transforms.\"},"
    "\"registration\":{\"type\":[\"object\",\"null\"],\"description\":\"As register tells "
    "of it: distance, distanceBefore, objective, minJacobian, maxJacobian, "
    "truncationError, ambiguity, inverseConsistency, iterations, converged, stopped, "
    "symmetric (true), note, and its options; null where nothing was registered.\"},"
    "\"pullback\":{\"type\":[\"object\",\"null\"],\"description\":\"Of method pullback, null "
    "otherwise: toward, the geodesic that the velocity was taken from, or null; shots, the path to "
    "each surface, null at time 0. Each " LEG ". converged: all of them.\"},"
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after defaulting; q by "
    "its digest.\"}," LAST_OUTPUTS;

const char transport_inputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"from\",\"to\",\"vector\"],"
    "\"properties\":{\"from\":{\"type\":\"string\","
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\",\"description\":\"Surface that the vector "
    "is at; a mesh is encoded with the default options.\"},\"to\":{\"type\":\"string\","
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\",\"description\":\"Surface that it is "
    "carried to; a mesh is encoded with the default options.\"},"
    "\"vector\":{\"oneOf\":[{\"type\":\"object\",\"additionalProperties\":false,"
    "\"required\":[\"toward\"],\"properties\":{\"toward\":{\"type\":\"string\","
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}}},{\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"coefficients\"],"
    "\"properties\":{\"coefficients\":{\"type\":\"object\",\"required\":[\"lmax\",\"x\","
    "\"y\",\"z\"]}}},{\"type\":\"object\",\"additionalProperties\":false,"
    "\"required\":[\"srnf\"],\"properties\":{\"srnf\":{\"type\":\"object\","
    "\"required\":[\"lmax\",\"nTheta\",\"nPhi\",\"q\"]}}}],\"description\":\"A vector at "
    "from. toward: the difference of the SRNFs to that surface; coefficients: the motion "
    "of the points, harmonic, of at most the degree of the surface; srnf: a field in the "
    "space of SRNFs on the working grid of its degree (nTheta = ceil(3 (lmax + 1) / 2), "
    "nPhi = 2 nTheta; with register false), as transport gives it. In the units of the "
    "stored coefficients.\"},\"register\":{\"type\":\"boolean\",\"default\":true,"
    "\"description\":\"Register the surface that the vector is toward to from, and from "
    "with the vector to to, with the default options of register but both ways; false: as they are "
    "parameterised.\"},\"commonPose\":{\"type\":\"boolean\",\"default\":false,"
    "\"description\":\"Where surfaces are registered: they share a pose, and nothing is "
    "rotated.\"}," METHOD "}}";

const char transport_outputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"properties\":{\"vector\":{\"type\":\"object\",\"description\":\"The vector at to: "
    "coefficients {lmax, x, y, z}, the motion of its points that comes nearest, and srnf "
    "{lmax, nTheta, nPhi, q}, the field itself, which parallel transport leaves unchanged "
    "(pullback: that of the motion). "
    "Either may be sent as an input.\"},\"surface\":{\"type\":\"object\","
    "\"description\":\"Record of the surface that the vector leads to from to in one unit "
    "of time.\"},\"norm\":{\"type\":\"number\",\"description\":\"Of the vector in the "
    "space of SRNFs.\"},\"residual\":{\"type\":\"number\",\"description\":\"Norm of the "
    "part that no motion of to gives; of pullback, of a field that no motion of from gives, which "
    "stays behind.\"},\"iterations\":{\"type\":\"integer\","
    "\"description\":\"Of conjugate gradients.\"},\"energy\":{\"type\":\"number\","
    "\"description\":\"Squared distance of the SRNF of the surface from the end of the "
    "line.\"},\"relativeEnergy\":{\"type\":\"number\",\"description\":\"The same divided "
    "by the squared norm of that end.\"},\"transforms\":{\"type\":\"number\","
    "\"description\":\"Cost in gradient transforms.\"},"
    "\"pullback\":{\"type\":[\"object\",\"null\"],\"description\":\"Of method pullback, null "
    "otherwise: toward, the geodesic that the vector was taken from, or null; path, that from from "
    "to to; shot, the path to the surface. Each " LEG
    ". normFrom, norm: of the vector before and after. converged: all of them.\"},"
    "\"registration\":{\"type\":\"object\",\"description\":\"toward and from. Each as "
    "register tells of it: distance, distanceBefore, objective, minJacobian, maxJacobian, "
    "truncationError, ambiguity, inverseConsistency, iterations, converged, stopped, "
    "symmetric (true), note, and its options; null where nothing was registered.\"},"
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after defaulting; q by "
    "its digest.\"}," LAST_OUTPUTS;

const char transfer_inputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"additionalProperties\":false,\"required\":[\"source\",\"deformed\",\"target\"],"
    "\"properties\":{\"source\":{\"type\":\"string\","
    "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\",\"description\":\"Surface before its "
    "deformation; a mesh is encoded with the default options.\"},"
    "\"deformed\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\","
    "\"description\":\"The same after it; a mesh is encoded with the default options.\"},"
    "\"target\":{\"type\":\"string\",\"pattern\":\"" PROCESS_SURFACE_PATTERN "\","
    "\"description\":\"Surface to deform in the same way; a mesh is encoded with the "
    "default options.\"},\"size\":{\"enum\":[\"ratio\",\"absolute\"],\"default\":\"ratio\","
    "\"description\":\"ratio: shapes are compared at unit area, and the size of the target "
    "changes in the ratio of deformed to source; absolute: all three in the units that "
    "their scales lead back to, which must be the same.\"},"
    "\"register\":{\"type\":\"boolean\",\"default\":true,\"description\":\"Register the "
    "deformed surface to its source, and both to the target, with the default options of "
    "register but both ways; false: as they are "
    "parameterised.\"},\"commonPose\":{\"type\":\"boolean\","
    "\"default\":false,\"description\":\"Where surfaces are registered: they share a pose, "
    "and nothing is rotated.\"}," METHOD "}}";

const char transfer_outputs_schema[] =
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\","
    "\"properties\":{\"surface\":{\"type\":\"object\",\"description\":\"Record of the "
    "target deformed, in its own pose and parameterisation; with size ratio its scale is "
    "that of the target times sizeRatio.\"},\"sizeRatio\":{\"type\":\"number\","
    "\"description\":\"Square root of the area of deformed over that of source.\"},"
    "\"energy\":{\"type\":\"number\",\"description\":\"Squared distance of the surface's "
    "SRNF from Q(target) + Q(deformed) - Q(source).\"},"
    "\"relativeEnergy\":{\"type\":\"number\",\"description\":\"The same divided by the "
    "squared norm of that.\"},\"transforms\":{\"type\":\"number\",\"description\":\"Cost "
    "in gradient transforms.\"},\"pullback\":{\"type\":[\"object\",\"null\"],\"description\":\"Of "
    "method pullback, null otherwise: segments of each path; deformation and distance, lengths of "
    "the geodesics from source to deformed and to target; normFrom, norm: of the velocity before "
    "and after transport; converged.\"},"
    "\"registration\":{\"type\":\"object\",\"description\":\"deformed and source. Each as "
    "register tells of it: distance, distanceBefore, objective, minJacobian, maxJacobian, "
    "truncationError, ambiguity, inverseConsistency, iterations, converged, stopped, "
    "symmetric (true), note, and its options; null where nothing was registered.\"},"
    "\"inputs\":{\"type\":\"object\","
    "\"description\":\"Every option after defaulting.\"}," LAST_OUTPUTS;
