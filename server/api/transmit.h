/*
 * transmit.h - what becomes of an answer on its way: a part of it, or all of it in fewer bytes.
 */
#ifndef SRNFD_API_TRANSMIT_H
#define SRNFD_API_TRANSMIT_H

#include "api/handler.h"

/* Where the request asks for a range of the answer (RFC 9110, 14), makes it that range; otherwise,
   where the request takes gzip or zstd and the answer is of a type that it makes smaller, packs it.
   An answer for which memory is short stays as it is. */
void transmit(struct api_call *call);

#endif
