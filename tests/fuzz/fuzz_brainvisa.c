/*
 * fuzz_brainvisa.c - any bytes at all to the reader of SRNF_MESH_BRAINVISA.
 */
#include "fuzz/fuzz_mesh.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_mesh(data, size, SRNF_MESH_BRAINVISA);
}
