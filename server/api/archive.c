/*
 * archive.c - reading archives that a stranger made, with libarchive, and never a file written.
 *
 * Only zip and tar are enabled, plain or, for tar, within gzip; of zip's methods only stored and
 * deflated, since those of LZMA and PPMd take as much memory as the archive asks for. libarchive
 * reads the directory of a zip as a whole: its entries are counted by their signatures before, and
 * charged to the account of the upload. Every entry's bytes are read and counted, also of those
 * that are refused, so that nothing is unpacked past the limits unseen; and every block asks
 * whether the upload is to stop. A zip is judged by its directory before (archive_fits), and no
 * file in it is read beyond what that says: a small body that unpacks to much is refused at once.
 *
 * Names are UTF-8: the thread has a locale with that encoding while libarchive converts them.
 */
#include "api/archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/delimited.h"
#include "jobs/memory.h"
#include "srnf.h"
#include "text.h"

#define BLOCK ((size_t)64 << 10)
#define ZIP_END ((size_t)22)     /* bytes of the record at the end of a zip, without its comment */
#define ENTRY_COST ((size_t)400) /* bytes that libarchive keeps of an entry of a zip's directory */

struct archive_reader {
    struct archive *archive;
    struct archive_limits limits;
    size_t entries, charged;
    bool is_zip;
    locale_t locale;
};

/* ---- What it is ------------------------------------------------------------------------------ */

static bool begins(const unsigned char *bytes, size_t size, size_t at, const char *magic, size_t n)
{
    return size >= at + n && memcmp(bytes + at, magic, n) == 0;
}

static bool is_zip(const unsigned char *bytes, size_t size)
{
    return begins(bytes, size, 0, "PK\3\4", 4) || begins(bytes, size, 0, "PK\5\6", 4);
}

static bool is_gzip(const unsigned char *bytes, size_t size)
{
    return begins(bytes, size, 0, "\x1f\x8b\x08", 3);
}

bool archive_is_one(const void *bytes, size_t size)
{
    return is_zip(bytes, size) || is_gzip(bytes, size) || begins(bytes, size, 257, "ustar", 5);
}

const char *archive_other(const void *bytes, size_t size)
{
    static const struct {
        const char *magic, *name;
        size_t length;
    } others[] = {
        {"7z\xbc\xaf\x27\x1c", "a 7z archive", 6},
        {"Rar!\x1a\x07", "a rar archive", 6},
        {"\xfd"
         "7zXZ",
         "compressed by xz", 5},
        {"BZh", "compressed by bzip2", 3},
        {"\x28\xb5\x2f\xfd", "compressed by zstd", 4},
        {"\x04\x22\x4d\x18", "compressed by lz4", 4},
    };

    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        if (begins(bytes, size, 0, others[i].magic, others[i].length)) {
            return others[i].name;
        }
    }
    return NULL;
}

const char *archive_path_problem(const char *path)
{
    const char *at = path;

    if (!delimited_utf8(path, strlen(path))) {
        return "its name is not in UTF-8";
    }
    if (path[0] == '/' || strchr(path, '\\') ||
        (path[0] && path[1] == ':' && ((path[0] | 0x20) >= 'a' && (path[0] | 0x20) <= 'z'))) {
        return "its path is absolute, or has a backslash; paths must be relative, with slashes";
    }
    while (*at) {
        size_t length = strcspn(at, "/");

        if (length == 2 && at[0] == '.' && at[1] == '.') {
            return "its path has \"..\", which leads out of the archive";
        }
        at += length + (at[length] == '/');
    }
    for (at = path; *at; at++) {
        if ((unsigned char)*at < 0x20 || *at == 0x7f) {
            return "its name has a control character";
        }
    }
    return NULL;
}

/* ---- Opening --------------------------------------------------------------------------------- */

static enum archive_status fail(struct archive_file *file, enum archive_status status,
                                const char *problem)
{
    (void)snprintf(file->problem, sizeof file->problem, "%s", problem);
    return status;
}

/* Charges what the directory of a zip will take. */
static enum archive_status charge_directory(struct archive_reader *reader,
                                            const unsigned char *bytes, size_t size,
                                            struct archive_file *file)
{
    size_t count = 0;

