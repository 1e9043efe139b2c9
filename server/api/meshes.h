/*
 * meshes.h - meshes in the api layer: how one that was read or made is examined, and how one that a
 * job made comes into the store.
 */
#ifndef SRNFD_API_MESHES_H
#define SRNFD_API_MESHES_H

#include "api/handler.h"

struct store_owner; /* owner.h */
/* Reading an upload goes on until it is told to stop, as with memory that is refused (api.c). */
extern const struct srnf_context upload_context;
/* ?name= of an upload into name[NAME_SIZE], "" where there is none. False: a problem was answered.
   */
bool query_name(struct api_call *call, char *name);

/* The id of a mesh: that of its format and the digest of its bytes. The same bytes under another
   format are another mesh. */
void mesh_id(char id[STORE_ID_MAX], const char *format, const void *bytes, size_t size);

/*
 * The report of a mesh (mesh_report.c), as JSON text, with its topology, size, repairs and
 * star-shapedness.
 *   mesh    [in/out] as it was read: is prepared (compute_prepare)
 *   info    [in]     of its reader; NULL where none read it
 *   context [in]     asked whether to go on
 *   text    [out]    malloc; NULL on failure
 * Returns 0, or SRNF_ENOMEM, SRNF_ECANCELED and what srnf_mesh_prepare returns.
 */
int mesh_examine(struct compute_prepared *mesh, const struct srnf_mesh_read_info *info,
                 const struct srnf_context *context, char **text);

/* The format that a media type, of this length and without parameters, names; NULL: none. */
const char *mesh_type_format(const char *type, size_t length);

/* All formats of meshes, as a sentence lists them. */
#define MESH_FORMATS_TEXT 256
void mesh_formats_named(char text[MESH_FORMATS_TEXT]);

/* Whether its source says that it is the mirror image of what was uploaded. */
bool mesh_mirrored(const struct store_mesh *mesh);

/* A mesh to be kept. */
struct mesh_description {
    const char *name;             /* may be NULL */
    const struct srnf_mesh *mesh; /* borrowed */
    json_t *source;               /* taken over: what made it */
};

/*
 * Stores a mesh that a job made as an upload of a binary PLY file of it: its record, content,
 * report and place in the owner's quota are those of such an upload, and source says what made it.
 * Where the owner has it already, its name and time stay; the record given has the description's
 * own source all the same.
 *   jobs    [in]  of whose numeric build the mesh is kept as prepared, for later jobs; NULL: it is
 *                 not kept
 *   context [in]  asked whether to go on
 *   record  [out] new reference; NULL on failure
 *   failed  [out] where the return value is none of the store: an enum srnf_status
 * Returns an enum store_status; STORE_NOMEM also where *failed is set.
 */
int mesh_save(struct jobs *jobs, struct store *store, const struct store_owner *owner,
              struct mesh_description *description, const struct srnf_context *context,
              json_t **record, int *failed);

#endif
