/*
 * links.h - links and schemas as OGC API - Processes 1.0 writes them.
 */
#ifndef SRNFD_API_LINKS_H
#define SRNFD_API_LINKS_H

#include "api/handler.h"

#define LINK_OGC "http://www.opengis.net/def/rel/ogc/1.0/"
#define LINK_JSON "application/json"

/* Adds {href, rel, type, title} to an array of links; title may be NULL. */
void link_add(json_t *links, const char *href, const char *rel, const char *type,
              const char *title);

/* A JSON Schema (2020-12) of a process as a schema of OpenAPI 3.0, which descriptions of processes
   have: "nullable" for the type null, a flag for an exclusive limit, a list of one for a constant.
   Changes it in place. */
void schema_to_openapi30(json_t *schema);

/* "maxIterations" as "Max iterations". */
void title_of(const char *name, char *title, size_t size);

#endif
