/*
 * schemas.h - parts that schemas of several processes have in common, as macros of text.
 * An opening starts what MADE_BY closes in outputs and "}}" in inputs; the others are members.
 */
#ifndef SRNFD_TOOLKIT_SCHEMAS_H
#define SRNFD_TOOLKIT_SCHEMAS_H

#include "toolkit/process.h"

#define DEGREE_MAX_TEXT PROCESS_TEXT(SRNF_DEGREE_MAX)
#define DEGREE_MIN_TEXT PROCESS_TEXT(SRNF_DEGREE_MIN)
#define PERMUTATIONS_MAX_TEXT PROCESS_TEXT(PROCESS_PERMUTATIONS_MAX)
#define SEED_MAX_TEXT PROCESS_TEXT(PROCESS_SEED_MAX)

#define OUTPUTS_OPENING                                                                  \
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\"," \
    "\"properties\":{"

#define INPUTS_OPENING                                                                   \
    "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\"type\":\"object\"," \
    "\"additionalProperties\":false,"

/* Of the processes on a group. */
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

/* Of every process on a group. */
#define MIXED_ROUTES_INPUT                                                                        \
    "\"mixedRoutes\":{\"type\":\"boolean\",\"default\":false,\"description\":\"Compare surfaces " \
    "that came to their sphere by different routes (star, area, given); otherwise they are "      \
    "refused with mixed-routes. Registered, those that encode made by star beside others by "     \
    "area are encoded again by area (bridgedSurfaces); of what differs all the same the result "  \
    "has the warning mixed-routes.\"}"

#endif
