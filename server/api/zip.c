/*
 * zip.c - see zip.h. libarchive writes it, with ZIP64 where a file or the whole needs it.
 */
#include "api/zip.h"

#include <archive.h>
#include <archive_entry.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"

#define DAY 86400
#define TIME (10 * 365 * DAY + 2 * DAY) /* 1980-01-01, where the times of zip begin */

#define STEP ((size_t)64 << 10)

/* Whether there is room for so many bytes more. */
static bool has_room(struct zip_writer *zip, size_t size)
{
    size_t wanted = size > zip->room ? (size - zip->room + STEP - 1) / STEP * STEP : 0;

    if (zip->take && wanted > 0 && !zip->take(zip->user, wanted)) {
        return false;
    }
    zip->room += wanted;
    zip->room -= size;
    return true;
}

/* What cannot be written is passed over, and told by zip_close. libarchive is not told: with an
   entry that it could not finish it would look at bytes of the caller again when it is closed, and
   keep the memory of the compression. */
static la_ssize_t put(struct archive *archive, void *user, const void *bytes, size_t size)
{
    struct zip_writer *zip = user;

    (void)archive;
    zip->failed = zip->failed || !has_room(zip, size) || fwrite(bytes, 1, size, zip->out) != size;
    return (la_ssize_t)size;
}

bool zip_open(struct zip_writer *zip, FILE *out, bool deflate)
{
    *zip = (struct zip_writer){.out = out};
    zip->archive = archive_write_new();
    zip->failed =
        !zip->archive || archive_write_set_format_zip(zip->archive) != ARCHIVE_OK ||
        archive_write_set_options(zip->archive, deflate ? "zip:compression=deflate"
                                                        : "zip:compression=store") != ARCHIVE_OK ||
        archive_write_set_bytes_in_last_block(zip->archive, 1) != ARCHIVE_OK || /* no padding */
        archive_write_open(zip->archive, zip, NULL, put, NULL) != ARCHIVE_OK;
    return !zip->failed;
}

void zip_add(struct zip_writer *zip, const char *path, const void *bytes, size_t size)
{
    struct archive_entry *entry = zip->failed ? NULL : archive_entry_new();

    if (!entry) {
        zip->failed = true;
        return;
    }
    archive_entry_set_pathname(entry, path);
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_size(entry, (la_int64_t)size);
    archive_entry_set_mtime(entry, TIME, 0);
    if (archive_write_header(zip->archive, entry) != ARCHIVE_OK ||
        (size > 0 && archive_write_data(zip->archive, bytes, size) != (la_ssize_t)size)) {
        zip->failed = true;
    }
    archive_entry_free(entry);
}

char *zip_json(json_t *document)
{
    char *text =
        json_memory_dumps(document, JSON_INDENT(1) | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));

    json_decref(document);
    return text;
}

bool zip_close(struct zip_writer *zip)
{
    if (zip->archive) {
        zip->failed = archive_write_close(zip->archive) != ARCHIVE_OK || zip->failed;
        (void)archive_write_free(zip->archive);
        zip->archive = NULL;
    }
    return !zip->failed;
}
