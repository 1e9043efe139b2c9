/*
 * scratch.h - files of running jobs, for what memory has no room for.
 */
#ifndef SRNFD_STORE_SCRATCH_H
#define SRNFD_STORE_SCRATCH_H

#include <stddef.h>
#include <stdint.h>

#include "store/store.h"

struct store_scratch;

/* The file of a job, which is made at the first write.
     keep  [in] what an earlier attempt has left stays; otherwise it is removed
     used  [out] its bytes
   STORE_NOMEM, STORE_IO. store_scratch_close. */
int store_scratch_open(struct store *store, const char *job, bool keep,
                       struct store_scratch **scratch, uint64_t *used);
/* The file stays until the job ends. */
void store_scratch_close(struct store_scratch *scratch);
/* From any thread. STORE_FULL: the disk is, or would be but for what others need. */
int store_scratch_write(struct store_scratch *scratch, uint64_t offset, const void *bytes,
                        size_t size);
/* STORE_CORRUPT: so many bytes are not there. */
int store_scratch_read(struct store_scratch *scratch, uint64_t offset, void *bytes, size_t size);

#endif
