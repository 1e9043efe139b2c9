/*
 * imports_body.c - the files of an import's body: the entries of an archive, or the parts of a form
 * and the entries of archives among these. An archive within an archive is not opened. The manifest
 * of an export is taken first.
 */
#include "api/imports.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "api/archive.h"
#include "api/multipart.h"
#include "srnf.h"
#include "text.h"

/* Names of what programs for archives and folders leave behind. */
static bool is_left_behind(const char *path)
{
    static const char *const names[] = {".DS_Store", "Thumbs.db", "desktop.ini"};
    const char *base = text_base(path);
    bool left = strncmp(path, "__MACOSX/", 9) == 0 || strncmp(base, "._", 2) == 0;

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        left = left || strcmp(base, names[i]) == 0;
    }
    return left;
}

static void answer(struct import *import, const char *code, const char *what, const char *problem)
{
    (void)problem_respond(import->call, code, "%.200s: %.220s.", what, problem);
    import->answered = true;
}

/* The archive cannot be read on. What came of it before is not kept either, also with partial:
   nobody knows what else there was. */
static void answer_archive(struct import *import, enum archive_status status, const char *what,
                           const struct archive_file *file)
{
    switch (status) {
    case ARCHIVE_GROWS:
        import_answer_growth(import, what);
        break;
    case ARCHIVE_TOO_MUCH:
        answer(import, "body-too-large", what, file->problem);
        break;
    case ARCHIVE_NO_MEMORY:
    case ARCHIVE_STOPPED:
        answer(import, "out-of-memory", what, "there is not enough memory to unpack it now");
        break;
    default:
        answer(import, "unparsable-archive", what, file->problem);
    }
}

/* What follows "./", with which tar begins paths of the folder in which it runs. */
static const char *path_within(const char *path)
{
    while (strncmp(path, "./", 2) == 0) {
        path += 2;
    }
    return path;
}

/* folder: in which the files of an export lie, with its slash; "": in none. */
static void take_entry(struct import *import, const char *folder, struct archive_file *file)
{
    struct import_given given = {.path = file->path,
                                 .type = "",
                                 .bytes = file->bytes,
                                 .size = file->size,
                                 .own = file->bytes};

    if (import->manifest) {
        const char *path = path_within(file->path);

        given.path = path + (strncmp(path, folder, strlen(folder)) == 0 ? strlen(folder) : 0);
    }
    if (!import->manifest && archive_is_one(file->bytes, file->size) &&
        !strcasestr(file->path, ".gz")) {
        import_refuse(import, file->path, "nested-archive",
                      "it is an archive within an archive; unpack it, or send it by itself");
    } else if (!is_left_behind(file->path)) {
        import_take(import, &given);
    }
    srnf_free(given.own);
    file->bytes = NULL;
}

/* The manifest of an export, looked for. */
struct search {
    char folder[ARCHIVE_PATH_MAX]; /* the first that was seen, with its slash */
    bool scattered;                /* there are files outside of it */
    struct archive_file found;     /* the manifest in it, or in none */
};

/* Notes one entry; true where the manifest lies outside all folders, and the search is over. */
static bool note_entry(struct search *search, enum archive_status status, struct archive_file *file)
{
    const char *path = path_within(file->path);
    size_t length = strcspn(path, "/");
    bool top = status == ARCHIVE_FILE && strcmp(path, STUDY_MANIFEST) == 0;

    if (is_left_behind(file->path) || !*path) {
        srnf_free(file->bytes);
        return false;
    }
    if (!search->folder[0] && path[length]) {
        (void)snprintf(search->folder, sizeof search->folder, "%.*s/", (int)length, path);
    }
    search->scattered =
        search->scattered || !path[length] || strncmp(path, search->folder, length + 1) != 0;
    if (top || (status == ARCHIVE_FILE && !search->found.bytes && path[length] &&
                strcmp(path + length + 1, STUDY_MANIFEST) == 0)) {
        srnf_free(search->found.bytes);
        search->found = *file;
        file->bytes = NULL;
    }
    if (top) {
        search->folder[0] = '\0';
        search->scattered = false;
    }
    srnf_free(file->bytes);
    return top;
}

/* Takes the manifest of an export first, wherever in the archive it stands: it says what the other
   files are. It lies outside all folders, or in one in which all lies, as when a folder was packed.
   Of a zip only the heads of entries are read; a tar is unpacked twice, within the same limit. */
static void take_manifest(struct import *import, const void *bytes, size_t size, const char *what,
                          struct search *search)
{
    size_t left = import->unpack_left;
    const struct archive_limits limits = {
        .file = import->call->api->config.max_body, .left = &left, .only = STUDY_MANIFEST};
    enum archive_status status;
    struct archive_file file;
    struct archive_reader *reader = archive_open(bytes, size, &limits, &status, &file);
    bool over = false;

