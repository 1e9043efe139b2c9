/*
 * nrrd_names.c - the names that 3D Slicer gives to labels, in the header of an NRRD file.
 */
#include "nrrd.h"

#include <string.h>

/* The number of the segment in "SegmentN_suffix:=", and what follows; false for another line. */
static bool segment_line(struct token line, const char *suffix, int64_t *segment,
                         struct token *value)
{
    const unsigned char *under = line.size > 7 ? memchr(line.text, '_', line.size) : NULL;
    size_t length = strlen(suffix);
    struct token digits;

    if (!under || memcmp(line.text, "Segment", 7) != 0 ||
        (size_t)(line.text + line.size - under) < length || memcmp(under, suffix, length) != 0) {
        return false;
    }
    digits = (struct token){line.text + 7, (size_t)(under - line.text - 7)};
    *value = nrrd_trimmed(under + length, line.size - (size_t)(under + length - line.text));
    return token_integer(digits, segment) && *segment >= 0 && *segment < (int64_t)NRRD_NAMES_MAX;
}

/* A name without what JSON or a terminal would choke on: UTF-8 is checked by whoever shows it. */
static void copy_name(char name[SRNF_LABEL_NAME_MAX], struct token value)
{
    size_t n = value.size < SRNF_LABEL_NAME_MAX - 1 ? value.size : SRNF_LABEL_NAME_MAX - 1;

    for (size_t i = 0; i < n; i++) {
        name[i] = (char)(value.text[i] < 0x20 || value.text[i] >= 0x7f ? '?' : value.text[i]);
    }
    name[n] = '\0';
}

void nrrd_read_name(struct volume_reader *reader, struct token line)
{
    struct token value;
    int64_t segment, label;

    if (segment_line(line, "_Name:=", &segment, &value)) {
        copy_name(reader->names[segment].name, value);
    } else if (segment_line(line, "_LabelValue:=", &segment, &value) &&
               token_integer(value, &label)) {
        reader->names[segment].value = label;
    }
}
