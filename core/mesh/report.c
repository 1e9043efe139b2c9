/*
 * report.c - what a mesh is, after its repairs: topology, measures, and the reasons why it cannot
 * be analysed.
 *
 * Unreferenced vertices are dropped, topology and measures taken, and a closed mesh whose faces
 * agree with each other but look inwards (negative volume) is turned. Whatever is left that breaks
 * "one closed, oriented surface of genus zero that encloses a volume" becomes a problem, in the
 * order of enum srnf_status; a mesh without problems has Euler characteristic 2 and positive
 * volume. Each problem says where it is, in the numbers of the file, and what would help.
 */
#include "mesh_geometry.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>

/* Sizes that can be analysed: areas are squared once more on the way to an SRNF, and must stay far
   from the ends of the range of a double. */
#define DIAGONAL_MIN 1e-30
#define DIAGONAL_MAX 1e30
/* Area and volume are sums of rounded terms of at most 1 (for a diagonal of 1) each; what is below
   this part of them is taken for zero. */
#define EMPTY_AREA 1e-14
#define EMPTY_VOLUME 1e-13

__attribute__((format(printf, 5, 6))) static void add_problem(struct srnf_mesh_report *report,
                                                              int status, size_t count,
                                                              int64_t first, const char *format,
                                                              ...)
{
    struct srnf_mesh_problem *problem = &report->problems[report->n_problems];
    va_list arguments;

    if (report->n_problems == SRNF_MESH_PROBLEMS_MAX) {
        return;
    }
    report->n_problems++;
    problem->status = status;
    problem->count = count;
    problem->first = first;
    va_start(arguments, format);
    (void)vsnprintf(problem->detail, sizeof problem->detail, format, arguments);
    va_end(arguments);
}

static void add_edge_problem(struct srnf_mesh_report *report, int status,
                             const struct srnf_edge_finding *edges, const char *one,
                             const char *many, const char *help)
{
    if (edges->count > 0) {
        add_problem(report, status, edges->count, edges->face,
                    "%zu %s; the first belongs to face %" PRIu32 ", between vertices %" PRIu32
                    " and %" PRIu32 "; %s",
                    edges->count, edges->count == 1 ? one : many, edges->face, edges->from,
                    edges->to, help);
    }
}

static void add_topology_problems(struct srnf_mesh_report *report,
                                  const struct srnf_topology *topology)
{
    int64_t missing = 2 - report->euler_characteristic;

    add_edge_problem(
        report, SRNF_ENOT_CLOSED, &topology->boundary, "boundary edge", "boundary edges",
        "the repairs holes and merge (of points that are near: equal ones are merged here) "
        "close them");
    add_edge_problem(
        report, SRNF_ENOT_MANIFOLD, &topology->crowded, "edge with three faces or more",
        "edges with three faces or more",
        "remove inner walls, or part what touches there; the repairs duplicates and islands "
        "help where walls are double or solids lie apart");
    if (topology->split_vertices > 0) {
        add_problem(
            report, SRNF_ENOT_MANIFOLD, topology->split_vertices, topology->first_split_vertex,
            "%zu %s faces of several fans that touch only there; the first is vertex %" PRIu32
            "; part them, or keep one of the solids (repair: islands)",
            topology->split_vertices,
            topology->split_vertices == 1 ? "vertex joins" : "vertices join",
            topology->first_split_vertex);
    }
    if (topology->orientable) {
        add_edge_problem(report, SRNF_ENOT_ORIENTED, &topology->disagreeing,
                         "edge along which both faces run the same way",
                         "edges along which both faces run the same way",
                         "turn the faces so that all look outwards (repair: orient)");
    } else {
        add_edge_problem(report, SRNF_ENOT_ORIENTED, &topology->disagreeing,
                         "edge of a one-sided surface along which both faces run the same way",
                         "edges of a one-sided surface along which both faces run the same way",
                         "it has no inside");
    }
    if (topology->components > 1) {
        add_problem(report, SRNF_ECOMPONENTS, topology->components, topology->first_face_elsewhere,
                    "%zu components; face %" PRIu32
                    " is the first that does not belong to that of face %" PRIu32
                    "; send one of them alone, or keep the largest (repair: islands)",
                    topology->components, topology->first_face_elsewhere, topology->first_face);
    }
    if (report->closed && report->edge_manifold && report->vertex_manifold &&
        topology->components == 1 && missing != 0) {
        size_t count = (size_t)(topology->orientable ? missing / 2 : missing);

        add_problem(report, SRNF_EGENUS, count, -1,
                    "the Euler characteristic is %" PRId64
                    ", not 2: a sphere with %zu %s%s; fill the holes through it%s",
                    report->euler_characteristic, count,
                    topology->orientable ? "handle" : "cross-cap", count == 1 ? "" : "s",
                    topology->orientable ? " (repair: handles)" : "");
    }
}

