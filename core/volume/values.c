/*
 * values.c - voxels in any type into labels: the values that occur, counted, and for each voxel
 * which of them it has.
 *
 * A label is a whole number; a float that is no more than INTEGRAL from one counts as one, since
 * scaling rounds; but a scale does not make one label of two integers, nor 0 of another value. The
 * table has SRNF_VOLUME_LABELS_MAX places: an image of grey values soon has
 * more and is refused, before it is read to its end.
 */
#include "volume.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define INTEGRAL 1e-4
#define VALUE_MAX (((int64_t)1 << 53) - 1) /* beyond it two whole numbers may be one double */
#define WAY_OUT "send the segmentation made from it, or the image as 0 and 1 by a threshold"

int volume_expect(struct volume_reader *reader, const int64_t sizes[3], size_t least)
{
    uint64_t most = volume_source_most(&reader->source), count = 1;

    for (size_t k = 0; k < 3; k++) {
        if (sizes[k] < 1) {
            return srnf_fail(
                reader->error, SRNF_EPARSE, -1,
                "the header says %lld voxels along axis %zu; there must be one at least",
                (long long)sizes[k], k);
        }
        if ((uint64_t)sizes[k] > reader->limits.max_voxels / count) {
            return srnf_fail(reader->error, SRNF_ELIMIT, -1,
                             "the header promises %lld x %lld x %lld voxels; at most %zu are "
                             "taken: crop the volume to the structure",
                             (long long)sizes[0], (long long)sizes[1], (long long)sizes[2],
                             reader->limits.max_voxels);
        }
        count *= (uint64_t)sizes[k];
        reader->volume.shape[k] = (size_t)sizes[k];
    }
    if (count > most / least) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)reader->size,
                         "the header promises %llu voxels of %zu bytes, and the file is too short "
                         "for them: it was cut off, or its header is wrong",
                         (unsigned long long)count, least);
    }
    if (count > reader->limits.max_memory / sizeof(uint16_t)) {
        return srnf_fail(reader->error, SRNF_ELIMIT, -1,
                         "%llu voxels take more than the %zu bytes of memory that are allowed",
                         (unsigned long long)count, reader->limits.max_memory);
    }
    reader->n_voxels = (size_t)count;
    reader->volume.voxels = srnf_alloc(reader->n_voxels, sizeof(uint16_t));
    reader->values = srnf_alloc(1, sizeof *reader->values);
    return reader->volume.voxels && reader->values
               ? SRNF_OK
               : srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory for %zu voxels",
                           reader->n_voxels);
}

/* ---- Values ---------------------------------------------------------------------------------- */

/* The place of a value among those that were met; SRNF_EPARSE where there are too many. */
static int place_of(struct volume_reader *reader, int64_t value, size_t *place)
{
    struct volume_values *table = reader->values;
    uint64_t hash = (uint64_t)value * UINT64_C(0x9e3779b97f4a7c15);
    size_t slot = (size_t)(hash >> 40) % VOLUME_HASH_SIZE;

    if (table->count > 0 && table->values[table->last] == value) {
        *place = table->last;
        return SRNF_OK;
    }
    while (table->slots[slot] && table->values[table->slots[slot] - 1] != value) {
        slot = (slot + 1) % VOLUME_HASH_SIZE;
    }
    if (!table->slots[slot]) {
        if (table->count > SRNF_VOLUME_LABELS_MAX) {
            return srnf_fail(
                reader->error, SRNF_EPARSE, (int64_t)reader->filled,
                "it has more than %d different values: an image and no segmentation; " WAY_OUT,
                SRNF_VOLUME_LABELS_MAX);
        }
        table->values[table->count++] = value;
        table->slots[slot] = (uint16_t)table->count;
    }
    *place = table->last = (size_t)table->slots[slot] - 1;
    return SRNF_OK;
}

static int refuse_value(struct volume_reader *reader, double value)
{
    size_t n = reader->filled, i = n % reader->volume.shape[0];
    size_t j = n / reader->volume.shape[0] % reader->volume.shape[1];
    size_t k = n / reader->volume.shape[0] / reader->volume.shape[1];

    return srnf_fail(
        reader->error, SRNF_EPARSE, (int64_t)n,
        "voxel (%zu, %zu, %zu) is %g, which is no label: labels are whole numbers up to "
        "2^53 - 1; " WAY_OUT,
        i, j, k, value);
}

static int add_label(struct volume_reader *reader, int64_t value)
{
    size_t place = 0;
    int status = place_of(reader, value, &place);

    if (status == SRNF_OK) {
        reader->volume.voxels[reader->filled++] = (uint16_t)place;
        reader->values->counts[place]++;
    }
    return status;
}

