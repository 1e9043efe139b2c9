/*
 * volume.h - label volumes (segmentations): files, and the closed surface of a label (core/volume).
 *
 * A part of srnf.h, which states the conventions; programs include that.
 */
#ifndef SRNF_PUBLIC_VOLUME_H
#define SRNF_PUBLIC_VOLUME_H

#include "srnf/base.h"
#include "srnf/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum srnf_volume_format {
    SRNF_VOLUME_UNKNOWN = 0,
    SRNF_VOLUME_NIFTI, /* NIfTI-1 and NIfTI-2 in one file, both byte orders, gzipped or not */
    SRNF_VOLUME_NRRD,  /* attached header; raw, gzip and ascii encodings */
};

/* What places the voxels in the world. */
enum srnf_volume_space {
    SRNF_SPACE_NONE = 0, /* the file says only how large they are; index 0 lies at the origin */
    SRNF_SPACE_SFORM,    /* NIfTI's sform */
    SRNF_SPACE_QFORM,    /* NIfTI's qform, where it has no sform */
    SRNF_SPACE_RAS,      /* NRRD's space; LPS and LAS are turned into RAS */
    SRNF_SPACE_LPS,
    SRNF_SPACE_LAS,
    SRNF_SPACE_OTHER, /* axes without anatomical names, taken as they stand */
};

#define SRNF_LABEL_NAME_MAX 80
struct srnf_label {
    int64_t value; /* not 0, which is background */
    size_t voxels;
    char name[SRNF_LABEL_NAME_MAX]; /* as the file has it, or "" */
};

struct srnf_volume {
    enum srnf_volume_format format;
    enum srnf_volume_space space;
    size_t shape[3];   /* voxels along i, j, k; i varies fastest */
    double affine[12]; /* [3][4]: index (i, j, k, 1) to world, RAS where space says so, mm */
    double spacing[3]; /* mm between neighbours along i, j, k */
    const char *units; /* of the file: "millimetres", "metres", "micrometres", "centimetres",
                           "unknown" (taken as millimetres); static */
    uint16_t *voxels; /* [shape[2]][shape[1]][shape[0]]: place among labels, from 1; 0 background */
    size_t background; /* voxels of value 0 */
    size_t n_labels;
    struct srnf_label *labels; /* by value, ascending */
};
/* Frees what the volume owns and clears it. */
void srnf_volume_clear(struct srnf_volume *volume);

#define SRNF_VOLUME_LABELS_MAX 4096
struct srnf_volume_limits {
    size_t max_voxels;                  /* default 2^28 */
    size_t max_memory;                  /* bytes held at once, beside the input; default 1 GiB */
    const struct srnf_context *context; /* asked whether to go on; default NULL: never */
    size_t *unpack_left;                /* as in srnf_mesh_limits; default NULL */
};
struct srnf_volume_limits srnf_volume_limits_defaults(void);

/* "nifti", "nrrd", and back. */
const char *srnf_volume_format_name(enum srnf_volume_format format);
enum srnf_volume_format srnf_volume_format_from_name(const char *name);
/* "sform", "qform", "RAS", "LPS", "LAS", "other", "none". */
const char *srnf_volume_space_name(enum srnf_volume_space space);

/*
 * Reads a label volume from memory: whole numbers, of any type of the format, scaled as the header
 * says, with at most SRNF_VOLUME_LABELS_MAX different values.
 *   bytes, size  [in]  the file's content; any bytes at all are safe
 *   format       [in]  the format, or SRNF_VOLUME_UNKNOWN to sniff it
 *   limits       [in]  NULL: defaults. What a header promises is checked against them, and against
 *                      what the remaining bytes can hold, before anything is allocated
 *   volume       [out] to be cleared
 *   error        [out] optional
 * Errors: SRNF_EFORMAT, SRNF_EPARSE (element: the voxel or byte, as the message says), SRNF_ELIMIT,
 * SRNF_ENOMEM, SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_volume_read(const void *bytes, size_t size, enum srnf_volume_format format,
                                  const struct srnf_volume_limits *limits,
                                  struct srnf_volume *volume, struct srnf_error *error);

#define SRNF_SMOOTHING_PASSES_MAX 200
struct srnf_extract_options {
    size_t smoothing; /* passes, 0 .. SRNF_SMOOTHING_PASSES_MAX; default 30 */
    bool strict;      /* refuse a label whose topology would have to be changed; default false */
};
struct srnf_extract_options srnf_extract_options_defaults(void);

/* Why voxels were changed. */
enum srnf_change {
    SRNF_CHANGE_ISLAND, /* removed: not connected to the largest component */
    SRNF_CHANGE_CAVITY, /* added: enclosed by the label */
    SRNF_CHANGE_CUT,    /* removed: a handle is cut there */
    SRNF_CHANGE_FILLED, /* added: a tunnel is closed there */
};
const char *srnf_change_name(enum srnf_change change); /* "island-removed", ... */

struct srnf_changed_place {
    enum srnf_change change;
    size_t voxels;
    double position[3]; /* mean of their centres, world */
};
#define SRNF_PLACES_MAX 100

struct srnf_extracted {
    struct srnf_mesh mesh; /* world, faces outward */
    size_t voxels;         /* of the labels as they are in the volume */
    double voxel_volume;   /* of the voxels that the mesh encloses, after the changes */
    double volume;         /* of the mesh */
    double max_offset;     /* the shift along normals that restored the volume, world */
    size_t changed;        /* voxels, of all places */
    size_t added, removed; /* of them */
    size_t n_places;       /* found; the largest SRNF_PLACES_MAX are listed, largest first */
    struct srnf_changed_place *places;
    size_t smoothing; /* passes made: fewer than asked for where the label is too thin for them */
    bool at_border;   /* the label reaches the edge of the volume: it may be cut off there */
};
void srnf_extracted_clear(struct srnf_extracted *extracted);

/*
 * The closed surface of genus zero of one label or of several together (core/volume/extract.c):
 * topology corrected in the voxels, a dual surface of them, smoothed within a
 * voxel of where it was, with the volume of the voxels.
 *   values, n_values  [in]  labels of the volume
 *   options           [in]  NULL: defaults
 *   extracted         [out] to be cleared
 *   error             [out] optional
 * Errors: SRNF_EINVAL (a value that is no label of the volume, options), SRNF_EGENUS (strict, and
 * voxels would have to be changed), SRNF_ENUMERIC (the volume cannot be restored), SRNF_ENOMEM,
 * SRNF_ECANCELED.
 */
SRNF_CHECKED int srnf_extract(const struct srnf_volume *volume, const int64_t *values,
                              size_t n_values, const struct srnf_extract_options *options,
                              const struct srnf_context *context, struct srnf_extracted *extracted,
                              struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
