/*
 * framing.h - how the results of a job are framed, kept beside it as a short text that means
 * nothing here.
 */
#ifndef SRNFD_STORE_FRAMING_H
#define SRNFD_STORE_FRAMING_H

#include "ids.h"
#include "store_status.h"

#define STORE_FRAMING_MAX 1024 /* bytes, with the zero */

struct store;

/* Keeps the text for a job that exists; "" removes it. STORE_QUOTA: the owner may not hold it. */
int store_framing_set(struct store *store, const char *owner, const char *job, const char *text);
/* The text, or "". */
int store_framing_get(struct store *store, const char *job, char text[STORE_FRAMING_MAX]);

#endif
