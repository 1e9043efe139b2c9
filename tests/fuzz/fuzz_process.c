/*
 * fuzz_process.c - JSON as the inputs of every process, canonicalized against a store with meshes,
 * a surface, a model and cohorts. The first byte chooses the process; in the text after it @ stands
 * for the surface and % for the model. There is a canonical form or a reason, never both and never
 * neither: the fixture holds that, and ends the program where it is not so.
 */
#include "fuzz/fuzz_require.h"
#include "server/toolkit/process_fixture.h"

#define TEXT_MAX 4096

static void *fixture; /* opened for the first input, removed at the end */

static void close_fixture(void)
{
    (void)fixture_close(&fixture);
}

static size_t count_processes(void)
{
    size_t n = 0;

    while (processes.rows[n]) {
        n++;
    }
    return n;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char text[TEXT_MAX], whole[4 * TEXT_MAX];
    struct outcome outcome;
    json_t *inputs;

    if (!fixture) {
        (void)fixture_open(&fixture);
        (void)atexit(close_fixture);
    }
    if (size < 2 || size > sizeof text) {
        return 0;
    }
    memcpy(text, data + 1, size - 1);
    text[size - 1] = '\0';
    expand(fixture, text, whole, sizeof whole);
    inputs = json_loads(whole, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, NULL);
    if (inputs) {
        outcome =
            canonical_outcome(fixture, processes.rows[data[0] % count_processes()]->id, inputs);
        outcome_clear(&outcome);
        json_decref(inputs);
    }
    return 0;
}
