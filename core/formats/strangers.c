/*
 * strangers.c - what is no mesh that can be read here but is often sent for one: told by its first
 * bytes, and named in the error together with what helps.
 */
#include "formats.h"
#include "pack.h"

#include <string.h>

#define PROBE ((size_t)4096)

/* A row fits where its bytes stand at its offset. Letters of `text` rows, which stand at the first
   word, fit in either case. */
static const struct stranger {
    const char *kind;
    size_t offset; /* TEXT: at the first word, whatever the case */
    const char *begins;
    size_t size;
    const char *message;
} strangers[] = {
#define TEXT SIZE_MAX
#define BYTES(text) text, sizeof(text) - 1
    {"zip", 0, BYTES("PK\x03\x04"), "this is a zip archive: send the mesh that is inside"},
    {"zip", 0, BYTES("PK\x05\x06"), "this is an empty zip archive"},
    {"7z", 0, BYTES("7z\xbc\xaf\x27\x1c"), "this is a 7z archive: send the mesh that is inside"},
    {"rar", 0, BYTES("Rar!\x1a\x07"), "this is a rar archive: send the mesh that is inside"},
    {"tar", 257, BYTES("ustar"), "this is a tar archive: send the mesh that is inside"},
    {"xz", 0,
     BYTES("\xfd"
           "7zXZ"),
     "this is packed by xz: unpack it, or pack it by gzip"},
    {"bzip2", 0, BYTES("BZh"), "this is packed by bzip2: unpack it, or pack it by gzip"},
    {"zstd", 0, BYTES("\x28\xb5\x2f\xfd"), "this is packed by zstd: unpack it, or pack it by gzip"},
    {"nifti", 344, BYTES("n+1\0"), "this is a volume (NIfTI), not a mesh"},
    {"nifti", 344, BYTES("ni1\0"), "this is the header of a volume (NIfTI), not a mesh"},
    {"nifti", 4, BYTES("n+2\0\r\n\x1a\n"), "this is a volume (NIfTI-2), not a mesh"},
    {"nrrd", 0, BYTES("NRRD000"), "this is a volume (NRRD), not a mesh"},
    {"dicom", 128, BYTES("DICM"),
     "this is a DICOM file: convert the series to NIfTI, or the segmentation to a mesh"},
    {"hdf5", 0, BYTES("\x89HDF\r\n\x1a\n"),
     "this is an HDF5 file (MINC, MATLAB or another): export the mesh that is inside"},
    {"minc", 0, BYTES("CDF\x01"), "this is a volume (MINC): convert it to NIfTI"},
    {"matlab", 0, BYTES("MATLAB 5.0"),
     "this is a MATLAB file: export vertices and faces as a mesh"},
    {"npy", 0, BYTES("\x93NUMPY"), "this is an array of NumPy, not a mesh"},
    {"pdf", 0, BYTES("%PDF-"), "this is a PDF document, not a mesh"},
    {"png", 0, BYTES("\x89PNG"), "this is an image (PNG), not a mesh"},
    {"jpeg", 0, BYTES("\xff\xd8\xff"), "this is an image (JPEG), not a mesh"},
    {"gif", 0, BYTES("GIF8"), "this is an image (GIF), not a mesh"},
    {"tiff", 0, BYTES("II*\0"), "this is an image (TIFF), not a mesh"},
    {"tiff", 0, BYTES("MM\0*"), "this is an image (TIFF), not a mesh"},
    {"blender", 0, BYTES("BLENDER"),
     "this is a Blender file: export the object as PLY, OBJ or GLB"},
    {"fbx", 0, BYTES("Kaydara FBX Binary"), "this is an FBX file: export the model as OBJ or GLB"},
    {"fbx", TEXT, BYTES("; FBX"), "this is an FBX file: export the model as OBJ or GLB"},
    {"step", TEXT, BYTES("ISO-10303-21"), "this is a STEP file: export a mesh as STL or OBJ"},
    {"usd", 0, BYTES("PXR-USDC"), "this is a USD file: export the model as GLB or OBJ"},
    {"usd", TEXT, BYTES("#usda"), "this is a USD file: export the model as GLB or OBJ"},
    {"vrml", TEXT, BYTES("#VRML"), "this is a VRML file: export the model as PLY or OBJ"},
    {"openctm", 0, BYTES("OCTM"), "this is an OpenCTM file: convert it by ctmconv to PLY or OBJ"},
    {"draco", 0, BYTES("DRACO"), "this is a Draco file: decode it to PLY or OBJ"},
    {"freesurfer-curvature", 0, BYTES("\xff\xff\xff"),
     "this is FreeSurfer's curvature, or a quadrangle surface: send the surface of triangles"},
    {"freesurfer-quadrangles", 0, BYTES("\xff\xff\xfd"),
     "FreeSurfer's quadrangle surfaces are not read: convert to triangles by mris_convert"},
    {"utf-16", 0, BYTES("\xff\xfe"),
     "this is text in UTF-16, as programs for Windows save it: save it in UTF-8"},
    {"utf-16", 0, BYTES("\xfe\xff"),
     "this is text in UTF-16, as programs for Windows save it: save it in UTF-8"},
    {"html", TEXT, BYTES("<!doctype html"), "this is a web page (HTML), not a mesh"},
    {"html", TEXT, BYTES("<html"), "this is a web page (HTML), not a mesh"},
#undef BYTES
};

