/*
 * imports_match.c - which row of the table is about which file.
 *
 * A row names a file by its path in the archive or form; or by the last part of it alone, where
 * only one file has that. What stands on one side alone is refused, in either direction: a mesh
 * without its label would be in the cohort as if it had none.
 *
 * Files and rows are sorted once, so that 100,000 of each take a fraction of a second.
 */
#include "api/imports.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "api/json_memory.h"

#define CLOSE_SOUGHT 100 /* rows: each looks at all files */

static int by_path(const void *a, const void *b)
{
    const struct import_file *x = *(struct import_file *const *)a,
                             *y = *(struct import_file *const *)b;
    int order = strcmp(x->path, y->path);

    return order ? order : (x->number > y->number) - (x->number < y->number);
}

static int by_base(const void *a, const void *b)
{
    const struct import_file *x = *(struct import_file *const *)a,
                             *y = *(struct import_file *const *)b;
    int order = strcmp(x->base, y->base);

    return order ? order : by_path(a, b);
}

/* The files in both orders: malloc. */
struct index {
    struct import_file **paths, **bases;
    size_t n;
};

static bool make_index(struct import *import, struct index *index)
{
    index->n = 0;
    index->paths = calloc(import->n_files + 1, sizeof(struct import_file *));
    index->bases = calloc(import->n_files + 1, sizeof(struct import_file *));
    if (!index->paths || !index->bases) {
        json_memory_fail();
        return false;
    }
    for (size_t i = 0; i < import->n_files; i++) {
        index->paths[i] = index->bases[i] = &import->files[i];
    }
    index->n = import->n_files;
    qsort(index->paths, index->n, sizeof(struct import_file *), by_path);
    qsort(index->bases, index->n, sizeof(struct import_file *), by_base);
    return true;
}

