/*
 * hubs.c - rings of hubs, as a list of blocks beside an array that tells each neighbour's block.
 *
 * As an array the ring of a hub is searched and moved at each change, and a mesh of one hub costs
 * the square of its vertices. Here a change costs one block. What reads the whole ring gets it as
 * an array, written anew when there were changes; the order is the array's throughout. Without the
 * memory for it a hub keeps its array: slower, the same result.
 */
#include "sphere_map.h"

#include <string.h>

#define HUB_MIN ((uint32_t)4096) /* neighbours, */
#define HUB_SHARE ((size_t)16)   /* and one in so many of the mesh's vertices: so hubs are few */
#define BLOCK_ENTRIES ((uint32_t)512)
#define NONE UINT32_MAX

struct block {
    uint32_t next, count; /* next: NONE behind the last */
    uint32_t at[BLOCK_ENTRIES];
};

struct hub {
    struct hub *next, **link; /* of all hubs; what points here */
    uint32_t *block_of;       /* [vertices of the mesh], NONE for what is no neighbour */
    struct block *blocks;     /* from blocks[0] on by next */
    uint32_t used, capacity;
    bool changed; /* since the ring's array was written */
};

static bool deserves(const struct spherical *s, uint32_t count)
{
    return count >= HUB_MIN && count >= s->n / HUB_SHARE;
}

static void hub_free(struct hub *hub)
{
    *hub->link = hub->next;
    if (hub->next) {
        hub->next->link = hub->link;
    }
    srnf_free(hub->block_of);
    srnf_free(hub->blocks);
    srnf_free(hub);
}

void spherical_hubs_clear(struct spherical *s)
{
    while (s->hubs) {
        hub_free(s->hubs);
    }
}

/* A block behind `after`, which may be NONE: the first one. There is room for it. */
static uint32_t append_block(struct hub *hub, uint32_t after)
{
    uint32_t b = hub->used++;
    struct block *block = &hub->blocks[b];

    block->count = 0;
    block->next = after == NONE ? NONE : hub->blocks[after].next;
    if (after != NONE) {
        hub->blocks[after].next = b;
    }
    return b;
}

static void fill(struct hub *hub, const struct ring *ring, size_t n)
{
    uint32_t b = NONE;

    memset(hub->block_of, 0xff, n * sizeof *hub->block_of);
    for (uint32_t i = 0; i < ring->count; i++) {
        if (i % (BLOCK_ENTRIES / 2) == 0) {
            b = append_block(hub, b);
        }
        hub->blocks[b].at[hub->blocks[b].count++] = ring->at[i];
        hub->block_of[ring->at[i]] = b;
    }
}

void spherical_hub_make(struct spherical *s, struct ring *ring)
{
    struct hub *hub;

    if (ring->hub || !deserves(s, ring->count)) {
        return;
    }
    hub = srnf_alloc(1, sizeof *hub);
    if (!hub) {
        return;
    }
    hub->capacity = ring->count / (BLOCK_ENTRIES / 4) + 1;
    hub->block_of = srnf_alloc(s->n, sizeof *hub->block_of);
    hub->blocks = srnf_alloc(hub->capacity, sizeof *hub->blocks);
    hub->next = s->hubs;
    hub->link = &s->hubs;
    if (hub->next) {
        hub->next->link = &hub->next;
    }
    s->hubs = hub;
    if (!hub->block_of || !hub->blocks) {
        hub_free(hub);
        return;
    }
    fill(hub, ring, s->n);
    ring->hub = hub;
}

void spherical_hub_write(struct ring *ring)
{
    struct hub *hub = ring->hub;
    size_t written = 0;

    if (!hub->changed) {
        return;
    }
    for (uint32_t b = 0; b != NONE; b = hub->blocks[b].next) {
        memcpy(ring->at + written, hub->blocks[b].at, hub->blocks[b].count * sizeof *ring->at);
        written += hub->blocks[b].count;
    }
    hub->changed = false;
}

void spherical_hub_leave(struct ring *ring)
{
    if (ring->hub) {
        spherical_hub_write(ring);
        hub_free(ring->hub);
        ring->hub = NULL;
    }
}

bool spherical_hub_has(const struct hub *hub, uint32_t vertex)
{
    return hub->block_of[vertex] != NONE;
}

uint32_t spherical_hub_first(const struct hub *hub)
{
    uint32_t b = 0;

    while (hub->blocks[b].count == 0) {
        b = hub->blocks[b].next;
    }
    return hub->blocks[b].at[0];
}

/* The block of a neighbour, and where in it. */
static struct block *locate(struct hub *hub, uint32_t vertex, uint32_t *at)
{
    struct block *block = &hub->blocks[hub->block_of[vertex]];

    *at = spherical_entry(block->at, block->count, vertex);
    hub->changed = true;
    return block;
}

void spherical_hub_replace(struct hub *hub, uint32_t old, uint32_t vertex)
{
    uint32_t at;
    struct block *block = locate(hub, old, &at);

    block->at[at] = vertex;
    hub->block_of[vertex] = hub->block_of[old];
    hub->block_of[old] = NONE;
}

void spherical_hub_remove(struct spherical *s, struct ring *ring, uint32_t vertex)
{
    uint32_t at;
    struct block *block = locate(ring->hub, vertex, &at);

    block->count--;
    memmove(block->at + at, block->at + at + 1, (block->count - at) * sizeof *block->at);
    ring->hub->block_of[vertex] = NONE;
    ring->count--;
    if (!deserves(s, 2 * ring->count)) {
        spherical_hub_leave(ring);
    }
}

static int split(struct hub *hub, uint32_t full)
{
    uint32_t half = BLOCK_ENTRIES / 2, b;

    if (hub->used == hub->capacity) {
        struct block *blocks = srnf_alloc(2 * (size_t)hub->capacity, sizeof *blocks);

        if (!blocks) {
            return SRNF_ENOMEM;
        }
        memcpy(blocks, hub->blocks, hub->used * sizeof *blocks);
        srnf_free(hub->blocks);
        hub->blocks = blocks;
        hub->capacity *= 2;
    }
    b = append_block(hub, full);
    memcpy(hub->blocks[b].at, hub->blocks[full].at + half, half * sizeof *hub->blocks[b].at);
    hub->blocks[b].count = hub->blocks[full].count = half;
    for (uint32_t i = 0; i < half; i++) {
        hub->block_of[hub->blocks[b].at[i]] = b;
    }
    return SRNF_OK;
}

int spherical_hub_insert(struct hub *hub, uint32_t place, bool after, uint32_t vertex)
{
    struct block *block;
    uint32_t at;

    if (hub->blocks[hub->block_of[place]].count == BLOCK_ENTRIES &&
        split(hub, hub->block_of[place])) {
        return SRNF_ENOMEM;
    }
    block = locate(hub, place, &at);
    at += after;
    memmove(block->at + at + 1, block->at + at, (block->count - at) * sizeof *block->at);
    block->at[at] = vertex;
    block->count++;
    hub->block_of[vertex] = hub->block_of[place];
    return SRNF_OK;
}
