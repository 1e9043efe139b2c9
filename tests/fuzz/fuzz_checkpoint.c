/*
 * fuzz_checkpoint.c - bytes that a group mean is asked to go on from. The input is either the
 * checkpoint itself (odd first byte), or patches of a true one, three bytes each (a place and what
 * stands there), after which the sum at its end (FNV-1a over what is before it) is set right, so
 * that what is behind the sum is reached as well. The mean goes on, or says SRNF_EINVAL.
 */
#include "fuzz/fuzz_require.h"
#include "srnf.h"

#include <math.h>
#include <string.h>

#define DEGREE 4
#define N 2
#define CHECKPOINT_MAX ((size_t)1 << 16)

struct setting {
    struct srnf_sht *sht;
    double surfaces[N][3 * (DEGREE + 1) * (DEGREE + 1)];
    unsigned char bytes[CHECKPOINT_MAX];
    size_t size;
};

static struct setting setting;

static void keep(void *user, const void *bytes, size_t size)
{
    struct setting *s = user;

    fuzz_require(size <= sizeof s->bytes);
    memcpy(s->bytes, bytes, size);
    s->size = size;
}

static int mean(const void *resume, size_t size, bool first)
{
    const double *surfaces[N] = {setting.surfaces[0], setting.surfaces[1]};
    struct srnf_mean_options options = srnf_mean_options_defaults();
    struct srnf_error error = {0};
    struct srnf_mean result;
    int status;

    options.max_iterations = 1;
    options.checkpoint = first ? keep : NULL;
    options.checkpoint_user = &setting;
    options.resume = resume;
    options.resume_size = size;
    status = srnf_karcher_mean(setting.sht, N, surfaces, &options, NULL, &result, &error);
    if (status >= 0) {
        srnf_mean_clear(&result);
    }
    return status;
}

/* Two ellipsoids: x, y and z are the harmonics of degree 1, each in its own measure. */
static void open_setting(void)
{
    const size_t count = (DEGREE + 1) * (DEGREE + 1), order[3] = {3, 1, 2};

    fuzz_require(srnf_sht_create(&setting.sht, DEGREE, SRNF_GRID_GAUSS_LEGENDRE, 12, 24) ==
                 SRNF_OK);
    for (size_t i = 0; i < N; i++) {
        for (size_t k = 0; k < 3; k++) {
            setting.surfaces[i][k * count + order[k]] = 1.0 + 0.3 * (double)(i * k);
        }
    }
    fuzz_require(mean(NULL, 0, true) >= 0);
}

static void set_sum(unsigned char *bytes, size_t size)
{
    uint64_t hash = UINT64_C(14695981039346656037);

    for (size_t i = 0; i < size - 8; i++) {
        hash = (hash ^ bytes[i]) * UINT64_C(1099511628211);
    }
    memcpy(bytes + size - 8, &hash, 8);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    unsigned char *bytes;
    size_t length;
    int status;

    if (!setting.sht) {
        open_setting();
    }
    if (size == 0) {
        return 0;
    }
    length = data[0] % 2 ? size - 1 : setting.size;
    bytes = malloc(length + 1);
    fuzz_require(bytes != NULL);
    if (data[0] % 2) {
        memcpy(bytes, data + 1, length);
    } else {
        memcpy(bytes, setting.bytes, length);
        for (size_t i = 1; i + 2 < size; i += 3) {
            bytes[(data[i] + 256u * data[i + 1]) % length] = data[i + 2];
        }
        set_sum(bytes, length);
    }
    status = mean(bytes, length, false);
    fuzz_require(status >= 0 || status == SRNF_EINVAL || status == SRNF_ENUMERIC);
    free(bytes);
    return 0;
}
