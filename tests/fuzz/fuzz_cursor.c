/*
 * fuzz_cursor.c - any text at all as filters, limit and cursor of a list. An odd first byte takes
 * the rest as the query itself; an even one takes it as what a cursor says, and adds the check that
 * makes it one of ours, so that what is behind the check is reached as well. Half of that byte says
 * which list.
 */
#include "api/handler.h"
#include "api/lists.h"
#include "api/respond.h"
#include "api/routes.h"
#include "fuzz/fuzz_require.h"
#include "processes/processes.h"
#include "store/digest.h"

#include <stdio.h>
#include <string.h>

#define TEXT_MAX ((size_t)512)
#define CHECK_DIGITS 8

/* "cursor=" and the text with its check, in hexadecimal. */
static void disguise(const uint8_t *data, size_t size, char *query)
{
    char text[TEXT_MAX + CHECK_DIGITS], hex[65];

    memcpy(text, data, size);
    store_sha256_hex(hex, text, size);
    memcpy(text + size, hex, CHECK_DIGITS);
    memcpy(query, "cursor=", 7);
    query += 7;
    for (size_t i = 0; i < size + CHECK_DIGITS; i++) {
        (void)snprintf(query + 2 * i, 3, "%02x", (unsigned char)text[i]);
    }
}

static const char *const kinds[] = {"meshes", "surfaces", "jobs", "models", "cohorts", "volumes"};
#define KINDS (sizeof kinds / sizeof kinds[0])

static const struct api_route *route_of(const char *kind)
{
    const struct api_route *route = api_routes;

    while (strcmp(route->method, "GET") != 0 || strncmp(route->pattern, "/v1/", 4) != 0 ||
           strcmp(route->pattern + 4, kind) != 0) {
        route++;
    }
    return route;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char query[2 * (TEXT_MAX + CHECK_DIGITS) + 16] = "";
    struct api_response response = {0};
    const char *kind = kinds[size > 0 ? data[0] / 2 % KINDS : 0];
    const struct api_route *route = route_of(kind);
    struct api_request request = {.method = "GET",
                                  .path = route->pattern,
                                  .route = (void *)(uintptr_t)route,
                                  .query = query,
                                  .id = "r"};
    struct api api = {.config.processes = &processes};
    struct api_call call = {.api = &api, .request = &request, .response = &response};
    struct list list;

    if (size == 0 || size - 1 > TEXT_MAX) {
        return 0;
    }
    if (data[0] % 2) {
        memcpy(query, data + 1, size - 1);
    } else {
        disguise(data + 1, size - 1, query);
    }
    if (list_open(&call, kind, &list)) {
        fuzz_require(list.limit >= 1 && list.limit <= 200 && list.page.limit == list.limit + 1);
        fuzz_require(response.status == 0);
        json_decref(list.items);
    } else {
        fuzz_require(response.status == 400 || response.status == 422);
    }
    api_response_clear(&response);
    return 0;
}