/* The first of the sorted files whose name is not before this one. */
static size_t lower_bound(struct import_file *const *files, size_t n, const char *name, bool base)
{
    size_t low = 0, high = n;

    while (low < high) {
        size_t middle = low + (high - low) / 2;
        const char *there = base ? files[middle]->base : files[middle]->path;

        if (strcmp(there, name) < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Length of a name without what stands behind its first point. */
static size_t stem_of(const char *base)
{
    size_t length = strcspn(base, ".");

    return length > 0 ? length : strlen(base);
}

/* The path of the one file that a row most likely means: by the last part of its name, without
   regard to case and to what stands behind its first point; NULL: there is none, or several. */
static const char *find_close(const struct index *index, const char *wanted)
{
    const char *slash = strrchr(wanted, '/'), *back = strrchr(wanted, '\\');
    const char *base = slash || back ? (slash > back ? slash : back) + 1 : wanted;
    const char *exact = NULL, *close = NULL;
    size_t n_exact = 0, n_close = 0, length = stem_of(base);

    for (size_t i = 0; base[0] && i < index->n; i++) {
        const char *own = index->bases[i]->base;

        if (strcasecmp(own, base) == 0) {
            exact = index->bases[i]->path;
            n_exact++;
        }
        if (stem_of(own) == length && strncasecmp(own, base, length) == 0) {
            close = index->bases[i]->path;
            n_close++;
        }
    }
    return n_exact == 1 ? exact : n_exact == 0 && n_close == 1 ? close : NULL;
}

/* The file that a row names; NULL with a refusal noted. */
static struct import_file *find(struct import *import, const struct index *index, const char *name,
                                uint32_t line)
{
    const char *wanted = strncmp(name, "./", 2) == 0 ? name + 2 : name;
    size_t at = lower_bound(index->paths, index->n, wanted, false);

    if (at < index->n && strcmp(index->paths[at]->path, wanted) == 0) {
        return index->paths[at];
    }
    at = lower_bound(index->bases, index->n, wanted, true);
    if (at >= index->n || strcmp(index->bases[at]->base, wanted) != 0) {
        const char *close = import->n_refused < CLOSE_SOUGHT ? find_close(index, wanted) : NULL;

        import_refuse(import, name, "no-such-file",
                      "line %u of %.200s names it, and no such mesh came with it%s%.200s%s", line,
                      import->table_path, close ? ": did you mean " : "", close ? close : "",
                      close ? "?" : "");
        return NULL;
    }
    if (at + 1 < index->n && strcmp(index->bases[at + 1]->base, wanted) == 0) {
        import_refuse(import, name, "ambiguous-file",
                      "line %u of %.200s can mean %.200s or %.200s; give the path", line,
                      import->table_path, index->bases[at]->path, index->bases[at + 1]->path);
        return NULL;
    }
    return index->bases[at];
}

/* Of files with one path each is refused: nobody knows which was meant. */
static void refuse_duplicates(struct import *import, const struct index *index)
{
    for (size_t i = 0, end; i < index->n; i = end) {
        for (end = i + 1;
             end < index->n && strcmp(index->paths[i]->path, index->paths[end]->path) == 0;) {
            end++;
        }
        for (size_t k = i; end - i > 1 && k < end; k++) {
            if (!index->paths[k]->refused) {
                import_drop(import, index->paths[k], "duplicate-file",
                            "another file has the same name");
            }
        }
    }
}

static void count_label(struct import *import, const char *label)
{
    json_int_t n = json_integer_value(json_object_get(import->labels, label));

    if (!import->labels) {
        import->labels = json_object();
    }
    if (label[0] && (n > 0 || json_object_size(import->labels) < IMPORT_LABELS_SHOWN)) {
        (void)json_object_set_new(import->labels, label, json_integer(n + 1));
    }
}

/* One row: its member, if its file is there and nothing is wrong with it. */
static void take_row(struct import *import, const struct index *index, size_t row, bool *named,
                     struct cohort_text *members)
{
    const char *name = study_table_key(&import->table, row);
    uint32_t line = import->table.cells.lines[row + 1];
    struct problem_list list = {.errors = NULL};
    struct import_file *file;
    json_t *member;

    if (!name[0]) {
        import_refuse(import, import->table_path, "invalid-row", "line %u names no file", line);
        return;
    }
    file = find(import, index, name, line);
    if (!file) {
        return;
    }
    if (named[file->number] && !file->refused) {
        import_refuse(import, name, "duplicate-row", "line %u of %.200s names it a second time",
                      line, import->table_path);
        return;
    }
    named[file->number] = true;
    if (file->passed) {
        import_refuse(import, name, "unparsable-mesh",
                      "line %u of %.200s names it, and it is a text and no mesh", line,
                      import->table_path);
    }
    if (file->refused) {
        return;
    }
    if (file->volume) {
        import_refuse(import, name, "invalid-row",
                      "line %u of %.200s names a volume, which is no member of a cohort: leave it "
                      "out, and add the meshes that extract makes of its labels",
                      line, import->table_path);
        return;
    }
    member = study_table_member(&import->table, row, file->id, &list);
    if (list.errors) {
        const json_t *first = json_array_get(list.errors, 0);
        const char *pointer = json_string_value(json_object_get(first, "pointer"));
        const char *detail = json_string_value(json_object_get(first, "detail"));

        import_refuse(import, name, "invalid-row", "line %u of %.200s: %.80s %.200s", line,
                      import->table_path, pointer ? pointer + 1 : "", detail ? detail : "");
        import_drop(import, file, NULL, NULL);
        json_decref(list.errors);
    } else {
        cohort_text_add(members, member);
        if (import->table.label != STUDY_NO_COLUMN) {
            count_label(import, delimited_cell(&import->table.cells, row, import->table.label));
        }
    }
    json_decref(member);
}

static void match_rows(struct import *import, const struct index *index,
                       struct cohort_text *members)
{
    bool *named = calloc(import->n_files + 1, sizeof *named);

    if (!named) {
        json_memory_fail();
        return;
    }
    for (size_t i = 0; i < import->table.cells.rows && !json_memory_failed(); i++) {
        take_row(import, index, i, named, members);
    }
    for (size_t i = 0; i < import->n_files; i++) {
        if (!named[i] && !import->files[i].refused && !import->files[i].volume) {
            import_drop(import, &import->files[i], "not-in-table",
                        "no row of the table is about it");
        }
    }
    free(named);
}

/* Without a table the members are the files by their paths. */
static void add_all(const struct index *index, struct cohort_text *members)
{
    for (size_t i = 0; i < index->n; i++) {
        struct problem_list list = {.errors = NULL};
        json_t *given, *member;

        if (index->paths[i]->refused || index->paths[i]->volume) {
            continue;
        }
        given = json_object();
        (void)json_object_set_new(given, "id", json_string(index->paths[i]->id));
        member = cohort_read_member(given, "", &list);
        cohort_text_add(members, member);
        json_decref(given);
        json_decref(member);
        json_decref(list.errors);
    }
}

void import_match(struct import *import, struct cohort_text *members)
{
    struct index index = {.n = 0};

    if (make_index(import, &index)) {
        refuse_duplicates(import, &index);
        if (import->table_path) {
            match_rows(import, &index, members);
        } else {
            add_all(&index, members);
        }
    }
    free(index.paths);
    free(index.bases);
}
