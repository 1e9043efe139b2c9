/*
 * fuzz_cursor.c - any text at all as limit and cursor of a list. An odd first byte takes the rest
 * as the query itself; an even one takes it as what a cursor says, and adds the check that makes
 * it one of ours, so that what is behind the check is reached as well.
 */
#include "api/lists.h"
#include "api/respond.h"
#include "fuzz/fuzz_require.h"
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

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char query[2 * (TEXT_MAX + CHECK_DIGITS) + 16] = "";
    struct api_response response = {0};
    struct api_request request = {.method = "GET", .path = "/v1/meshes", .query = query, .id = "r"};
    struct api_call call = {.request = &request, .response = &response};
    struct list list;

    if (size == 0 || size - 1 > TEXT_MAX) {
        return 0;
    }
    if (data[0] % 2) {
        memcpy(query, data + 1, size - 1);
    } else {
        disguise(data + 1, size - 1, query);
    }
    if (list_open(&call, "meshes", &list)) {
        fuzz_require(list.limit >= 1 && list.limit <= 200 && list.page.limit == list.limit + 1);
        fuzz_require(response.status == 0);
        json_decref(list.items);
    } else {
        fuzz_require(response.status == 400 || response.status == 422);
    }
    api_response_clear(&response);
    return 0;
}
