/*
 * test_rings.c - a ring is the list of neighbours that its changes make, in their order, whether
 * it is an array or grew into a hub's blocks and shrank again, also where memory is refused; and
 * no change of a hub costs its valence.
 */
#include "sphere_map/sphere_map.h"
#include "support/random.h"
#include "support/refusing.h"
#include "support/timing.h"

#define VERTICES ((uint32_t)60000) /* from a sixteenth of them on a ring is a hub's */
#define LOOK_EACH 997              /* changes */

/* What the ring should be: an array, changed the slow way; and the vertices that are in it. */
struct model {
    uint32_t at[VERTICES], count;
    uint32_t outside[VERTICES], n_outside;
};

static void start(struct spherical *s, struct ring *ring, struct model *model)
{
    *s = (struct spherical){.n = VERTICES};
    *ring = (struct ring){0};
    /* One neighbour, which the array gets by hand. */
    model->count = 1;
    model->at[0] = 0;
    model->n_outside = 0;
    for (uint32_t v = VERTICES - 1; v > 0; v--) {
        model->outside[model->n_outside++] = v;
    }
    ring->at = srnf_alloc(4, sizeof *ring->at);
    assert_non_null(ring->at);
    ring->at[0] = 0;
    ring->count = 1;
    ring->capacity = 4;
}

static void insert(struct spherical *s, struct ring *ring, struct model *model, uint32_t i,
                   bool after)
{
    uint32_t vertex = model->outside[--model->n_outside], place = model->at[i];

    i += after;
    memmove(model->at + i + 1, model->at + i, (model->count - i) * sizeof *model->at);
    model->at[i] = vertex;
    model->count++;
    assert_int_equal(spherical_ring_insert(s, ring, place, after, vertex), SRNF_OK);
}

static void take_out(struct spherical *s, struct ring *ring, struct model *model, uint32_t i)
{
    uint32_t vertex = model->at[i];

    model->count--;
    memmove(model->at + i, model->at + i + 1, (model->count - i) * sizeof *model->at);
    model->outside[model->n_outside++] = vertex;
    spherical_ring_remove(s, ring, vertex);
}

static void replace(struct spherical *s, struct ring *ring, struct model *model, uint32_t i)
{
    uint32_t old = model->at[i], vertex = model->outside[model->n_outside - 1];

    model->at[i] = vertex;
    model->outside[model->n_outside - 1] = old;
    spherical_ring_replace(s, ring, old, vertex);
}

static void compare(struct ring *ring, const struct model *model)
{
    assert_int_equal(ring->count, model->count);
    assert_int_equal(spherical_ring_first(ring), model->at[0]);
    assert_true(spherical_ring_has(ring, model->at[model->count / 2]));
    assert_false(spherical_ring_has(ring, model->outside[model->n_outside / 2]));
    assert_memory_equal(spherical_ring_read(ring), model->at, model->count * sizeof *model->at);
}

/* Up to 20,000 neighbours and down to three, twice, most changes near one place. */
static void test_keeps_the_order(void **state)
{
    static struct model model;
    struct test_random random = test_random_seed(11);
    struct spherical s;
    struct ring ring;
    uint32_t *first;
    bool was_hub = false;
    (void)state;

    start(&s, &ring, &model);
    first = ring.at;
    for (uint32_t k = 0, rising = 1, turns = 0; turns < 4; k++) {
        uint32_t spread =
            test_random_below(&random, 4) > 0 && model.count > 100 ? 100 : model.count;
        uint32_t i = (uint32_t)test_random_below(&random, spread), draw = k % 7;

        if (draw == 0) {
            replace(&s, &ring, &model, i);
        } else if ((draw < 5) == (rising == 1) || model.count < 4) {
            insert(&s, &ring, &model, i, test_random_below(&random, 2) > 0);
        } else {
            take_out(&s, &ring, &model, i);
        }
        was_hub = was_hub || ring.hub;
        if (k % LOOK_EACH == 0) {
            compare(&ring, &model);
        }
        if ((rising == 1 && model.count >= 20000) || (rising == 0 && model.count <= 3)) {
            compare(&ring, &model);
            assert_int_equal(ring.hub != NULL, rising);
            rising = 1 - rising;
            turns++;
        }
    }
    assert_true(was_hub);
    spherical_hub_leave(&ring);
    compare(&ring, &model);
    spherical_pool_clear(&s.pool);
    spherical_hubs_clear(&s);
    srnf_free(first);
}

/* Each request for memory is refused in turn: a hub keeps its array, or the change says so. */
static void test_refused_memory(void **state)
{
    static struct model model;
    size_t requests = 1, said = 0;
    (void)state;

    refusing_none();
    for (size_t k = 0; k <= requests; k++) {
        struct spherical s;
        struct ring ring;
        uint32_t *first;
        int status = SRNF_OK;

        start(&s, &ring, &model);
        first = ring.at;
        refusing_at(k);
        for (uint32_t v = 1; v < 10000 && status == SRNF_OK; v++) {
            uint32_t place = model.at[model.count - 1];

            status = spherical_ring_insert(&s, &ring, place, true, v);
            if (status == SRNF_OK) {
                model.at[model.count++] = v;
            }
        }
        requests = refusing.requests;
        refusing_none();
        said += status == SRNF_ENOMEM;
        assert_true(status == SRNF_OK || status == SRNF_ENOMEM);
        assert_int_equal(ring.count, model.count);
        assert_memory_equal(spherical_ring_read(&ring), model.at, model.count * sizeof *model.at);
        spherical_hub_leave(&ring);
        spherical_pool_clear(&s.pool);
        spherical_hubs_clear(&s);
        srnf_free(first);
        assert_int_equal(refusing.alive, 0);
    }
    print_message("# %zu requests, %zu of them told of\n", requests, said);
    assert_true(requests > 5 && said > 2);
}

/* Vertices go in next to others all over the ring. */
static double seconds_of_changes(uint32_t valence)
{
    struct test_random random = test_random_seed(3);
    struct spherical s = {.n = valence + 1};
    struct ring ring = {srnf_alloc(4, sizeof *ring.at), 1, 4, NULL};
    uint32_t *first = ring.at;
    double begun;

    assert_non_null(first);
    first[0] = 0;
    begun = timing_cpu();
    for (uint32_t v = 1; v < valence; v++) {
        assert_int_equal(
            spherical_ring_insert(&s, &ring, (uint32_t)test_random_below(&random, v), true, v),
            SRNF_OK);
    }
    begun = timing_cpu() - begun;
    spherical_hub_leave(&ring);
    spherical_pool_clear(&s.pool);
    srnf_free(first);
    return begun;
}

/* As an array, eight times the valence cost 64 times as much. */
static void test_a_change_costs_no_valence(void **state)
{
    double small, large;
    (void)state;

    small = seconds_of_changes(50000);
    large = seconds_of_changes(400000);
    print_message("# 50,000 changes %.3f s, 400,000 %.3f s\n", small, large);
    assert_true(large < 32.0 * small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_keeps_the_order),
        cmocka_unit_test(test_refused_memory),
        cmocka_unit_test(test_a_change_costs_no_valence),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
