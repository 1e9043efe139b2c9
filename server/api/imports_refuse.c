/*
 * imports_refuse.c - what an import does not take, which every part of it may find.
 */
#include "api/imports.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "store/batch.h"

void import_refuse(struct import *import, const char *path, const char *code, const char *format,
                   ...)
{
    char detail[700];
    va_list arguments;
    json_t *entry, *name;

    if (++import->n_refused > IMPORT_REFUSALS_MAX) {
        return;
    }
    va_start(arguments, format);
    (void)vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    entry = json_object();
    name = delimited_utf8(path, strlen(path)) ? json_string(path) : json_string("?");
    (void)json_object_set_new(entry, "file", name);
    (void)json_object_set_new(entry, "code", json_string(code));
    (void)json_object_set_new(entry, "detail",
                              delimited_utf8(detail, strlen(detail)) ? json_string(detail)
                                                                     : json_string("not readable"));
    (void)json_array_append_new(import->refused, entry);
}

void import_drop(struct import *import, struct import_file *file, const char *code,
                 const char *detail)
{
    if (code) {
        import_refuse(import, file->path, code, "%s", detail);
    }
    if (!file->refused && file->put != SIZE_MAX) {
        store_batch_drop(import->batch, file->put);
    }
    file->refused = true;
}

size_t import_growth(const struct api_call *call)
{
    size_t most = call->api->config.max_body;

    return most > SIZE_MAX / IMPORT_GROWTH ? SIZE_MAX : IMPORT_GROWTH * most;
}

void import_answer_growth(struct import *import, const char *path)
{
    (void)problem_respond(import->call, "body-too-large",
                          "%.200s: with it all that is packed in this import, archives and the "
                          "files in them, unpacks to more than the %zu bytes that one import may. "
                          "Send the files in several imports.",
                          path, import_growth(import->call));
    import->answered = true;
}

void import_answer_memory(struct import *import)
{
    (void)problem_respond(import->call, "out-of-memory", "The import does not fit into memory.");
    import->answered = true;
}
