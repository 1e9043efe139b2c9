/*
 * references.h - inputs of an execution as OGC API - Processes 1.0 writes them.
 */
#ifndef SRNFD_API_REFERENCES_H
#define SRNFD_API_REFERENCES_H

#include "api/handler.h"

/* Puts what each input means in its place: X for {"value": X}, the id of a resource of this service
   for {"href": its address}; also of what stands in an array or object. What is wrong goes into the
   list. False when a problem was answered. Nothing is fetched from other servers while the list has
   something, or the process refuses the inputs by their form. */
bool references_resolve(struct api_call *call, const struct api_process *process, json_t *inputs,
                        struct problem_list *list);

#endif
