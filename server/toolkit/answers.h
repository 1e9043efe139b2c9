/*
 * answers.h - doubts that the figures of a result tell of by themselves, whatever process it is of:
 * surfaces that are not what was asked for, paths that jump, and parameters that a metric leaves as
 * they are.
 */
#ifndef SRNFD_TOOLKIT_ANSWERS_H
#define SRNFD_TOOLKIT_ANSWERS_H

#include <jansson.h>

/* The relative energy beyond which not-reached is told. */
#define ANSWERS_REACHED 0.1

/* The warning not-reached, where one of these relative energies is large. energies: an array, or a
   number. */
void answers_warn_energies(const json_t *energies, json_t *document);
/* Adds not-reached, parameters-not-registered and path-jumps to the warnings of a result document,
   from its members and from the canonical inputs. */
void answers_warn(const json_t *inputs, json_t *document);

#endif
