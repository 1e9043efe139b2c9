/*
 * scales.h - in what units surfaces are, by what degrees they were made and what they enclose:
 * doubts that the records of what is compared tell of by themselves. sizes.h has those of sizes.
 *
 * SRNF distances of surfaces are those of shapes only where the surfaces have one scale. encode
 * brings them to unit area, or with scale none leaves them in the units of their files, and the
 * two may not meet: 422 mixed-scales. All of one kind are fine.
 *
 * Of a surface that encode made the area is 1, or it is not. What a process made of others, as a
 * mean, has nearly their area and not quite, and coefficients that were sent in may have any: these
 * count as of unit area within a factor of 2, as of a size of their own beyond a factor of 10, and
 * in between go with all. A surface of its own size whose area happens to be within a factor of 2
 * of 1 goes with the made ones too: it may be what they were made of.
 *
 * transfer is not among the processes that refuse: it brings its three surfaces to one scale.
 */
#ifndef SRNFD_TOOLKIT_SCALES_H
#define SRNFD_TOOLKIT_SCALES_H

#include "toolkit/process.h"

/* Calls visit for each surface, mesh or model that canonical inputs compare with others, with the
   label that it has in the cohort or NULL. with_transfer: source, deformed and target too, and the
   parts of a subject. */
void inputs_each(const json_t *inputs, bool with_transfer,
                 void (*visit)(void *user, const char *id, const char *label), void *user);

/* Answers 422 mixed-scales where canonical inputs name surfaces of both kinds. False when answered.
 */
bool inputs_scales(struct process_inputs *inputs);

/* Adds the warning mixed-degrees where what the inputs name was made at several degrees, and what
   goes beyond the lowest is not cut off by the input lmax; labels of the cohort that the degrees
   go with are named. */
void degrees_warn(struct jobs_run *run, const json_t *inputs, json_t *document);

/* Adds surface-flat and surface-inside-out (api/warnings.h) where the records of what the inputs
   name tell of such volumes. */
void shapes_warn(struct jobs_run *run, const json_t *inputs, json_t *document);

#endif
