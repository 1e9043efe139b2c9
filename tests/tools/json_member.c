/*
 * json_member.c - one member of a JSON file, as "jq -r" prints it:
 *
 *   json_member FILE .surface.id
 *   json_member FILE .items[0].name
 *
 * Shell tests read thousands of members, and jq needs 17 ms of processor time before it reads any.
 * This takes one. What it prints is what jq prints, or it prints nothing and ends with status 3:
 * then the caller asks jq. That is so for any other filter, for objects, arrays and reals, and for
 * what only one of the two can read.
 */
#include <jansson.h>

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ASK_JQ = 3, NAME_MAX_BYTES = 128 };

/* Whole numbers beyond this are rounded by jq. */
#define EXACT 9007199254740992LL

/* The value at .name, *filter left behind it; NULL where only jq knows. What null has is null. */
static const json_t *member(const json_t *value, const char **filter)
{
    char name[NAME_MAX_BYTES];
    size_t length = 0;
    const json_t *found;

    for ((*filter)++; **filter == '_' || isalnum((unsigned char)**filter); (*filter)++) {
        if (length + 1 == sizeof name || (length == 0 && isdigit((unsigned char)**filter))) {
            return NULL;
        }
        name[length++] = **filter;
    }
    name[length] = '\0';
    if (length == 0 || !(json_is_object(value) || json_is_null(value))) {
        return NULL;
    }
    found = json_object_get(value, name);
    return found ? found : json_null();
}

/* The value at [3], likewise. */
static const json_t *element(const json_t *value, const char **filter)
{
    char *end;
    unsigned long long i;
    const json_t *found;

    if (!isdigit((unsigned char)(*filter)[1])) {
        return NULL;
    }
    i = strtoull(*filter + 1, &end, 10);
    if (*end != ']' || !(json_is_array(value) || json_is_null(value))) {
        return NULL;
    }
    *filter = end + 1;
    found = json_array_get(value, (size_t)i);
    return found ? found : json_null();
}

static int print(const json_t *value)
{
    if (json_is_string(value)) {
        return puts(json_string_value(value)) < 0;
    }
    if (json_is_integer(value) && json_integer_value(value) > -EXACT &&
        json_integer_value(value) < EXACT) {
        return printf("%" JSON_INTEGER_FORMAT "\n", json_integer_value(value)) < 0;
    }
    if (json_is_boolean(value)) {
        return puts(json_is_true(value) ? "true" : "false") < 0;
    }
    return json_is_null(value) ? puts("null") < 0 : ASK_JQ;
}

int main(int count, char **arguments)
{
    json_t *document;
    const json_t *value;
    const char *filter;
    int status = ASK_JQ;

    if (count != 3) {
        fprintf(stderr, "usage: json_member FILE FILTER\n");
        return 2;
    }
    document = json_load_file(arguments[1], 0, NULL);
    value = document;
    filter = arguments[2];
    if (*filter != '.') {
        value = NULL;
    }
    while (value && *filter) {
        value = *filter == '.'   ? member(value, &filter)
                : *filter == '[' ? element(value, &filter)
                                 : NULL;
    }
    if (value) {
        status = print(value);
    }
    json_decref(document);
    return status;
}
