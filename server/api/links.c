/*
 * links.c - links and schemas as OGC API - Processes 1.0 writes them.
 *
 * Tables of processes write JSON Schema 2020-12, which OpenAPI 3.1 uses as it is. The standard's
 * descriptions use the schema objects of OpenAPI 3.0; of the keywords that the tables have, three
 * are written differently there.
 */
#include "api/links.h"

#include <ctype.h>
#include <string.h>

void link_add(json_t *links, const char *href, const char *rel, const char *type, const char *title)
{
    json_t *one = json_pack("{s:s, s:s, s:s}", "href", href, "rel", rel, "type", type);

    if (title) {
        (void)json_object_set_new(one, "title", json_string(title));
    }
    (void)json_array_append_new(links, one);
}

void title_of(const char *name, char *title, size_t size)
{
    size_t n = 0;

    for (size_t i = 0; name[i] && n + 2 < size; i++) {
        unsigned char c = (unsigned char)name[i];

        if (i > 0 && isupper(c)) {
            title[n++] = ' ';
        }
        title[n++] = (char)(i == 0 ? toupper(c) : tolower(c));
    }
    title[n] = '\0';
}

/* ["number", "null"] becomes "number", nullable. */
static void convert_type(json_t *schema)
{
    json_t *types = json_object_get(schema, "type"), *type;
    size_t i;

    if (!json_is_array(types)) {
        return;
    }
    json_incref(types);
    json_array_foreach(types, i, type)
    {
        if (strcmp(json_string_value(type), "null") == 0) {
            (void)json_object_set_new(schema, "nullable", json_true());
        } else {
            (void)json_object_set(schema, "type", type);
        }
    }
    json_decref(types);
}

/* Limits that are not included, and constants. */
static void convert_values(json_t *schema)
{
    json_t *lowest = json_object_get(schema, "exclusiveMinimum");
    json_t *constant = json_object_get(schema, "const");

    if (json_is_number(lowest)) {
        (void)json_object_set(schema, "minimum", lowest);
        (void)json_object_set_new(schema, "exclusiveMinimum", json_true());
    }
    if (constant) {
        (void)json_object_set_new(schema, "enum", json_pack("[O]", constant));
        (void)json_object_del(schema, "const");
    }
}

void schema_to_openapi30(json_t *schema)
{
    static const char *const parts[] = {"items", "additionalProperties", "not"};
    static const char *const lists[] = {"anyOf", "oneOf", "allOf"};
    const char *name;
    json_t *part;
    size_t n;

    if (!json_is_object(schema)) {
        return; /* additionalProperties: false */
    }
    convert_type(schema);
    convert_values(schema);
    json_object_foreach(json_object_get(schema, "properties"), name, part)
    {
        schema_to_openapi30(part);
    }
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        schema_to_openapi30(json_object_get(schema, parts[i]));
    }
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++) {
        json_array_foreach(json_object_get(schema, lists[i]), n, part)
        {
            schema_to_openapi30(part);
        }
    }
}
