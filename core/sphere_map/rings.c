/*
 * rings.c - ordered neighbourhoods of the vertices of a closed, oriented, manifold mesh.
 *
 * Rings change all the time while vertices leave and return. They live in chunks of memory that are
 * only ever freed together; a ring that outgrows its place moves to one of twice the size, so that
 * all places a ring has ever had are together no larger than twice its last one. Rings of hubs
 * change elsewhere: hubs.c.
 */
#include "sphere_map.h"

#include <string.h>

#define CHUNK_ENTRIES ((size_t)1 << 16)
#define FIND_BLOCK ((uint32_t)32)

struct ring_chunk {
    struct ring_chunk *next;
    size_t used, capacity;
    uint32_t *entries;
};

void spherical_pool_clear(struct ring_pool *pool)
{
    while (pool->chunks) {
        struct ring_chunk *next = pool->chunks->next;

        srnf_free(pool->chunks->entries);
        srnf_free(pool->chunks);
        pool->chunks = next;
    }
}

static uint32_t *pool_take(struct ring_pool *pool, size_t count)
{
    struct ring_chunk *chunk = pool->chunks;

    if (!chunk || chunk->capacity - chunk->used < count) {
        chunk = srnf_alloc(1, sizeof *chunk);
        if (!chunk) {
            return NULL;
        }
        chunk->capacity = count > CHUNK_ENTRIES ? count : CHUNK_ENTRIES;
        chunk->entries = srnf_alloc(chunk->capacity, sizeof *chunk->entries);
        if (!chunk->entries) {
            srnf_free(chunk);
            return NULL;
        }
        chunk->next = pool->chunks;
        pool->chunks = chunk;
    }
    chunk->used += count;
    return chunk->entries + chunk->used - count;
}

/* Makes room for count neighbours, keeping what is there. */
static int reserve(struct spherical *s, struct ring *ring, uint32_t count)
{
    uint32_t capacity = ring->capacity ? ring->capacity : 4;
    uint32_t *at;

    if (count <= ring->capacity) {
        return SRNF_OK;
    }
    while (capacity < count) {
        capacity *= 2;
    }
    at = pool_take(&s->pool, capacity);
    if (!at) {
        return SRNF_ENOMEM;
    }
    if (ring->count > 0) {
        memcpy(at, ring->at, ring->count * sizeof *at);
    }
    ring->at = at;
    ring->capacity = capacity;
    return SRNF_OK;
}

uint32_t spherical_entry(const uint32_t *at, uint32_t count, uint32_t vertex)
{
    uint32_t i = 0;

    /* Block by block, without branches inside: some rings are long. */
    for (; i + FIND_BLOCK <= count; i += FIND_BLOCK) {
        uint32_t hits = 0;

        for (uint32_t k = 0; k < FIND_BLOCK; k++) {
            hits += at[i + k] == vertex;
        }
        if (hits > 0) {
            break;
        }
    }
    while (i < count && at[i] != vertex) {
        i++;
    }
    return i;
}

const uint32_t *spherical_ring_read(struct ring *ring)
{
    if (ring->hub) {
        spherical_hub_write(ring);
    }
    return ring->at;
}

bool spherical_ring_has(const struct ring *ring, uint32_t vertex)
{
    return ring->hub ? spherical_hub_has(ring->hub, vertex)
                     : spherical_entry(ring->at, ring->count, vertex) < ring->count;
}

uint32_t spherical_ring_first(const struct ring *ring)
{
    return ring->hub ? spherical_hub_first(ring->hub) : ring->at[0];
}

void spherical_ring_replace(struct spherical *s, struct ring *ring, uint32_t old, uint32_t vertex)
{
    spherical_hub_make(s, ring);
    if (ring->hub) {
        spherical_hub_replace(ring->hub, old, vertex);
    } else {
        ring->at[spherical_entry(ring->at, ring->count, old)] = vertex;
    }
}

void spherical_ring_remove(struct spherical *s, struct ring *ring, uint32_t vertex)
{
    uint32_t i;

    spherical_hub_make(s, ring);
    if (ring->hub) {
        spherical_hub_remove(s, ring, vertex);
        return;
    }
    i = spherical_entry(ring->at, ring->count, vertex);
    ring->count--;
    memmove(ring->at + i, ring->at + i + 1, (ring->count - i) * sizeof *ring->at);
}

int spherical_ring_insert(struct spherical *s, struct ring *ring, uint32_t place, bool after,
                          uint32_t vertex)
{
    if (reserve(s, ring, ring->count + 1)) {
        return SRNF_ENOMEM;
    }
    spherical_hub_make(s, ring);
    if (ring->hub) {
        if (spherical_hub_insert(ring->hub, place, after, vertex)) {
            return SRNF_ENOMEM;
        }
    } else {
        uint32_t i = spherical_entry(ring->at, ring->count, place) + after;

        memmove(ring->at + i + 1, ring->at + i, (ring->count - i) * sizeof *ring->at);
        ring->at[i] = vertex;
    }
    ring->count++;
    return SRNF_OK;
}

/* Corners sorted by vertex: corner 3 f + k of face f belongs to vertex faces[3 f + k]. */
static void sort_corners(const struct srnf_mesh *mesh, uint32_t *first, uint32_t *corners)
{
    size_t n = mesh->n_vertices;

    memset(first, 0, (n + 1) * sizeof *first);
    for (size_t i = 0; i < 3 * mesh->n_faces; i++) {
        first[mesh->faces[i] + 1]++;
    }
    for (size_t v = 0; v < n; v++) {
        first[v + 1] += first[v];
    }
    for (size_t i = 3 * mesh->n_faces; i-- > 0;) {
        uint32_t v = mesh->faces[i];

        /* first[v + 1] counts down from the end of v's range to its start and is put right below.
           */
        corners[--first[v + 1]] = (uint32_t)i;
    }
    for (size_t v = 0; v < n; v++) {
        first[v] = first[v + 1];
    }
    first[n] = (uint32_t)(3 * mesh->n_faces);
}

int spherical_rings_build(struct spherical *s)
{
    const struct srnf_mesh *mesh = s->mesh;
    int status = SRNF_ENOMEM;
    uint32_t *first = srnf_alloc(s->n + 1, sizeof *first);
    uint32_t *corners = srnf_alloc(3 * mesh->n_faces, sizeof *corners);
    uint32_t *next = srnf_alloc(s->n, sizeof *next);

    if (!first || !corners || !next) {
        goto out;
    }
    sort_corners(mesh, first, corners);
    for (uint32_t v = 0; v < s->n; v++) {
        struct ring *ring = &s->rings[v];
        uint32_t count = first[v + 1] - first[v];
        uint32_t a = 0;

        if (reserve(s, ring, count)) {
            goto out;
        }
        for (uint32_t i = first[v]; i < first[v + 1]; i++) {
            uint32_t corner = corners[i];
            uint32_t face = corner / 3 * 3;

            a = mesh->faces[face + (corner + 1 - face) % 3];
            next[a] = mesh->faces[face + (corner + 2 - face) % 3];
        }
        for (uint32_t i = 0; i < count; i++) {
            ring->at[i] = a;
            a = next[a];
        }
        ring->count = count;
        s->present[v] = true;
    }
    s->n_present = s->n;
    status = SRNF_OK;
out:
    srnf_free(first);
    srnf_free(corners);
    srnf_free(next);
    return status;
}
