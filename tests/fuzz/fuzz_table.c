/*
 * fuzz_table.c - any bytes as the table of a study: a rectangle of texts in UTF-8, of which each
 * row is a member or a problem.
 */
#include "api/cohorts.h"
#include "api/study_table.h"
#include "fuzz/fuzz_require.h"

#include <string.h>

#define ROWS_READ 20

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char id[] = "mesh-0123456789abcdef0123456789abcdef";
    char problem[DELIMITED_PROBLEM_MAX];
    struct study_table table;

    if (study_table_read(data, size, "file", &table, problem) == DELIMITED_OK) {
        fuzz_require(table.cells.columns >= 1 && table.cells.columns <= DELIMITED_COLUMNS_MAX);
        fuzz_require(table.cells.rows < DELIMITED_ROWS_MAX);
        for (size_t i = 0; i < table.cells.rows && i < ROWS_READ; i++) {
            struct problem_list list = {.errors = NULL};
            json_t *member = study_table_member(&table, i, id, &list);
            char *text = json_dumps(member, JSON_COMPACT);

            fuzz_require(text != NULL || list.errors);
            fuzz_require(
                delimited_utf8(study_table_key(&table, i), strlen(study_table_key(&table, i))));
            free(text);
            json_decref(member);
            json_decref(list.errors);
        }
    } else {
        fuzz_require(problem[0]);
    }
    study_table_clear(&table);
    return 0;
}
