/*
 * labels.c - names and tags in requests and records. As in a JSON merge patch (RFC 7396), what is
 * not given stays, and null removes.
 */
#include "api/labels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_memory.h"
#include "store/digest.h"

const char *label_tag_problem(const char *tag)
{
    const char *problem = name_problem(tag);

    if (!tag[0]) {
        return "must not be empty";
    }
    return problem                        ? problem
           : strlen(tag) > LABELS_TAG_MAX ? "must have at most 64 bytes in UTF-8"
                                          : NULL;
}

static void read_name(const json_t *value, struct labels *labels, struct problem_list *list)
{
    const char *text = json_is_null(value) ? "" : json_string_value(value);
    const char *problem = text ? name_problem(text) : "must be a string or null";

    if (problem) {
        problem_add(list, "/name", "%s", problem);
        return;
    }
    (void)snprintf(labels->name, sizeof labels->name, "%s", text);
    labels->change.name = labels->name;
}

static bool has_text(const json_t *array, const char *text)
{
    for (size_t i = 0; i < json_array_size(array); i++) {
        if (strcmp(json_string_value(json_array_get(array, i)), text) == 0) {
            return true;
        }
    }
    return false;
}

/* Each once, in the order given. */
static void read_tags(const json_t *value, struct labels *labels, struct problem_list *list)
{
    json_t *tags = json_array();
    bool good = json_is_null(value) || json_is_array(value);

    if (!good || json_array_size(value) > LABELS_TAGS_MAX) {
        problem_add(list, "/tags", "must be an array of at most %d strings, or null",
                    LABELS_TAGS_MAX);
        good = false;
    }
    for (size_t i = 0; good && i < json_array_size(value); i++) {
        const char *tag = json_string_value(json_array_get(value, i));
        const char *problem = tag ? label_tag_problem(tag) : "must be a string";
        char pointer[32];

        if (problem) {
            (void)snprintf(pointer, sizeof pointer, "/tags/%zu", i);
            problem_add(list, pointer, "%s", problem);
        } else if (!has_text(tags, tag)) {
            (void)json_array_append_new(tags, json_string(tag));
        }
    }
    labels->tags = good ? json_memory_dumps(tags, JSON_COMPACT) : NULL;
    labels->change.tags = labels->tags;
    json_decref(tags);
}

void labels_read(const json_t *body, struct labels *labels, struct problem_list *list)
{
    const json_t *name = json_object_get(body, "name"), *tags = json_object_get(body, "tags");

    *labels = (struct labels){.tags = NULL};
    if (name) {
        read_name(name, labels, list);
    }
    if (tags) {
        read_tags(tags, labels, list);
    }
}

void labels_clear(struct labels *labels)
{
    free(labels->tags);
    labels->tags = NULL;
    labels->change = (struct store_labels){.name = NULL};
}

int labels_rename(struct store *store, const char *owner, const char *id, const char *name,
                  char **held)
{
    const struct store_labels labels = {.name = name};
    char *copy;
    int status;

    if (!name[0] || strcmp(*held ? *held : "", name) == 0) {
        return STORE_OK;
    }
    copy = strdup(name);
    status = copy ? store_label(store, owner, id, &labels) : STORE_NOMEM;
    if (status != STORE_OK) {
        free(copy);
        return status;
    }
    free(*held);
    *held = copy;
    return STORE_OK;
}

void labels_set_tags(json_t *record, const char *tags)
{
    json_t *array = json_loads(tags ? tags : "[]", 0, NULL);

    (void)json_object_set_new(record, "tags", array ? array : json_array());
}

void labels_etag(char etag[LABELS_ETAG_MAX], const char *id, const char *name, const char *tags)
{
    char digests[2][65];

    store_sha256_hex(digests[0], name ? name : "", name ? strlen(name) : 0);
    store_sha256_hex(digests[1], tags ? tags : "[]", tags ? strlen(tags) : 2);
    (void)snprintf(etag, LABELS_ETAG_MAX, "%.63s.%.5s%.5s", id, digests[0], digests[1]);
}
