/*
 * collapse.c - the mesh down to a tetrahedron, one vertex at a time.
 *
 * v collapses into its neighbour u where the cost is least:
 *
 *   cost = (quadric error at u of Q_u + Q_v + quality A |uv|^2 shape) (1 + max(0, valence - 9) / 2)
 *
 * Q: area-weighted quadrics (M. Garland, P. Heckbert, SIGGRAPH 1997); A: area of v's ring; shape:
 * mean of the worst and the mean over the new triangles of (sum of squared edges) / (4 sqrt 3
 * area), four times as much where a triangle turns over; valence: of u afterwards. The one hard
 * rule is the link condition: u and v have just two common neighbours. Above valence 32 nothing is
 * evaluated and the cost is the largest finite one, so that a hub costs no more than its ring.
 * Vertices wait in a heap by (cost, index). After a collapse u and v's ring are evaluated at once,
 * u's other neighbours when they come up.
 *
 * Since shape >= 1, the first two terms without it bound the cost from below: most candidates never
 * get to it.
 */
#include "sphere_map.h"

#include <string.h>

#define VALENCE_FREE 9.0
#define VALENCE_SLOPE 0.5
#define VALENCE_MAX ((uint32_t)32)
#define COST_UNDEFINED 1e300
#define COST_LAST 1e305
#define COST_NEVER INFINITY
#define REVERSED 4.0
#define QUADRIC 10

struct collapse {
    struct spherical *s;
    double *quadrics; /* [n][QUADRIC] */
    double *cost;     /* [n] */
    uint32_t *target; /* [n] neighbour to collapse into */
    uint32_t *heap;   /* [heap_size] vertices */
    uint32_t *place;  /* [n] in the heap */
    size_t heap_size;
    bool *stale; /* [n] to be evaluated anew before use */
};

/* ---- Heap by (cost, index) ------------------------------------------------------------------- */

static bool before(const struct collapse *c, uint32_t a, uint32_t b)
{
    return c->cost[a] < c->cost[b] || (!(c->cost[b] < c->cost[a]) && a < b);
}

static void heap_put(struct collapse *c, size_t i, uint32_t v)
{
    c->heap[i] = v;
    c->place[v] = (uint32_t)i;
}

static void heap_sift(struct collapse *c, uint32_t v)
{
    size_t i = c->place[v];

    while (i > 0 && before(c, v, c->heap[(i - 1) / 2])) {
        heap_put(c, i, c->heap[(i - 1) / 2]);
        i = (i - 1) / 2;
    }
    for (;;) {
        size_t child = 2 * i + 1;

        if (child + 1 < c->heap_size && before(c, c->heap[child + 1], c->heap[child])) {
            child++;
        }
        if (child >= c->heap_size || !before(c, c->heap[child], v)) {
            break;
        }
        heap_put(c, i, c->heap[child]);
        i = child;
    }
    heap_put(c, i, v);
}

static void heap_remove_top(struct collapse *c)
{
    uint32_t last = c->heap[--c->heap_size];

    if (c->heap_size > 0) {
        heap_put(c, 0, last);
        heap_sift(c, last);
    }
}

/* ---- Costs -------------------------------------------------------------------------------------
   */

static const double *position(const struct collapse *c, uint32_t v)
{
    return c->s->positions + 3 * (size_t)v;
}

/* Twice the area times the unit normal. */
static void face_normal(const struct collapse *c, uint32_t i, uint32_t j, uint32_t k, double n[3])
{
    double a[3];
    double b[3];

    vector_subtract(position(c, j), position(c, i), a);
    vector_subtract(position(c, k), position(c, i), b);
    vector_cross(a, b, n);
}

static void add_quadric(double *q, const double n[3], const double *x)
{
    double length = vector_norm(n);
    double d = -vector_dot(n, x);
    double scale = length > 0.0 ? 0.5 / length : 0.0; /* area / |n|^2 */

    q[0] += scale * n[0] * n[0];
    q[1] += scale * n[0] * n[1];
    q[2] += scale * n[0] * n[2];
    q[3] += scale * n[1] * n[1];
    q[4] += scale * n[1] * n[2];
    q[5] += scale * n[2] * n[2];
    q[6] += scale * n[0] * d;
    q[7] += scale * n[1] * d;
    q[8] += scale * n[2] * d;
    q[9] += scale * d * d;
}

