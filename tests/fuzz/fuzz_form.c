/*
 * fuzz_form.c - any bytes as a form: its parts lie within it, one after another.
 */
#include "api/multipart.h"
#include "fuzz/fuzz_require.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const unsigned char *behind = data;
    struct multipart form;
    struct multipart_part part;
    char problem[160] = "";
    enum multipart_status status;

    fuzz_require(multipart_open(&form, "multipart/form-data; boundary=x", data, size));
    while ((status = multipart_next(&form, &part, problem)) == MULTIPART_PART) {
        fuzz_require(part.bytes > behind && part.bytes + part.size <= data + size);
        fuzz_require(part.name[0] && strlen(part.file) < sizeof part.file);
        behind = part.bytes + part.size;
    }
    fuzz_require(status == MULTIPART_END || problem[0]);
    return 0;
}
