/*
 * mean_checkpoint.c - a group mean between two iterations, as bytes.
 *
 * What a run needs to go on is the mean, the centring, and rotation and chain of each subject;
 * points, Jacobians and registered fields are replayed from them with the same bits. Layout, all
 * numbers little-endian, doubles as their IEEE 754 bits:
 *
 *   8 bytes      "srnfmean"
 *   u64          version of this layout
 *   u64          digest of what the run was started with: degree, grid, registration options, and
 *                subject and coefficients of every surface. When to stop (tolerance, number of
 *                iterations) is left out: a run may be resumed with a finer tolerance
 *   u64 x 3      n, n_theta, n_phi
 *   u64          iterations done, k
 *   u64          1: the subjects have been registered
 *   u64          1: their chains are in scratch (mean_spill.c)
 *   u64 x 4      1: no look is due any more (mean_anew.c); looks and joins that moved subjects, and
 *                iterations before the last of them (mean_visits.c)
 *   double[k][4] history: change, variance, objective, seconds
 *   double[3][n_theta][n_phi]  the mean
 *   chain        the centring
 *   double[m][3] the landmarks of the mean, where there are any
 *   n times      double[9] rotation, u64 links that tables carry points along, chain; or, of a
 *                chain in scratch, u64 number of its pieces and, for each, u64 x 3 offset, count of
 *                numbers and digest
 *   u64          FNV-1a of all bytes before it
 *
 * A chain is the u64 number of its links and, for each, u64 kind, u64 degree, and double[9] for a
 * rotation, double[2][(degree + 1)^2] otherwise.
 *
 * Reading trusts nothing: every count is checked against the bytes that are left before anything is
 * allocated for it.
 */
#include "mean.h"

#include <math.h>
#include <string.h>

#define VERSION 6
#define HEAD_BYTES ((size_t)14 * 8) /* with the sum at the end */
#define FNV_PRIME UINT64_C(1099511628211)

static const unsigned char magic[8] = {'s', 'r', 'n', 'f', 'm', 'e', 'a', 'n'};

static uint64_t hash_bytes(uint64_t hash, const unsigned char *bytes, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ bytes[i]) * FNV_PRIME;
    }
    return hash;
}

