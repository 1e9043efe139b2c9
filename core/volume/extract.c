/*
 * extract.c - from labels to a closed surface of genus zero.
 *
 *   1. the voxels of the labels, in a box with room around them, so that a label at the edge of the
 *      volume is closed there;
 *   2. made a ball (ball.c), every changed voxel with its reason;
 *   3. their dual surface (net.c), which is anti-aliased by smoothing within the cells (smooth.c);
 *   4. into the world by the affine; faces turn where that is a reflection;
 *   5. shifted along its normals until it encloses the volume of the voxels: smoothing rounds
 * corners
 *      off, and the number of voxels is a better measure of volume than any surface through them.
 *
 * Genus zero follows from 2 and 3, and is checked at the end all the same.
 */
#include "extract.h"

#include <math.h>

#define DEFAULT_SMOOTHING 30

struct srnf_extract_options srnf_extract_options_defaults(void)
{
    return (struct srnf_extract_options){.smoothing = DEFAULT_SMOOTHING};
}

const char *srnf_change_name(enum srnf_change change)
{
    static const char *const names[] = {"island-removed", "cavity-filled", "handle-cut",
                                        "tunnel-filled"};

    return (size_t)change < sizeof names / sizeof names[0] ? names[change] : "";
}

void srnf_extracted_clear(struct srnf_extracted *extracted)
{
    srnf_mesh_clear(&extracted->mesh);
    srnf_free(extracted->places);
    *extracted = (struct srnf_extracted){.voxels = 0};
}

/* ---- The box --------------------------------------------------------------------------------- */

static int choose(struct extraction *work, const int64_t *values, size_t n_values)
{
    const struct srnf_volume *volume = work->volume;

    for (size_t i = 0; i < n_values; i++) {
        size_t n = 0;

        while (n < volume->n_labels && volume->labels[n].value != values[i]) {
            n++;
        }
        if (n == volume->n_labels) {
            return srnf_fail(work->error, SRNF_EINVAL, (int64_t)i,
                             "the volume has no voxels of label %lld", (long long)values[i]);
        }
        work->chosen[n + 1] = true;
    }
    return n_values > 0
               ? SRNF_OK
               : srnf_fail(work->error, SRNF_EINVAL, -1, "there must be one label at least");
}

/* The extent of the chosen voxels, both ends included, and how many there are. */
static int find_extent(struct extraction *work, size_t low[3], size_t high[3])
{
    const struct srnf_volume *volume = work->volume;
    size_t at = 0, place[3];

    for (size_t k = 0; k < 3; k++) {
        low[k] = SIZE_MAX;
        high[k] = 0;
    }
    for (place[2] = 0; place[2] < volume->shape[2]; place[2]++) {
        for (place[1] = 0; place[1] < volume->shape[1]; place[1]++) {
            for (place[0] = 0; place[0] < volume->shape[0]; place[0]++, at++) {
                for (size_t k = 0; k < 3 && work->chosen[volume->voxels[at]]; k++) {
                    low[k] = place[k] < low[k] ? place[k] : low[k];
                    high[k] = place[k] > high[k] ? place[k] : high[k];
                }
                work->extracted->voxels += work->chosen[volume->voxels[at]];
            }
        }
        if (srnf_is_canceled(work->context)) {
            return SRNF_ECANCELED;
        }
    }
    for (size_t k = 0; k < 3; k++) {
        work->extracted->at_border =
            work->extracted->at_border || low[k] == 0 || high[k] + 1 == volume->shape[k];
    }
    return SRNF_OK;
}

/* The state of a voxel of the box. */
static unsigned char state_of(const struct extraction *work, const size_t place[3])
{
    const struct srnf_volume *volume = work->volume;
    size_t at = 0;

    for (size_t k = 0; k < 3; k++) {
        if (place[k] == 0 || place[k] + 1 == work->box.shape[k]) {
            return VOXEL_WALL;
        }
    }
    for (size_t k = 3; k-- > 0;) {
        ptrdiff_t index = (ptrdiff_t)place[k] + work->box.first[k];

        if (index < 0 || index >= (ptrdiff_t)volume->shape[k]) {
            return VOXEL_OUT;
        }
        at = at * volume->shape[k] + (size_t)index;
    }
    return work->chosen[volume->voxels[at]] ? VOXEL_IN : VOXEL_OUT;
}