static double quadric_error(const double *a, const double *b, const double *x)
{
    double q[QUADRIC];
    double error;

    for (size_t i = 0; i < QUADRIC; i++) {
        q[i] = a[i] + b[i];
    }
    error = x[0] * (q[0] * x[0] + 2.0 * (q[1] * x[1] + q[2] * x[2] + q[6])) +
            x[1] * (q[3] * x[1] + 2.0 * (q[4] * x[2] + q[7])) + x[2] * (q[5] * x[2] + 2.0 * q[8]) +
            q[9];
    return larger(0.0, error);
}

static double squared_length(const struct collapse *c, uint32_t a, uint32_t b)
{
    double d[3];

    vector_subtract(position(c, a), position(c, b), d);
    return vector_dot(d, d);
}

/* Shape of a triangle with the sum of squared edges `sum`, the longest squared edge `longest` and
   twice the area `doubled`: 1 for an equilateral one, never infinite. What is narrower than the
   robust metric (metric.c) can tell counts as its narrowest, what is smaller as
   equilateral: a vertex that lies on its neighbour, or nearly so, must not be the dearest to
   collapse where it should be the cheapest. */
static double triangle_shape(const struct spherical *s, double sum, double longest, double doubled)
{
    if (!(longest >= s->floor_edge * s->floor_edge)) {
        return 1.0;
    }
    return sum / (2.0 * sqrt(3.0) * larger(doubled, s->sliver * longest));
}

/* Mean of worst and mean shape of the triangles that the collapse of v into its k-th neighbour
   makes. */
static double new_shape(const struct collapse *c, uint32_t v, uint32_t k)
{
    const struct ring *ring = &c->s->rings[v];
    uint32_t u = ring->at[k];
    double worst = 0.0;
    double sum = 0.0;
    bool reversed = false;

    for (uint32_t i = 1; i + 1 < ring->count; i++) {
        uint32_t a = spherical_ring_get(ring, k + i);
        uint32_t b = spherical_ring_get(ring, k + i + 1);
        double edges[3] = {squared_length(c, u, a), squared_length(c, u, b),
                           squared_length(c, a, b)};
        double now[3];
        double then[3];
        double shape;

        face_normal(c, u, a, b, now);
        face_normal(c, v, a, b, then);
        shape = triangle_shape(c->s, edges[0] + edges[1] + edges[2],
                               larger(edges[0], larger(edges[1], edges[2])), vector_norm(now));
        reversed = reversed || vector_dot(now, then) < 0.0;
        worst = larger(worst, shape);
        sum += shape;
    }
    return (reversed ? REVERSED : 1.0) * 0.5 * (worst + sum / (double)(ring->count - 2));
}

static bool adjacent(const struct spherical *s, uint32_t a, uint32_t b)
{
    if (s->rings[a].count > s->rings[b].count) {
        uint32_t swap = a;

        a = b;
        b = swap;
    }
    return spherical_ring_has(&s->rings[a], b);
}

/* Have v and its k-th neighbour just two common neighbours? */
static bool link_condition(const struct spherical *s, uint32_t v, uint32_t k)
{
    const struct ring *ring = &s->rings[v];

    for (uint32_t i = 2; i + 1 < ring->count; i++) {
        if (adjacent(s, spherical_ring_get(ring, k + i), ring->at[k])) {
            return false;
        }
    }
    return true;
}

static double ring_area(const struct collapse *c, uint32_t v)
{
    const struct ring *ring = &c->s->rings[v];
    double sum = 0.0;

    for (uint32_t i = 0; i < ring->count; i++) {
        double n[3];

        face_normal(c, v, ring->at[i], spherical_ring_get(ring, i + 1), n);
        sum += 0.5 * vector_norm(n);
    }
    return sum;
}

/* Cost of v into its k-th neighbour, or something at least `limit` once it is known to be that
   much. */
