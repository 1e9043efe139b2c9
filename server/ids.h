/*
 * ids.h - how long ids and names are, for every layer: bytes with the zero.
 */
#ifndef SRNFD_IDS_H
#define SRNFD_IDS_H

#define STORE_ID_MAX 64           /* the longest id of a mesh, surface, model or job */
#define STORE_OWNER_MAX 65        /* the longest name of an owner (owner.h) */
#define STORE_COHORT_NAME_MAX 101 /* the longest name of a cohort */

#endif