/* XML by what stands among its first bytes. */
static const struct {
    const char *kind, *element, *message;
} elements[] = {
    {"html", "<html", "this is a web page (HTML), not a mesh"},
    {"vtk-xml", "<VTKFile",
     "this is VTK's XML format of another type than PolyData: extract the surface and save it as "
     ".vtp"},
    {"collada", "<COLLADA", "this is a Collada file: export the model as PLY, OBJ or GLB"},
    {"x3d", "<X3D", "this is an X3D file: export the model as PLY, OBJ or GLB"},
    {"svg", "<svg", "this is an image (SVG), not a mesh"},
    {"3mf", "<model", "this is the model of a 3MF file: export it as STL, PLY or OBJ"},
    {"amf", "<amf", "this is an AMF file: export the model as STL, PLY or OBJ"},
    {"xml", "<?xml", "this is XML, but neither GIfTI nor VTP"},
};

static bool contains(const unsigned char *bytes, size_t size, const char *text)
{
    return memmem(bytes, size < PROBE ? size : PROBE, text, strlen(text)) != NULL;
}

/* Archives that are files of a program of their own. */
static const char *archive_message(const unsigned char *bytes, size_t size, const char **kind)
{
    if (contains(bytes, size, "3D/3dmodel") || contains(bytes, size, "[Content_Types].xml")) {
        *kind = "3mf";
        return "this is a 3MF file or a document of an office: export the model as STL, PLY or OBJ";
    }
    if (contains(bytes, size, ".usd")) {
        *kind = "usd";
        return "this is a USD file: export the model as GLB or OBJ";
    }
    return NULL;
}

const char *mesh_stranger(const unsigned char *bytes, size_t size, const char **kind)
{
    const char *message = NULL;
    struct scan scan;
    struct token word;

    *kind = "empty";
    scan_sniff(&scan, bytes, size);
    if (!scan_word(&scan, &word)) {
        return size == 0 ? "the body is empty" : "the body holds nothing but white space";
    }
    word.size = (size_t)(scan.end - word.text);
    for (size_t i = 0; i < sizeof strangers / sizeof strangers[0] && !message; i++) {
        const struct stranger *row = &strangers[i];
        bool fits = row->offset == TEXT
                        ? token_begins(word, row->begins)
                        : size >= row->offset + row->size &&
                              memcmp(bytes + row->offset, row->begins, row->size) == 0;

        if (fits) {
            *kind = row->kind;
            message = strcmp(row->kind, "zip") == 0 ? archive_message(bytes, size, kind) : NULL;
            message = message ? message : row->message;
        }
    }
    for (size_t i = 0; i < sizeof elements / sizeof elements[0] && !message && *word.text == '<';
         i++) {
        if (contains(word.text, word.size, elements[i].element)) {
            *kind = elements[i].kind;
            message = elements[i].message;
        }
    }
    if (!message && (*word.text == '{' || *word.text == '[')) {
        *kind = "json";
        message = "this is JSON, but not glTF: send the mesh as a file of its own";
    }
    return message;
}

const char *srnf_mesh_stranger(const void *bytes, size_t size)
{
    const char *kind = NULL, *message;
    unsigned char *first;
    size_t total;

    if (!bytes || !pack_is_gzip(bytes, size)) {
        return mesh_stranger(bytes ? bytes : (const unsigned char *)"", bytes ? size : 0, &kind)
                   ? kind
                   : NULL;
    }
    first = srnf_alloc(PROBE, 1);
    message =
        first ? mesh_stranger(first, pack_peek(bytes, size, first, PROBE, &total), &kind) : NULL;
    srnf_free(first);
    return message ? kind : NULL;
}