static double candidate_cost(const struct collapse *c, uint32_t v, uint32_t k, double area,
                             double limit)
{
    const struct spherical *s = c->s;
    uint32_t u = s->rings[v].at[k];
    uint32_t valence = s->rings[u].count + s->rings[v].count - 4;
    double error = quadric_error(c->quadrics + QUADRIC * (size_t)u,
                                 c->quadrics + QUADRIC * (size_t)v, position(c, u));
    double length = s->quality * area * squared_length(c, u, v);
    double factor = 1.0 + VALENCE_SLOPE * larger(0.0, (double)valence - VALENCE_FREE);
    double cost;

    if ((error + length) * factor >= limit || !link_condition(s, v, k)) {
        return COST_NEVER;
    }
    cost = (error + length * new_shape(c, v, k)) * factor;
    return isfinite(cost) ? smaller(cost, COST_UNDEFINED) : COST_UNDEFINED;
}

static void evaluate(struct collapse *c, uint32_t v)
{
    const struct spherical *s = c->s;
    const struct ring *ring = &s->rings[v];
    double best = COST_NEVER;
    uint32_t target = spherical_ring_first(ring);
    bool last = false;
    double area;

    c->stale[v] = false;
    if (ring->count > VALENCE_MAX) {
        c->cost[v] = COST_LAST;
        c->target[v] = target;
        return;
    }
    area = ring_area(c, v);
    for (uint32_t k = 0; k < ring->count; k++) {
        double cost;

        if (s->rings[ring->at[k]].count + ring->count - 4 > VALENCE_MAX) {
            last = true;
            continue;
        }
        cost = candidate_cost(c, v, k, area, best);
        if (cost < best) {
            best = cost;
            target = ring->at[k];
        }
    }
    c->cost[v] = best < COST_NEVER || !last ? best : COST_LAST;
    c->target[v] = target;
}

/* ---- The collapse ---------------------------------------------------------------------------- */

static int record_collapse(struct spherical *s, uint32_t v, uint32_t k)
{
    const struct ring *ring = &s->rings[v];
    size_t need = s->record_size + ring->count + 3;

    if (need > s->record_capacity) {
        size_t capacity = 2 * need + 1024;
        uint32_t *record = srnf_alloc(capacity, sizeof *record);

        if (!record) {
            return SRNF_ENOMEM;
        }
        if (s->record) {
            memcpy(record, s->record, s->record_size * sizeof *record);
        }
        srnf_free(s->record);
        s->record = record;
        s->record_capacity = capacity;
    }
    /* Read from its end: v, the length of its ring, and the ring from u on. */
    for (uint32_t i = 0; i < ring->count; i++) {
        s->record[s->record_size++] = spherical_ring_get(ring, k + i);
    }
    s->record[s->record_size++] = ring->count;
    s->record[s->record_size++] = v;
    return SRNF_OK;
}

/* Takes v out of the mesh; its neighbours turn to u = at[k]. */
static int collapse_into(struct spherical *s, uint32_t v, uint32_t k)
{
    struct ring *ring = &s->rings[v];
    uint32_t u = ring->at[k];
    struct ring *wide = &s->rings[u];

    /* In u's ring v gives way to the neighbours of v between the two common ones. */
    for (uint32_t i = 2; i + 1 < ring->count; i++) {
        uint32_t w = spherical_ring_get(ring, k + i);

        if (i == 2) {
            spherical_ring_replace(s, wide, v, w);
        } else if (spherical_ring_insert(s, wide, spherical_ring_get(ring, k + i - 1), true, w)) {
            return SRNF_ENOMEM;
        }
        spherical_ring_replace(s, &s->rings[w], v, u);
    }
    if (ring->count == 3) {
        spherical_ring_remove(s, wide, v);
    }
    spherical_ring_remove(s, &s->rings[spherical_ring_get(ring, k + 1)], v);
    spherical_ring_remove(s, &s->rings[spherical_ring_get(ring, k + ring->count - 1)], v);
    spherical_hub_leave(ring);
    s->present[v] = false;
    s->n_present--;
    return SRNF_OK;
}

static void refresh(struct collapse *c, uint32_t v)
{
    evaluate(c, v);
    heap_sift(c, v);
}