static void add_degeneracies(struct srnf_mesh_report *report, const struct srnf_topology *topology,
                             const struct srnf_mesh_measures *measures)
{
    if (topology->degenerate_faces > 0) {
        add_problem(
            report, SRNF_EDEGENERATE, topology->degenerate_faces, topology->first_degenerate_face,
            "%zu face%s a vertex twice; the first is face %" PRIu32 " (repair: degenerate)",
            topology->degenerate_faces, topology->degenerate_faces == 1 ? " names" : "s name",
            topology->first_degenerate_face);
    }
    if (measures->out_of_range) {
        add_problem(report, SRNF_EDEGENERATE, 1, -1, "a coordinate is beyond %g in size",
                    SRNF_MESH_COORDINATE_MAX);
    } else if (topology->faces == 0) {
        if (topology->degenerate_faces == 0) {
            add_problem(report, SRNF_EDEGENERATE, 1, -1, "the mesh has no faces");
        }
    } else if (measures->diagonal > 0.0 &&
               !(measures->diagonal >= DIAGONAL_MIN && measures->diagonal <= DIAGONAL_MAX)) {
        add_problem(report, SRNF_EDEGENERATE, 1, -1,
                    "the bounding-box diagonal is %g, not in %g to %g: choose other units",
                    measures->diagonal, DIAGONAL_MIN, DIAGONAL_MAX);
    } else if (measures->relative_area <= EMPTY_AREA) {
        add_problem(report, SRNF_EDEGENERATE, 1, -1,
                    "the faces have no area: all vertices lie on a line");
    } else if (report->closed && report->oriented &&
               fabs(measures->relative_volume) <= EMPTY_VOLUME * measures->relative_area) {
        add_problem(report, SRNF_EDEGENERATE, 1, -1, "the surface encloses no volume");
    }
}

static void fill_report(struct srnf_mesh_report *report, const struct srnf_topology *topology,
                        const struct srnf_mesh_measures *measures)
{
    report->closed = topology->boundary.count == 0 && topology->faces > 0;
    report->edge_manifold = topology->crowded.count == 0;
    report->vertex_manifold = topology->split_vertices == 0;
    report->oriented = topology->disagreeing.count == 0;
    report->components = topology->components;
    report->euler_characteristic =
        (int64_t)topology->vertices - (int64_t)topology->edges + (int64_t)topology->faces;
    report->genus = -1;
    if (report->closed && report->edge_manifold && report->vertex_manifold && report->oriented &&
        report->components == 1) {
        report->genus = (2 - report->euler_characteristic) / 2;
    }
    report->area = measures->area;
    report->volume = measures->volume;
    report->bounding_box_diagonal = measures->diagonal;
    report->coarseness = measures->coarseness;
    for (size_t k = 0; k < 3; k++) {
        report->centroid[k] = measures->centroid[k];
    }
}

static void trace_edges(struct srnf_edge_finding *edges, const struct srnf_mesh_origin *origin)
{
    if (edges->count > 0) {
        edges->face = origin->faces[edges->face];
        edges->from = origin->vertices[edges->from];
        edges->to = origin->vertices[edges->to];
    }
}

/* From the numbers that faces and vertices have now to those of the file. */
static void trace(struct srnf_topology *topology, const struct srnf_mesh_origin *origin)
{
    trace_edges(&topology->boundary, origin);
    trace_edges(&topology->crowded, origin);
    trace_edges(&topology->disagreeing, origin);
    if (topology->split_vertices > 0) {
        topology->first_split_vertex = origin->vertices[topology->first_split_vertex];
    }
    if (topology->components > 1) {
        topology->first_face = origin->faces[topology->first_face];
        topology->first_face_elsewhere = origin->faces[topology->first_face_elsewhere];
    }
    if (topology->degenerate_faces > 0) {
        topology->first_degenerate_face = origin->faces[topology->first_degenerate_face];
    }
}

int srnf_mesh_examine(struct srnf_mesh *mesh, struct srnf_mesh_origin *origin,
                      const struct srnf_context *context, struct srnf_mesh_report *report)
{
    struct srnf_topology topology;
    struct srnf_mesh_measures measures;
    size_t dropped;
    int status = srnf_repair_drop_unreferenced(mesh, origin, context, &dropped);

    report->repairs.unreferenced_vertices_dropped += dropped;
    if (status == SRNF_OK) {
        status = srnf_topology_analyse(mesh, context, &topology);
    }
    if (status != SRNF_OK) {
        return status;
    }
    srnf_mesh_measure(mesh, context, &measures);
    if (srnf_is_canceled(context)) {
        return SRNF_ECANCELED;
    }
    fill_report(report, &topology, &measures);
    if (report->closed && report->edge_manifold && report->oriented && measures.volume < 0.0) {
        srnf_repair_flip_faces(mesh);
        report->repairs.faces_flipped = mesh->n_faces;
        report->volume = -report->volume;
    }
    trace(&topology, origin);
    add_topology_problems(report, &topology);
    add_degeneracies(report, &topology, &measures);
    return SRNF_OK;
}