    for (const unsigned char *at = bytes, *end = bytes + size;
         (at = memchr(at, 'P', (size_t)(end - at))) != NULL; at++) {
        if (begins(at, (size_t)(end - at), 0, "PK\1\2", 4) && ++count > ARCHIVE_ENTRIES_MAX) {
            (void)snprintf(file->problem, sizeof file->problem,
                           "the archive has more than %zu entries", ARCHIVE_ENTRIES_MAX);
            return ARCHIVE_TOO_MUCH;
        }
    }
    if (!jobs_memory_charge(jobs_memory_current(), count * ENTRY_COST)) {
        return fail(file, ARCHIVE_NO_MEMORY, "its directory does not fit into memory now");
    }
    reader->charged = count * ENTRY_COST;
    return ARCHIVE_FILE;
}

static bool enable(struct archive_reader *reader, const unsigned char *bytes, size_t size)
{
    struct archive *archive = reader->archive;
    int status;

    if (reader->is_zip) {
        status = archive_read_support_format_zip_seekable(archive);
    } else {
        status = archive_read_support_format_tar(archive);
        if (status == ARCHIVE_OK && is_gzip(bytes, size)) {
            status = archive_read_support_filter_gzip(archive);
        }
    }
    return status == ARCHIVE_OK;
}

/* Of a zip that libarchive does not open: its directory stands at its end, where a record of its
   own, with room for a comment, begins with PK 5 6 and says how many entries there are. */
static const char *zip_problem(const unsigned char *bytes, size_t size)
{
    size_t end = size > ZIP_END ? size - ZIP_END : 0, far = end > 0xffff ? end - 0xffff : 0;

    for (size_t at = end + 1; at > far && size >= ZIP_END; at--) {
        if (begins(bytes, size, at - 1, "PK\5\6", 4)) {
            return bytes[at + 9] == 0 && bytes[at + 10] == 0
                       ? "the zip is empty"
                       : "it is no zip, tar or tar.gz that can be read";
        }
    }
    return "the zip ends early: the directory at its end is not there, as of an upload or download "
           "that was cut off";
}

struct archive_reader *archive_open(const void *bytes, size_t size,
                                    const struct archive_limits *limits,
                                    enum archive_status *status, struct archive_file *file)
{
    struct archive_reader *reader = calloc(1, sizeof *reader);

    *status = ARCHIVE_NO_MEMORY;
    *file = (struct archive_file){.bytes = NULL};
    if (!reader) {
        return NULL;
    }
    reader->limits = *limits;
    reader->is_zip = is_zip(bytes, size);
    reader->locale = newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0);
    reader->archive = archive_read_new();
    if (!reader->archive || !enable(reader, bytes, size)) {
        goto failed;
    }
    if (reader->is_zip) {
        *status = charge_directory(reader, bytes, size, file);
        if (*status != ARCHIVE_FILE) {
            goto failed;
        }
    }
    if (archive_read_open_memory(reader->archive, bytes, size) != ARCHIVE_OK) {
        *status = fail(file, ARCHIVE_WRONG,
                       reader->is_zip ? zip_problem(bytes, size)
                                      : "it is no zip, tar or tar.gz that can be read");
        goto failed;
    }
    *status = ARCHIVE_FILE;
    return reader;
failed:
    archive_close(reader);
    return NULL;
}

void archive_close(struct archive_reader *reader)
{
    if (!reader) {
        return;
    }
    if (reader->archive) {
        (void)archive_read_free(reader->archive);
    }
    if (reader->locale) {
        freelocale(reader->locale);
    }
    jobs_memory_discharge(jobs_memory_current(), reader->charged);
    free(reader);
}

/* ---- Entries --------------------------------------------------------------------------------- */

/* The bytes that the head of an entry says it has, unpacked. */
static size_t declared(struct archive_entry *entry)
{
    la_int64_t size = archive_entry_size_is_set(entry) ? archive_entry_size(entry) : 0;

    return size < 0 ? SIZE_MAX : (size_t)size;
}

static enum archive_status too_large(const struct archive_reader *reader, struct archive_file *file)
{
    (void)snprintf(file->problem, sizeof file->problem, "%.80s has more than %zu bytes, unpacked",
                   file->path, reader->limits.file);
    return ARCHIVE_TOO_MUCH;
}