    while (reader && !over && (status = archive_next(reader, &file)) <= ARCHIVE_PASSED) {
        over = note_entry(search, status, &file);
    }
    archive_close(reader);
    if (!over && status != ARCHIVE_AT_END) {
        answer_archive(import, status, what, &file);
    } else if (search->found.bytes && !search->scattered) {
        const struct import_given given = {.path = STUDY_MANIFEST,
                                           .type = "",
                                           .bytes = search->found.bytes,
                                           .size = search->found.size};

        (void)import_take_manifest(import, &given);
    }
    srnf_free(search->found.bytes);
}

static void read_archive(struct import *import, const void *bytes, size_t size, const char *what)
{
    const struct archive_limits limits = {.file = import->call->api->config.max_body,
                                          .left = &import->unpack_left};
    struct search search = {.scattered = false};
    struct archive_file file;
    enum archive_status status = archive_fits(bytes, size, &limits, &file);
    struct archive_reader *reader;

    if (status != ARCHIVE_AT_END) {
        answer_archive(import, status, what, &file);
        return;
    }
    take_manifest(import, bytes, size, what, &search);
    if (import->answered) {
        return;
    }
    reader = archive_open(bytes, size, &limits, &status, &file);

    while (reader && !import->answered &&
           ((status = archive_next(reader, &file)) == ARCHIVE_FILE || status == ARCHIVE_REFUSED)) {
        if (status == ARCHIVE_REFUSED && !is_left_behind(file.path)) {
            import_refuse(import, file.path, file.code, "%s", file.problem);
        } else if (status == ARCHIVE_FILE) {
            take_entry(import, search.folder, &file);
        }
    }
    archive_close(reader);
    if (!import->answered && status != ARCHIVE_AT_END) {
        answer_archive(import, status, what, &file);
    }
}

/* ---- Forms ----------------------------------------------------------------------------------- */

/* A field of the form that stands for a query parameter. */
static void take_field(struct import *import, const struct multipart_part *part)
{
    char value[STORE_COHORT_NAME_MAX + 1];

    (void)snprintf(value, sizeof value, "%.*s",
                   (int)(part->size < sizeof value ? part->size : sizeof value - 1),
                   (const char *)part->bytes);
    if (strcmp(part->name, "cohort") == 0) {
        if (value[0] && !cohort_name_valid(value)) {
            answer(import, "invalid-input", "cohort", "this is no name of a cohort");
        } else if (value[0]) {
            memcpy(import->cohort, value, sizeof import->cohort); /* a valid name fits */
        }
    } else if (strcmp(part->name, "partial") == 0) {
        import->partial = strcmp(value, "true") == 0 || strcmp(value, "on") == 0;
    } else {
        answer(import, "invalid-input", part->name,
               "the fields of a form are cohort and partial; a file needs a file name");
    }
}

static void take_part(struct import *import, const struct multipart_part *part)
{
    struct import_given given = {
        .path = part->file, .type = part->type, .bytes = part->bytes, .size = part->size};
    const char *problem = archive_path_problem(part->file);

    if (!part->file[0]) {
        if (part->size > 0 || strcmp(part->type, "application/octet-stream") != 0) {
            take_field(import, part); /* otherwise a field for files where none was chosen */
        }
    } else if (problem) {
        import_refuse(import, part->file, "unsafe-path", "%s", problem);
    } else if (archive_is_one(part->bytes, part->size) && !strcasestr(part->file, ".gii") &&
               !(strcasestr(part->file, ".gz") && !strcasestr(part->file, ".tar"))) {
        read_archive(import, part->bytes, part->size, part->file);
    } else {
        import_take(import, &given);
    }
}

static void read_form(struct import *import, const char *type)
{
    const struct api_request *request = import->call->request;
    struct multipart form;
    struct multipart_part part;
    enum multipart_status status = MULTIPART_END;
    char problem[160];

    if (!multipart_open(&form, type, request->body, request->body_size)) {
        answer(import, "unparsable-archive", "Content-Type",
               "multipart/form-data needs a boundary of at most 70 characters");
        return;
    }
    while (!import->answered &&
           (status = multipart_next(&form, &part, problem)) == MULTIPART_PART) {
        take_part(import, &part);
        if (!import->answered && jobs_memory_told(jobs_memory_current())) {
            answer(import, "out-of-memory", "The form", "its reading was given up");
        }
    }
    if (!import->answered && status == MULTIPART_WRONG) {
        answer(import, "unparsable-archive", "The body", problem);
    }
}

void import_read_body(struct import *import)
{
    const struct api_request *request = import->call->request;
    const char *type = api_request_header(request, "Content-Type");
    const char *other = archive_other(request->body, request->body_size);

    if (request->body_size == 0) {
        answer(import, "unparsable-archive", "The body", "it is empty");
    } else if (type && strncasecmp(type, "multipart/form-data", 19) == 0) {
        read_form(import, type);
    } else if (archive_is_one(request->body, request->body_size)) {
        read_archive(import, request->body, request->body_size, "The body");
    } else {
        char text[200];

        (void)snprintf(text, sizeof text,
                       "it is %s; an import is a zip, tar or tar.gz, or multipart/form-data (curl "
                       "-F file=@..); POST /v1/meshes takes one mesh as it is",
                       other ? other : "none of these");
        answer(import, "unparsable-archive", "The body", text);
    }
}