static int fill_box(struct extraction *work)
{
    struct voxel_box *box = &work->box;
    size_t low[3], high[3], place[3], at = 0;
    int status = find_extent(work, low, high);

    if (status != SRNF_OK) {
        return status;
    }
    box->count = 1;
    for (size_t k = 0; k < 3; k++) {
        box->stride[k] = box->count;
        box->shape[k] = high[k] - low[k] + 5;
        box->first[k] = (ptrdiff_t)low[k] - 2;
        box->spacing[k] = work->volume->spacing[k];
        box->count *= box->shape[k];
    }
    if (box->count > UINT32_MAX / 8) {
        return srnf_fail(
            work->error, SRNF_ELIMIT, -1,
            "the box around the labels has %zu voxels, which is too many: resample the "
            "volume",
            box->count);
    }
    box->voxels = srnf_alloc(box->count, 1);
    box->changes = srnf_alloc(box->count, 1);
    if (!box->voxels || !box->changes) {
        return extract_no_memory(work);
    }
    for (place[2] = 0; place[2] < box->shape[2]; place[2]++) {
        for (place[1] = 0; place[1] < box->shape[1]; place[1]++) {
            for (place[0] = 0; place[0] < box->shape[0]; place[0]++, at++) {
                box->voxels[at] = state_of(work, place);
            }
        }
        if (srnf_is_canceled(work->context)) {
            return SRNF_ECANCELED;
        }
    }
    return SRNF_OK;
}

/* ---- The whole ------------------------------------------------------------------------------- */

static int refuse_changes(const struct extraction *work)
{
    const struct srnf_extracted *extracted = work->extracted;
    const struct srnf_changed_place *place = extracted->places;

    return srnf_fail(work->error, SRNF_EGENUS, -1,
                     "%zu voxels at %zu places would have to be changed, most of them (%zu, %s) at "
                     "(%.6g, %.6g, %.6g) mm; let the topology be corrected, or edit the label",
                     extracted->changed, extracted->n_places, place->voxels,
                     srnf_change_name(place->change), place->position[0], place->position[1],
                     place->position[2]);
}

static int make_ball(struct extraction *work, bool strict)
{
    size_t inside = 0;
    int status = voxels_to_ball(&work->box, work->context);

    if (status == SRNF_ENOMEM) {
        return extract_no_memory(work);
    }
    status = status == SRNF_OK ? extract_places(work) : status;
    if (status == SRNF_OK && strict && work->extracted->changed > 0) {
        return refuse_changes(work);
    }
    for (size_t i = 0; i < work->box.count; i++) {
        inside += work->box.voxels[i] == VOXEL_IN;
    }
    work->extracted->voxel_volume = (double)inside * fabs(extract_determinant(work));
    return status;
}

/* The surface with so many passes of smoothing. */
static int try_surface(struct extraction *work, size_t smoothing)
{
    int status = voxel_net_make(&work->box, work->context, &work->net);

    status = status == SRNF_OK ? voxel_net_smooth(&work->net, smoothing, work->context) : status;
    if (status == SRNF_ENOMEM) {
        status = extract_no_memory(work);
    }
    srnf_report_progress(work->context, 0.8, "meshing");
    status = status == SRNF_OK ? extract_finish(work) : status;
    voxel_net_clear(&work->net);
    return status;
}

/* What is only a few voxels thick is smoothed away; half as many passes may leave it. */
static int make_surface(struct extraction *work, size_t smoothing)
{
    int status = try_surface(work, smoothing);

    while (status == SRNF_ENUMERIC && smoothing > 0) {
        smoothing /= 2;
        status = try_surface(work, smoothing);
    }
    work->extracted->smoothing = smoothing;
    return status;
}

int srnf_extract(const struct srnf_volume *volume, const int64_t *values, size_t n_values,
                 const struct srnf_extract_options *options, const struct srnf_context *context,
                 struct srnf_extracted *extracted, struct srnf_error *error)
{
    const struct srnf_extract_options used = options ? *options : srnf_extract_options_defaults();
    struct extraction *work = srnf_alloc(1, sizeof *work);
    int status;

    *extracted = (struct srnf_extracted){.voxels = 0};
    if (!work) {
        return srnf_fail(error, SRNF_ENOMEM, -1, "not enough memory to extract the surface");
    }
    *work = (struct extraction){
        .volume = volume, .context = context, .error = error, .extracted = extracted};
    status = used.smoothing > SRNF_SMOOTHING_PASSES_MAX
                 ? srnf_fail(error, SRNF_EINVAL, -1, "smoothing is %zu; at most %d passes are made",
                             used.smoothing, SRNF_SMOOTHING_PASSES_MAX)
                 : choose(work, values, n_values);
    status = status == SRNF_OK ? fill_box(work) : status;
    srnf_report_progress(context, 0.2, "correcting topology");
    status = status == SRNF_OK ? make_ball(work, used.strict) : status;
    srnf_report_progress(context, 0.6, "smoothing");
    status = status == SRNF_OK ? make_surface(work, used.smoothing) : status;
    if (status == SRNF_OK && srnf_is_canceled(context)) {
        status = SRNF_ECANCELED;
    }
    if (status == SRNF_ECANCELED) {
        (void)srnf_fail(error, status, -1, "%s", srnf_strerror(status));
    }
    if (status != SRNF_OK) {
        srnf_extracted_clear(extracted);
    }
    srnf_free(work->box.voxels);
    srnf_free(work->box.changes);
    srnf_free(work);
    return status;
}