static enum archive_status grows(struct archive_reader *reader, struct archive_file *file)
{
    *reader->limits.left = 0;
    return fail(file, ARCHIVE_GROWS, "it unpacks to more bytes than are allowed");
}

/* Counts what was unpacked. */
static enum archive_status count(struct archive_reader *reader, size_t bytes,
                                 struct archive_file *file)
{
    if (bytes > *reader->limits.left) {
        return grows(reader, file);
    }
    *reader->limits.left -= bytes;
    return jobs_memory_told(jobs_memory_current()) ? ARCHIVE_STOPPED : ARCHIVE_FILE;
}

static bool grow(struct archive_file *file, size_t *capacity, size_t most)
{
    size_t more = *capacity > most / 2 ? most : 2 * *capacity;
    unsigned char *bytes = srnf_alloc(more, 1);

    if (!bytes) {
        return false;
    }
    memcpy(bytes, file->bytes, file->size);
    srnf_free(file->bytes);
    file->bytes = bytes;
    *capacity = more;
    return true;
}

/* What libarchive says of an entry or archive that it cannot read. */
static enum archive_status library_failed(const struct archive_reader *reader,
                                          struct archive_file *file)
{
    const char *text = archive_error_string(reader->archive);

    (void)snprintf(file->problem, sizeof file->problem, "it cannot be read to its end: %.120s",
                   text ? text : "no reason was given");
    return ARCHIVE_WRONG;
}

/* Reads the bytes of an entry; with keep they are file->bytes. */
static enum archive_status read_bytes(struct archive_reader *reader, bool keep, size_t expected,
                                      struct archive_file *file)
{
    size_t most = reader->limits.file + 1;
    size_t capacity = expected < BLOCK ? BLOCK : expected < most ? expected + 1 : most;
    enum archive_status status = ARCHIVE_FILE;

    file->bytes = srnf_alloc(keep ? capacity : BLOCK, 1);
    if (!file->bytes) {
        return ARCHIVE_NO_MEMORY;
    }
    while (status == ARCHIVE_FILE) {
        size_t room = keep ? capacity - file->size : BLOCK;
        la_ssize_t n = archive_read_data(reader->archive, file->bytes + (keep ? file->size : 0),
                                         room < BLOCK ? room : BLOCK);

        if (n == 0) {
            return ARCHIVE_FILE;
        }
        if (n < 0) {
            return library_failed(reader, file);
        }
        file->size += keep ? (size_t)n : 0;
        status = count(reader, (size_t)n, file);
        if (status == ARCHIVE_FILE && reader->is_zip && file->size > expected) {
            (void)snprintf(file->problem, sizeof file->problem,
                           "%.80s has more bytes than the %zu that the directory says", file->path,
                           expected);
            return ARCHIVE_WRONG;
        }
        if (status == ARCHIVE_FILE && keep && file->size > reader->limits.file) {
            return too_large(reader, file);
        }
        if (status == ARCHIVE_FILE && keep && file->size == capacity &&
            !grow(file, &capacity, most)) {
            return ARCHIVE_NO_MEMORY;
        }
    }
    return status;
}

static enum archive_status refuse(struct archive_file *file, const char *code, const char *problem)
{
    file->code = code;
    (void)snprintf(file->problem, sizeof file->problem, "%s", problem);
    return ARCHIVE_REFUSED;
}

/* Whether the entry is taken, by what its head says. */
static enum archive_status judge(struct archive_reader *reader, struct archive_entry *entry,
                                 const char *path, struct archive_file *file)
{
    const char *format = archive_format_name(reader->archive);
    const char *problem = path ? archive_path_problem(path) : "its name cannot be read";

    (void)snprintf(file->path, sizeof file->path, "%s", path ? path : "?");
    if (reader->limits.only && strcmp(text_base(file->path), reader->limits.only) != 0) {
        return ARCHIVE_PASSED;
    }
    if (problem || strlen(path) >= sizeof file->path) {
        return refuse(file, "unsafe-path", problem ? problem : "its path is too long");
    }
    if (archive_entry_hardlink(entry) || archive_entry_symlink(entry) ||
        archive_entry_filetype(entry) == AE_IFLNK) {
        return refuse(file, "link", "it is a link; put the file itself into the archive");
    }
    if (archive_entry_filetype(entry) != AE_IFREG) {
        return refuse(file, "not-a-file", "it is a device, a pipe or a socket");
    }
    if (archive_entry_is_encrypted(entry)) {
        return refuse(file, "encrypted", "it is encrypted; send it without a password");
    }
    if (reader->is_zip &&
        !(format && (strstr(format, "(uncompressed)") || strstr(format, "(deflation)")))) {
        return refuse(file, "unsupported-compression",
                      "its method of compression is not read here; use zip's usual one (deflate)");
    }
    return ARCHIVE_FILE;
}

