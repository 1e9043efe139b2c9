/*
 * fuzz_nrrd.c - any bytes at all to the reader of SRNF_VOLUME_NRRD.
 */
#include "fuzz/fuzz_volume.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_volume(data, size, SRNF_VOLUME_NRRD);
}