int volume_add_voxel(struct volume_reader *reader, double value)
{
    double whole, near = INTEGRAL;

    if (reader->scaled) {
        double scaled = value * reader->slope;

        if (fabs(value) > INTEGRAL && !(fabs(scaled) > INTEGRAL)) {
            return refuse_value(reader, scaled);
        }
        near = fmin(near, 0.25 * fabs(reader->slope));
        value = scaled + reader->intercept;
    }
    whole = nearbyint(value);
    if (!(fabs(value - whole) <= near) || !(fabs(whole) <= (double)VALUE_MAX)) {
        return refuse_value(reader, value);
    }
    return add_label(reader, (int64_t)whole);
}

/* ---- From bytes ------------------------------------------------------------------------------ */

/* A voxel of an integer type, judged before it is a double. */
static int add_integer(struct volume_reader *reader, const unsigned char *bytes)
{
    int64_t value = 0;

    (void)scalar_index(reader->type, bytes, reader->big_endian, &value);
    if (value > VALUE_MAX || value < -VALUE_MAX) {
        return refuse_value(reader, scalar_value(reader->type, bytes, reader->big_endian));
    }
    return reader->scaled ? volume_add_voxel(reader, (double)value) : add_label(reader, value);
}

static int add_piece(struct volume_reader *reader, const unsigned char *bytes, size_t count)
{
    size_t size = scalar_size(reader->type);
    bool real = reader->type == SCALAR_FLOAT32 || reader->type == SCALAR_FLOAT64;
    int status = SRNF_OK;

    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        const unsigned char *at = bytes + i * size;

        status = real ? volume_add_voxel(reader, scalar_value(reader->type, at, reader->big_endian))
                      : add_integer(reader, at);
    }
    return status;
}

int volume_read_voxels(struct volume_reader *reader)
{
    size_t size = scalar_size(reader->type), most = VOLUME_PIECE / size;
    unsigned char *piece = srnf_alloc(VOLUME_PIECE, 1);
    int status = piece ? SRNF_OK : srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory");

    while (status == SRNF_OK && reader->filled < reader->n_voxels) {
        size_t left = reader->n_voxels - reader->filled, got = 0;
        size_t count = left < most ? left : most;

        status = volume_source_read(reader, piece, count * size, &got);
        if (status == SRNF_OK && got < count * size) {
            status = srnf_fail(reader->error, SRNF_EPARSE, (int64_t)(reader->filled + got / size),
                               "the file ends after voxel %zu of %zu", reader->filled + got / size,
                               reader->n_voxels);
        }
        if (status == SRNF_OK) {
            status = add_piece(reader, piece, count);
        }
    }
    srnf_free(piece);
    return status;
}

/* ---- The end --------------------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    const struct srnf_label *x = a, *y = b;

    return (x->value > y->value) - (x->value < y->value);
}

/* The names that the header has for some values. */
static void name_labels(struct volume_reader *reader)
{
    struct srnf_volume *volume = &reader->volume;

    for (size_t i = 0; i < volume->n_labels; i++) {
        for (size_t n = 0; n < reader->n_names; n++) {
            if (reader->names[n].value == volume->labels[i].value) {
                memcpy(volume->labels[i].name, reader->names[n].name, SRNF_LABEL_NAME_MAX);
            }
        }
    }
}

/* The number of each place: that of its value among the labels, 0 for the value 0. */
static void number_places(const struct volume_reader *reader, uint16_t *numbers)
{
    const struct srnf_volume *volume = &reader->volume;

    for (size_t place = 0; place < reader->values->count; place++) {
        const struct srnf_label key = {.value = reader->values->values[place]};
        const struct srnf_label *found =
            bsearch(&key, volume->labels, volume->n_labels, sizeof key, by_value);

        numbers[place] = found ? (uint16_t)(found - volume->labels + 1) : 0;
    }
}

int volume_finish(struct volume_reader *reader)
{
    struct srnf_volume *volume = &reader->volume;
    const struct volume_values *table = reader->values;
    uint16_t numbers[SRNF_VOLUME_LABELS_MAX + 1];

    volume->labels = srnf_alloc(table->count + 1, sizeof *volume->labels);
    if (!volume->labels) {
        return srnf_fail(reader->error, SRNF_ENOMEM, -1, "not enough memory for the labels");
    }
    for (size_t place = 0; place < table->count; place++) {
        if (table->values[place] == 0) {
            volume->background = table->counts[place];
        } else {
            volume->labels[volume->n_labels++] =
                (struct srnf_label){.value = table->values[place], .voxels = table->counts[place]};
        }
    }
    if (volume->n_labels > SRNF_VOLUME_LABELS_MAX) {
        return srnf_fail(reader->error, SRNF_EPARSE, -1,
                         "it has more than %d labels: an image and no segmentation; " WAY_OUT,
                         SRNF_VOLUME_LABELS_MAX);
    }
    qsort(volume->labels, volume->n_labels, sizeof *volume->labels, by_value);
    name_labels(reader);
    number_places(reader, numbers);
    for (size_t i = 0; i < reader->n_voxels; i++) {
        if (srnf_asks(reader->limits.context, i)) {
            return SRNF_ECANCELED;
        }
        volume->voxels[i] = numbers[volume->voxels[i]];
    }
    return SRNF_OK;
}
