/*
 * gifti_attributes.c - the attributes of a GIfTI data array that the reader needs (see gifti.h),
 * as a table of their names and of what takes their values.
 *
 * Source: "GIFTI Surface Data Format", version 1.0, 2008, section "DataArray". Types beyond the
 * three of the specification are taken too. Both arrays of a surface have two dimensions, the
 * second of which is 3.
 */
#include "gifti.h"

#include <string.h>

static const struct scalar_name type_names[] = {
    {"NIFTI_TYPE_UINT8", SCALAR_UINT8},
    {"NIFTI_TYPE_INT8", SCALAR_INT8},
    {"NIFTI_TYPE_UINT16", SCALAR_UINT16},
    {"NIFTI_TYPE_INT16", SCALAR_INT16},
    {"NIFTI_TYPE_UINT32", SCALAR_UINT32},
    {"NIFTI_TYPE_INT32", SCALAR_INT32},
    {"NIFTI_TYPE_UINT64", SCALAR_UINT64},
    {"NIFTI_TYPE_INT64", SCALAR_INT64},
    {"NIFTI_TYPE_FLOAT32", SCALAR_FLOAT32},
    {"NIFTI_TYPE_FLOAT64", SCALAR_FLOAT64},
    {NULL, SCALAR_NONE},
};

static const struct {
    const char *name;
    enum gifti_encoding encoding;
} encodings[] = {
    {"ASCII", GIFTI_ASCII},
    {"Base64Binary", GIFTI_BASE64},
    {"GZipBase64Binary", GIFTI_GZIP_BASE64},
};

static bool set_type(struct gifti_array *array, struct token value)
{
    array->type = token_scalar(value, type_names);
    return array->type != SCALAR_NONE;
}

static bool set_encoding(struct gifti_array *array, struct token value)
{
    for (size_t i = 0; i < sizeof encodings / sizeof encodings[0]; i++) {
        if (token_is(value, encodings[i].name)) {
            array->encoding = encodings[i].encoding;
            return true;
        }
    }
    return false;
}

static bool set_order(struct gifti_array *array, struct token value)
{
    array->column_major = token_is(value, "ColumnMajorOrder");
    return array->column_major || token_is(value, "RowMajorOrder");
}

static bool set_endian(struct gifti_array *array, struct token value)
{
    array->big_endian = token_is(value, "BigEndian");
    return array->big_endian || token_is(value, "LittleEndian");
}

static bool set_dimensions(struct gifti_array *array, struct token value)
{
    return token_integer(value, &array->dimensions) && array->dimensions == 2;
}

static bool set_rows(struct gifti_array *array, struct token value)
{
    return token_integer(value, &array->rows) && array->rows > 0;
}

static bool set_columns(struct gifti_array *array, struct token value)
{
    return token_integer(value, &array->columns) && array->columns == 3;
}

/* Each sets one member and says whether the value can be read here. */
static const struct {
    const char *name;
    bool (*set)(struct gifti_array *array, struct token value);
} attributes[] = {
    {"DataType", set_type},
    {"Encoding", set_encoding},
    {"Endian", set_endian},
    {"ArrayIndexingOrder", set_order},
    {"Dim0", set_rows},
    {"Dim1", set_columns},
    {"Dimensionality", set_dimensions},
};

int gifti_set_attribute(struct mesh_reader *reader, struct gifti_array *array, const char *name,
                        const char *value)
{
    const struct token text = {(const unsigned char *)value, strlen(value)};

    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; i++) {
        if (strcmp(name, attributes[i].name) == 0 && !attributes[i].set(array, text)) {
            return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)array->number,
                             "DataArray %zu: %s '%s' cannot be read", array->number,
                             attributes[i].name, token_quote(text).text);
        }
    }
    return SRNF_OK;
}

int gifti_check_attributes(struct mesh_reader *reader, const struct gifti_array *array)
{
    if (array->type == SCALAR_NONE || array->encoding == GIFTI_ENCODING_NONE || array->rows == 0 ||
        array->columns == 0) {
        return srnf_fail(reader->error, SRNF_EPARSE, (int64_t)array->number,
                         "DataArray %zu: DataType, Encoding, Dim0 or Dim1 is missing",
                         array->number);
    }
    return SRNF_OK;
}