static uint64_t bits_of(double x)
{
    uint64_t bits;

    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Of all that the run was started with. */
static uint64_t digest(const struct mean_run *run)
{
    uint64_t hash =
        stats_series(run->work, STATS_STATE_MEAN, run->n, run->surfaces, &run->registration);

    for (size_t i = 0; i < run->n; i++) {
        hash = stats_hash(hash, run->owners.of[i]);
    }
    return mean_hash_landmarks(run, stats_hash(hash, run->registered));
}

/* ---- Writing --------------------------------------------------------------------------------- */

static void put_u64(struct mean_bytes *bytes, uint64_t x)
{
    for (unsigned shift = 0; shift < 64; shift += 8) {
        bytes->data[bytes->size++] = (unsigned char)(x >> shift);
    }
}

static void put_doubles(struct mean_bytes *bytes, size_t n, const double *x)
{
    for (size_t i = 0; i < n; i++) {
        put_u64(bytes, bits_of(x[i]));
    }
}

static void put_chain(struct mean_bytes *bytes, const struct srnf_warp *warp)
{
    put_u64(bytes, warp->n_links);
    for (size_t k = 0; k < warp->n_links; k++) {
        const struct srnf_warp_link *link = &warp->links[k];

        put_u64(bytes, (uint64_t)link->kind);
        put_u64(bytes, link->kind == SRNF_WARP_ROTATION ? 0 : link->degree);
        put_doubles(bytes, mean_link_values(link), link->values);
    }
}

/* Both in words of eight bytes. */
static size_t chain_words(const struct srnf_warp *warp)
{
    size_t words = 1;

    for (size_t k = 0; k < warp->n_links; k++) {
        words += 2 + mean_link_values(&warp->links[k]);
    }
    return words;
}

static void put_pieces(struct mean_bytes *bytes, const struct mean_subject *subject)
{
    put_u64(bytes, subject->n_pieces);
    for (size_t k = 0; k < subject->n_pieces; k++) {
        put_u64(bytes, subject->pieces[k].offset);
        put_u64(bytes, subject->pieces[k].count);
        put_u64(bytes, subject->pieces[k].digest);
    }
}

/* Numbers of the landmarks of the mean. */
static size_t count_marks(const struct mean_run *run)
{
    return run->landmarks ? 3 * run->landmarks->n : 0;
}

static size_t words_needed(const struct mean_run *run)
{
    size_t words = HEAD_BYTES / 8 + 4 * run->iterations + 3 * run->points;

    words += chain_words(&run->centring) + count_marks(run);
    for (size_t i = 0; i < run->n; i++) {
        const struct mean_subject *subject = &run->subjects[i];

        words += 10 + (run->spill ? 1 + 3 * subject->n_pieces : chain_words(&subject->warp));
    }
    return words;
}

int mean_checkpoint_write(const struct mean_run *run, struct mean_bytes *bytes)
{
    bytes->size = 0;
    bytes->data = srnf_alloc(words_needed(run), 8);
    if (!bytes->data) {
        return SRNF_ENOMEM;
    }
    memcpy(bytes->data, magic, sizeof magic);
    bytes->size = sizeof magic;
    put_u64(bytes, VERSION);
    put_u64(bytes, digest(run));
    put_u64(bytes, run->n);
    put_u64(bytes, run->grid->n_theta);
    put_u64(bytes, run->grid->n_phi);
    put_u64(bytes, run->iterations);
    put_u64(bytes, run->started);
    put_u64(bytes, run->spill != NULL);
    put_u64(bytes, run->settled);
    put_u64(bytes, run->looks);
    put_u64(bytes, run->joins);
    put_u64(bytes, run->anew);
    for (size_t k = 0; k < run->iterations; k++) {
        put_u64(bytes, bits_of(run->history[k].change));
        put_u64(bytes, bits_of(run->history[k].variance));
        put_u64(bytes, bits_of(run->history[k].objective));
        put_u64(bytes, bits_of(run->history[k].seconds));
    }
    put_doubles(bytes, 3 * run->points, run->mean_q);
    put_chain(bytes, &run->centring);
    put_doubles(bytes, count_marks(run), run->marks);
    for (size_t i = 0; i < run->n; i++) {
        put_doubles(bytes, 9, run->subjects[i].at.rotation);
        put_u64(bytes, run->subjects[i].tabulated);
        if (run->spill) {
            put_pieces(bytes, &run->subjects[i]);
        } else {
            put_chain(bytes, &run->subjects[i].warp);
        }
    }
    put_u64(bytes, hash_bytes(STATS_HASH_START, bytes->data, bytes->size));
    return SRNF_OK;
}

/* ---- Reading --------------------------------------------------------------------------------- */

struct reader {
    const unsigned char *next;
    size_t words; /* left */
    bool good;    /* false: more was asked for than there is, or a number is not finite */
};

static uint64_t get_u64(struct reader *reader)
{
    uint64_t x = 0;

    if (reader->words == 0) {
        reader->good = false;
        return 0;
    }
    for (unsigned i = 0; i < 8; i++) {
        x |= (uint64_t)reader->next[i] << (8 * i);
    }
    reader->next += 8;
    reader->words--;
    return x;
}

static double get_double(struct reader *reader)
{
    uint64_t bits = get_u64(reader);
    double x;

    memcpy(&x, &bits, sizeof x);
    reader->good = reader->good && isfinite(x);
    return x;
}

static void get_doubles(struct reader *reader, size_t n, double *out)
{
    for (size_t i = 0; i < n; i++) {
        out[i] = get_double(reader);
    }
}

static int read_link(struct reader *reader, struct srnf_warp_link *link)
{
    uint64_t kind = get_u64(reader);
    uint64_t degree = get_u64(reader);
    size_t count;

    if (!reader->good || kind > SRNF_WARP_EXP_INVERSE || degree > MEAN_LINK_DEGREE_MAX) {
        return SRNF_EINVAL;
    }
    link->kind = (enum srnf_warp_kind)kind;
    link->degree = (size_t)degree;
    count = mean_link_values(link);
    if (count > reader->words) {
        return SRNF_EINVAL;
    }
    link->values = srnf_alloc(count, sizeof(double));
    if (!link->values) {
        return SRNF_ENOMEM;
    }
    get_doubles(reader, count, link->values);
    return reader->good ? SRNF_OK : SRNF_EINVAL;
}

static int read_chain(struct reader *reader, struct srnf_warp *warp)
{
    uint64_t links = get_u64(reader);

    if (!reader->good || links > reader->words / 2) {
        return SRNF_EINVAL;
    }
    if (links == 0) {
        return SRNF_OK;
    }
    warp->links = srnf_alloc((size_t)links, sizeof *warp->links);
    if (!warp->links) {
        return SRNF_ENOMEM;
    }
    warp->capacity = (size_t)links;
    while (warp->n_links < links) {
        /* Counted first: a link that fails may hold values. */
        int status = read_link(reader, &warp->links[warp->n_links++]);

        if (status) {
            return status;
        }
    }
    return SRNF_OK;
}

/* How many links they are is not known before they are read. */
static int read_pieces(struct reader *reader, const struct mean_run *run,
                       struct mean_subject *subject)
{
    uint64_t pieces = get_u64(reader);

    if (!reader->good || pieces > reader->words / 3) {
        return SRNF_EINVAL;
    }
    for (uint64_t k = 0; k < pieces; k++) {
        struct mean_piece piece;

        piece.offset = get_u64(reader);
        piece.count = get_u64(reader);
        piece.digest = get_u64(reader);
        if (!mean_piece_is_there(run, &piece)) {
            return SRNF_EINVAL;
        }
        if (mean_pieces_add(subject, &piece)) {
            return SRNF_ENOMEM;
        }
    }
    return SRNF_OK;
}

static int read_subject(struct reader *reader, const struct mean_run *run,
                        struct mean_subject *subject)
{
    const struct srnf_warp *warp = &subject->warp;
    uint64_t tabulated;
    int status;

    get_doubles(reader, 9, subject->at.rotation);
    tabulated = get_u64(reader);
    if (run->spill) { /* mean_replay compares the two */
        subject->tabulated = (size_t)tabulated;
        return read_pieces(reader, run, subject);
    }
    status = read_chain(reader, &subject->warp);
    if (status == SRNF_OK && tabulated > warp->n_links) {
        status = SRNF_EINVAL;
    }
    subject->tabulated = status ? 0 : (size_t)tabulated;
    for (size_t k = 0; k < subject->tabulated; k++) {
        if (warp->links[k].kind != SRNF_WARP_ROTATION && warp->links[k].kind != SRNF_WARP_EXP) {
            status = SRNF_EINVAL;
        }
    }
    return status;
}

/* Why these cannot be the bytes of this run, or NULL. */
static const char *refuse(const struct mean_run *run, const unsigned char *bytes, size_t size,
                          struct reader *reader)
{
    struct reader sum = {NULL, 1, true};

    if (size < HEAD_BYTES || size % 8 != 0 || memcmp(bytes, magic, sizeof magic) != 0) {
        return "are not a checkpoint of a mean";
    }
    sum.next = bytes + size - 8;
    if (get_u64(&sum) != hash_bytes(STATS_HASH_START, bytes, size - 8)) {
        return "are damaged";
    }
    *reader = (struct reader){bytes + sizeof magic, size / 8 - 2, true};
    if (get_u64(reader) != VERSION) {
        return "are of another version";
    }
    if (get_u64(reader) != digest(run) || get_u64(reader) != run->n ||
        get_u64(reader) != run->grid->n_theta || get_u64(reader) != run->grid->n_phi) {
        return "belong to other surfaces or options";
    }
    return NULL;
}

static bool are_units(const struct mean_run *run)
{
    for (size_t k = 0; k < count_marks(run); k += 3) {
        if (!(fabs(vector_dot(run->marks + k, run->marks + k) - 1.0) < 1e-6)) {
            return false;
        }
    }
    return true;
}

int mean_checkpoint_read(struct mean_run *run, const void *bytes, size_t size,
                         struct srnf_error *error)
{
    struct reader reader;
    const char *why = refuse(run, bytes, size, &reader);
    uint64_t iterations;
    uint64_t started;
    uint64_t spilled;
    uint64_t settled;
    int status;

    if (why) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the bytes to resume from %s", why);
    }
    iterations = get_u64(&reader);
    started = get_u64(&reader);
    spilled = get_u64(&reader);
    settled = get_u64(&reader);
    run->looks = (size_t)get_u64(&reader);
    run->joins = (size_t)get_u64(&reader);
    run->anew = (size_t)get_u64(&reader);
    if (spilled != (run->spill != NULL)) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the bytes to resume from have their chains elsewhere");
    }
    if (settled > 1 || started != (run->registered && iterations > 0) || run->anew > iterations ||
        run->looks > run->anew || run->joins > run->anew ||
        (run->looks == 0 && run->joins == 0) != (run->anew == 0)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the bytes to resume from contradict themselves");
    }
    run->started = started == 1;
    run->settled = settled == 1;
    if (iterations > reader.words / 4 || iterations > run->history_capacity) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "the bytes to resume from have more iterations than are allowed");
    }
    run->iterations = (size_t)iterations;
    for (size_t k = 0; k < run->iterations; k++) {
        run->history[k].change = get_double(&reader);
        run->history[k].variance = get_double(&reader);
        run->history[k].objective = get_double(&reader);
        run->history[k].seconds = get_double(&reader);
    }
    get_doubles(&reader, 3 * run->points, run->mean_q);
    status = read_chain(&reader, &run->centring);
    get_doubles(&reader, count_marks(run), run->marks);
    if (status == SRNF_OK && !are_units(run)) {
        status = SRNF_EINVAL;
    }
    for (size_t i = 0; i < run->n && status == SRNF_OK; i++) {
        status = read_subject(&reader, run, &run->subjects[i]);
    }
    if (status == SRNF_OK && (!reader.good || reader.words > 0)) {
        status = SRNF_EINVAL;
    }
    if (status == SRNF_EINVAL) {
        (void)srnf_fail(error, status, -1, "the bytes to resume from do not hold what they say");
    }
    return status;
}
