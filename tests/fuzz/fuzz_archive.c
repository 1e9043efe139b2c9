/*
 * fuzz_archive.c - any bytes as an archive: what comes of it keeps its limits, and no path of it
 * leads out.
 */
#include "api/archive.h"
#include "fuzz/fuzz_require.h"

#include <string.h>

#include "srnf.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const size_t most = 1 << 18;
    size_t left = most;
    const struct archive_limits limits = {.file = 1 << 16, .left = &left};
    enum archive_status status;
    struct archive_file file;
    struct archive_reader *reader;
    size_t total = 0;

    if (!archive_is_one(data, size)) {
        (void)archive_other(data, size);
    }
    (void)archive_fits(data, size, &limits, &file);
    fuzz_require(left == most);
    reader = archive_open(data, size, &limits, &status, &file);
    while (reader &&
           ((status = archive_next(reader, &file)) == ARCHIVE_FILE || status == ARCHIVE_REFUSED)) {
        if (status == ARCHIVE_FILE) {
            fuzz_require(file.size <= limits.file && file.bytes);
            fuzz_require(!archive_path_problem(file.path) && strncmp(file.path, "../", 3) != 0 &&
                         !strstr(file.path, "/../"));
            total += file.size;
        } else {
            fuzz_require(file.code && file.problem[0] && !file.bytes);
        }
        srnf_free(file.bytes);
    }
    fuzz_require(total <= most);
    archive_close(reader);
    return 0;
}
