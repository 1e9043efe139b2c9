/*
 * volume.h - what the readers of label volumes share.
 *
 * Bytes come from a source, which unpacks gzip as it goes, in pieces; voxels go to the table of
 * labels one piece at a time. So a reader holds two bytes for each voxel and some hundred KiB,
 * whatever a packed file would unpack to.
 */
#ifndef SRNF_VOLUME_INTERNAL_H
#define SRNF_VOLUME_INTERNAL_H

#include <locale.h>
#include <zlib.h>

#include "formats/scalar.h"
#include "internal.h"

#define VOLUME_PIECE ((size_t)1 << 16) /* bytes that are read at once */

/* Where bytes come from (source.c). */
struct volume_source {
    const unsigned char *at, *end; /* not yet taken */
    bool packed, ended;            /* gzip; its last member is over */
    bool inflating;                /* stream is to be closed */
    z_stream stream;
    size_t n_kept, kept_at; /* bytes for volume_source_byte */
    unsigned char kept[4096];
};

#define VOLUME_HASH_SIZE ((size_t)4 * SRNF_VOLUME_LABELS_MAX)

/* The table of values that were met, in the order in which they came (values.c). */
struct volume_values {
    int64_t values[SRNF_VOLUME_LABELS_MAX + 1];
    size_t counts[SRNF_VOLUME_LABELS_MAX + 1];
    uint16_t slots[VOLUME_HASH_SIZE]; /* place + 1; 0: free */
    size_t count, last;
};

struct volume_reader {
    const unsigned char *bytes; /* the input; not owned */
    size_t size;
    struct srnf_volume_limits limits;
    struct srnf_error *error; /* may be NULL */
    locale_t locale;          /* "C" */
    struct volume_source source;
    struct srnf_volume volume; /* what has been read so far */

    enum scalar_type type; /* of a voxel in the file */
    bool big_endian;
    bool scaled;
    double slope, intercept;
    size_t n_voxels;
    struct volume_values *values;
    size_t filled;            /* voxels so far */
    struct srnf_label *names; /* of NRRD: values and names that its header lists */
    size_t n_names;
};

/* ---- Sources --------------------------------------------------------------------------------- */

/* bytes may be gzip, which is unpacked then. Errors: SRNF_ENOMEM. volume_source_close is due. */
SRNF_CHECKED int volume_source_open(struct volume_reader *reader, const unsigned char *bytes,
                                    size_t size);
void volume_source_close(struct volume_source *source);
/* Up to n bytes; fewer at the end only. SRNF_EPARSE where packed data are damaged or cut off,
   SRNF_ECANCELED. */
SRNF_CHECKED int volume_source_read(struct volume_reader *reader, unsigned char *out, size_t n,
                                    size_t *got);
/* One byte, or -1 at the end. For headers and text. */
SRNF_CHECKED int volume_source_byte(struct volume_reader *reader, int *byte);
/* Passes over n bytes. */
SRNF_CHECKED int volume_source_skip(struct volume_reader *reader, uint64_t n);
/* Most bytes that what was not taken yet can give. */
uint64_t volume_source_most(const struct volume_source *source);
/* Packed data are read to their end, whose checksum tells whether they are whole. */
SRNF_CHECKED int volume_source_finish(struct volume_reader *reader);

/* ---- Voxels ---------------------------------------------------------------------------------- */

/* Sets shape and n_voxels and makes room: SRNF_ELIMIT, SRNF_EPARSE (sizes that are none), and
   SRNF_ENOMEM. least: bytes of one voxel at least in what is left of the source. */
SRNF_CHECKED int volume_expect(struct volume_reader *reader, const int64_t sizes[3], size_t least);
/* Reads all voxels of reader->type from the source. */
SRNF_CHECKED int volume_read_voxels(struct volume_reader *reader);
/* One voxel, scaled as the header says. */
SRNF_CHECKED int volume_add_voxel(struct volume_reader *reader, double value);
/* Sorts the labels and numbers the voxels by them. */
SRNF_CHECKED int volume_finish(struct volume_reader *reader);
/* Sets the affine in millimetres, and the spacing from it; SRNF_EPARSE where it is singular or not
   finite. unit: millimetres in one unit of the matrix. */
SRNF_CHECKED int volume_place(struct volume_reader *reader, const double affine[12], double unit);

/* ---- Formats --------------------------------------------------------------------------------- */

bool volume_is_nifti(const unsigned char *head, size_t size);
bool volume_is_nrrd(const unsigned char *head, size_t size);
SRNF_CHECKED int volume_read_nifti(struct volume_reader *reader);
SRNF_CHECKED int volume_read_nrrd(struct volume_reader *reader);

#endif