/* Goes on to one entry and judges it; folders are ARCHIVE_REFUSED without a code. */
static enum archive_status enter(struct archive_reader *reader, struct archive_entry **out,
                                 struct archive_file *file)
{
    struct archive_entry *entry;
    int code = archive_read_next_header(reader->archive, &entry);
    enum archive_status status;
    const char *path;

    if (code == ARCHIVE_EOF) {
        return ARCHIVE_AT_END;
    }
    if (code < ARCHIVE_WARN) {
        return library_failed(reader, file);
    }
    if (++reader->entries > ARCHIVE_ENTRIES_MAX) {
        (void)snprintf(file->problem, sizeof file->problem, "the archive has more than %zu entries",
                       ARCHIVE_ENTRIES_MAX);
        return ARCHIVE_TOO_MUCH;
    }
    path = archive_entry_pathname_utf8(entry);
    path = path ? path : archive_entry_pathname(entry);
    status = judge(reader, entry, path, file);
    if (archive_entry_filetype(entry) == AE_IFDIR && status == ARCHIVE_REFUSED &&
        strcmp(file->code, "unsafe-path") != 0) {
        file->code = NULL;
    }
    *out = entry;
    return status;
}

static enum archive_status next_entry(struct archive_reader *reader, struct archive_file *file)
{
    struct archive_entry *entry;
    enum archive_status status = enter(reader, &entry, file), judged = status;
    bool keep = status == ARCHIVE_FILE;

    if (status > ARCHIVE_PASSED || (status == ARCHIVE_REFUSED && !file->code)) {
        return status;
    }
    if (!keep && reader->is_zip) {
        return status; /* what is passed over is not unpacked */
    }
    status = read_bytes(reader, keep, declared(entry), file);
    if (!keep) {
        srnf_free(file->bytes);
        file->bytes = NULL;
    }
    return status == ARCHIVE_FILE ? judged : status;
}

/* One entry by its head alone, counted as if it were read. */
static enum archive_status foresee(struct archive_reader *reader, struct archive_file *file)
{
    struct archive_entry *entry;
    enum archive_status status = enter(reader, &entry, file);

    if (status == ARCHIVE_FILE && declared(entry) > reader->limits.file) {
        return too_large(reader, file);
    }
    return status == ARCHIVE_FILE ? count(reader, declared(entry), file) : status;
}

/* The next entry that is no folder. */
static enum archive_status step(struct archive_reader *reader, struct archive_file *file,
                                enum archive_status (*entry)(struct archive_reader *,
                                                             struct archive_file *))
{
    locale_t before = reader->locale ? uselocale(reader->locale) : (locale_t)0;
    enum archive_status status;

    do {
        *file = (struct archive_file){.bytes = NULL};
        status = entry(reader, file);
    } while (status == ARCHIVE_REFUSED && !file->code);
    if (status != ARCHIVE_FILE) {
        srnf_free(file->bytes);
        file->bytes = NULL;
    }
    if (reader->locale) {
        (void)uselocale(before);
    }
    return status;
}

enum archive_status archive_next(struct archive_reader *reader, struct archive_file *file)
{
    return step(reader, file, next_entry);
}

enum archive_status archive_fits(const void *bytes, size_t size,
                                 const struct archive_limits *limits, struct archive_file *file)
{
    size_t left = *limits->left;
    const struct archive_limits foreseen = {.file = limits->file, .left = &left};
    enum archive_status status = ARCHIVE_AT_END;
    struct archive_reader *reader = NULL;

    if (is_zip(bytes, size)) {
        reader = archive_open(bytes, size, &foreseen, &status, file);
    }
    while (reader && (status = step(reader, file, foresee)) <= ARCHIVE_PASSED) {
    }
    archive_close(reader);
    return status;
}