/* Costs after v has gone into u: u and v's ring now, u's other neighbours when they come up. */
static void refresh_around(struct collapse *c, uint32_t v, uint32_t u)
{
    const struct ring *ring = &c->s->rings[v];
    const struct ring *wide = &c->s->rings[u];

    if (wide->count <= VALENCE_MAX) {
        for (uint32_t i = 0; i < wide->count; i++) {
            c->stale[wide->at[i]] = true;
        }
    }
    for (uint32_t i = 0; i < ring->count; i++) {
        refresh(c, ring->at[i]);
    }
}

/* For a vertex whose cost is COST_LAST: any neighbour that the link condition allows. */
static bool find_any_target(struct collapse *c, uint32_t v, uint32_t *k)
{
    for (*k = 0; *k < c->s->rings[v].count; (*k)++) {
        if (link_condition(c->s, v, *k)) {
            return true;
        }
    }
    return false;
}

static int collapse_top(struct collapse *c)
{
    struct spherical *s = c->s;
    uint32_t v = c->heap[0];
    uint32_t k;
    uint32_t u;

    if (c->stale[v]) {
        refresh(c, v);
        return SRNF_OK;
    }
    k = spherical_entry(spherical_ring_read(&s->rings[v]), s->rings[v].count, c->target[v]);
    if (!(c->cost[v] < COST_NEVER) || k == s->rings[v].count) {
        return SRNF_ENUMERIC; /* no vertex can go: not a closed surface of genus zero */
    }
    if ((c->cost[v] >= COST_LAST || !link_condition(s, v, k)) && !find_any_target(c, v, &k)) {
        c->cost[v] = COST_NEVER;
        heap_sift(c, v);
        return SRNF_OK;
    }
    u = s->rings[v].at[k];
    if (record_collapse(s, v, k) || collapse_into(s, v, k)) {
        return SRNF_ENOMEM;
    }
    for (size_t i = 0; i < QUADRIC; i++) {
        c->quadrics[QUADRIC * (size_t)u + i] += c->quadrics[QUADRIC * (size_t)v + i];
    }
    heap_remove_top(c);
    refresh_around(c, v, u);
    return SRNF_OK;
}

static void start(struct collapse *c)
{
    const struct spherical *s = c->s;

    for (size_t f = 0; f < s->mesh->n_faces; f++) {
        const uint32_t *face = s->mesh->faces + 3 * f;
        double n[3];

        face_normal(c, face[0], face[1], face[2], n);
        for (size_t k = 0; k < 3; k++) {
            add_quadric(c->quadrics + QUADRIC * (size_t)face[k], n, position(c, face[0]));
        }
    }
    c->heap_size = s->n;
    for (uint32_t v = 0; v < s->n; v++) {
        evaluate(c, v);
        heap_put(c, v, v);
    }
    for (size_t i = s->n / 2; i-- > 0;) {
        heap_sift(c, c->heap[i]);
    }
}

int spherical_collapse(struct spherical *s)
{
    struct collapse c = {.s = s};
    int status = SRNF_ENOMEM;
    size_t steps = 0;

    c.quadrics = srnf_alloc(s->n * QUADRIC, sizeof(double));
    c.cost = srnf_alloc(s->n, sizeof(double));
    c.target = srnf_alloc(s->n, sizeof(uint32_t));
    c.heap = srnf_alloc(s->n, sizeof(uint32_t));
    c.place = srnf_alloc(s->n, sizeof(uint32_t));
    c.stale = srnf_alloc(s->n, sizeof(bool));
    if (!c.quadrics || !c.cost || !c.target || !c.heap || !c.place || !c.stale) {
        goto out;
    }
    start(&c);
    status = SRNF_OK;
    while (status == SRNF_OK && s->n_present > 4) {
        status = collapse_top(&c);
        if (++steps % 1024 == 0 && srnf_is_canceled(s->context)) {
            status = SRNF_ECANCELED;
        }
    }
out:
    srnf_free(c.quadrics);
    srnf_free(c.cost);
    srnf_free(c.target);
    srnf_free(c.heap);
    srnf_free(c.place);
    srnf_free(c.stale);
    return status;
}
