/*
 * schemas.h - parts that schemas of several processes have in common, as macros of text.
 * An opening starts what MADE_BY closes in outputs and "}}" in inputs; the others are members.
 */
#ifndef SRNFD_TOOLKIT_SCHEMAS_H
#define SRNFD_TOOLKIT_SCHEMAS_H

#include "toolkit/process.h"

#define DEGREE_MAX_TEXT PROCESS_TEXT(SRNF_DEGREE_MAX)
#define DEGREE_MIN_TEXT PROCESS_TEXT(SRNF_DEGREE_MIN)
#define GROUP_MAX_TEXT PROCESS_TEXT(PROCESS_GROUP_MAX)
#define MEAN_ITERATIONS_DEFAULT_TEXT PROCESS_TEXT(PROCESS_MEAN_ITERATIONS_DEFAULT)
#define MEAN_ITERATIONS_MAX_TEXT PROCESS_TEXT(PROCESS_MEAN_ITERATIONS_MAX)
#define MEAN_TOLERANCE_DEFAULT_TEXT PROCESS_TEXT(PROCESS_MEAN_TOLERANCE_DEFAULT)
#define MEAN_TOLERANCE_MAX_TEXT PROCESS_TEXT(PROCESS_MEAN_TOLERANCE_MAX)
#define MEAN_TOLERANCE_MIN_TEXT PROCESS_TEXT(PROCESS_MEAN_TOLERANCE_MIN)
#define PERMUTATIONS_MAX_TEXT PROCESS_TEXT(PROCESS_PERMUTATIONS_MAX)
#define SEED_MAX_TEXT PROCESS_TEXT(PROCESS_SEED_MAX)

#define OUTPUTS_OPENING                                                                  \
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\"," \
    "\"properties\":{"

#define INPUTS_OPENING                                                                   \
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\"," \
    "\"additionalProperties\":false,"

#define BRIDGED                                                                                   \
    "\"bridged\":{\"type\":\"boolean\",\"description\":\"Whether the surfaces came by different " \
    "routes from meshes that are known and were registered through the encodings of those by "    \
    "area.\"},"

/* The same of a group. */
#define BRIDGED_GROUP                                                                             \
    "\"bridged\":{\"type\":\"boolean\",\"description\":\"Whether registered members by star, "    \
    "beside others by area, were compared by the encodings of their meshes by area.\"},"          \
    "\"bridgedSurfaces\":{\"type\":\"array\",\"items\":{\"type\":\"string\"},\"description\":"    \
    "\"Their ids: surfaces that encode made by star, of meshes that are known. Each was encoded " \
    "again by area, at its degree and with its other options, and the numbers are those of a "    \
    "group by area.\"},"

/* The last members of every result, after its inputs. */
#define LAST_OUTPUTS                                                                            \
    "\"warnings\":{\"type\":\"array\",\"items\":{\"type\":\"object\",\"required\":["            \
    "\"code\",\"detail\"],\"properties\":{\"code\":{\"type\":\"string\"},\"detail\":{\"type\":" \
    "\"string\"},\"figures\":{\"type\":\"object\"}}},\"description\":\"Reasons to doubt a "     \
    "number of this result: a stable code, a sentence, and the figures behind it. Empty: "      \
    "nothing was found.\"},\"numericBuild\":{\"type\":\"string\",\"description\":\"What made "  \
    "the numbers.\"}}}"
#define MADE_BY                                                             \
    "\"inputs\":{\"type\":\"object\",\"description\":\"Every option after " \
    "defaulting.\"}," LAST_OUTPUTS

#define REGISTRATION                                                                   \
    "\"registration\":{\"type\":[\"object\",\"null\"],\"description\":\"How surfaces " \
    "were registered: degree, penalty and all other options; null where they were "    \
    "not.\"},"

/* Of every process on a group. */
#define MIXED_ROUTES_INPUT                                                                        \
    "\"mixedRoutes\":{\"type\":\"boolean\",\"default\":false,\"description\":\"Compare surfaces " \
    "that came to their sphere by different routes (star, area, given); otherwise they are "      \
    "refused with mixed-routes. Registered, those that encode made by star beside others by "     \
    "area are encoded again by area (bridgedSurfaces); of what differs all the same the result "  \
    "has the warning mixed-routes.\"}"

/* How the mean of a group is computed, but for the method. */
#define MEAN_INPUTS                                                                               \
    "\"register\":{\"type\":\"boolean\",\"default\":true,\"description\":\"Register "             \
    "every surface to the mean, with the default options of register; false: as they "            \
    "are parameterised.\"},\"commonPose\":{\"type\":\"boolean\",\"default\":false,"               \
    "\"description\":\"The surfaces share a pose: nothing is rotated. Keeps "                     \
    "correspondence better in aligned data.\"},\"tolerance\":{\"type\":\"number\","               \
    "\"minimum\":" MEAN_TOLERANCE_MIN_TEXT ",\"maximum\":" MEAN_TOLERANCE_MAX_TEXT                \
    ",\"default\":" MEAN_TOLERANCE_DEFAULT_TEXT                                                   \
    ",\"description\":\"On the change of the mean SRNF in one iteration, relative to "            \
    "its norm. Where surfaces are registered, the mean is also found when its objective "         \
    "falls by less than this part of itself twice in a "                                          \
    "row.\"},"                                                                                    \
    "\"lmax\":{\"type\":\"integer\",\"minimum\":" DEGREE_MIN_TEXT ",\"maximum\":" DEGREE_MAX_TEXT \
    ",\"description\":\"Degree of the mean; the surfaces are cut or filled up to it. "            \
    "Default: the largest of theirs.\"},\"maxIterations\":{\"type\":\"integer\","                 \
    "\"minimum\":1,\"maximum\":" MEAN_ITERATIONS_MAX_TEXT                                         \
    ",\"default\":" MEAN_ITERATIONS_DEFAULT_TEXT                                                  \
    ",\"description\":\"Iterations after which the mean is a result as it is, with "              \
    "converged false.\"}"

#endif
