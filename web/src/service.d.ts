// Made by web/types.mjs of api/openapi.yaml: make web

export interface paths {
    "/": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["landing"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/ui": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["dashboardRedirect"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/ui/": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["dashboard"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/ui/{file}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["dashboardFile"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/ui/example/{file}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["exampleFile"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/healthz": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["health"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/readyz": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["readiness"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/metrics": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["metrics"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["base"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/conformance": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["conformance"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/version": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["version"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/caller": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["caller"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/users": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listUsers"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/openapi.yaml": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["description"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/openapi.json": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["description30"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/docs": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["docs"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/meshes": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listMeshes"];
        put?: never;
        post: operations["createMesh"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/meshes/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getMesh"];
        put?: never;
        post?: never;
        delete: operations["deleteMesh"];
        options?: never;
        head?: never;
        patch: operations["labelMesh"];
        trace?: never;
    };
    "/v1/meshes/{id}/content": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getMeshContent"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/volumes": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listVolumes"];
        put?: never;
        post: operations["createVolume"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/volumes/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getVolume"];
        put?: never;
        post?: never;
        delete: operations["deleteVolume"];
        options?: never;
        head?: never;
        patch: operations["labelVolume"];
        trace?: never;
    };
    "/v1/volumes/{id}/content": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getVolumeContent"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listSurfaces"];
        put?: never;
        post: operations["createSurface"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getSurface"];
        put?: never;
        post?: never;
        delete: operations["deleteSurface"];
        options?: never;
        head?: never;
        patch: operations["labelSurface"];
        trace?: never;
    };
    "/v1/surfaces/{id}/coefficients": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getCoefficients"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}/srnf": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getSrnf"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}/grid": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getGrid"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/surfaces/{id}/mesh": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getSurfaceMesh"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/imports": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["createImport"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/cohorts": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listCohorts"];
        put?: never;
        post: operations["createCohort"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/cohorts/{name}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getCohort"];
        put?: never;
        post?: never;
        delete: operations["deleteCohort"];
        options?: never;
        head?: never;
        patch: operations["changeCohort"];
        trace?: never;
    };
    "/v1/cohorts/{name}/members": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listCohortMembers"];
        put: operations["replaceCohortMembers"];
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/cohorts/{name}/export": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["exportCohort"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{id}/export": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["exportModel"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listModels"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getModel"];
        put?: never;
        post?: never;
        delete: operations["deleteModel"];
        options?: never;
        head?: never;
        patch: operations["labelModel"];
        trace?: never;
    };
    "/v1/models/{id}/modes": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getModes"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{id}/scores": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getScores"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/models/{id}/shape": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getModelShape"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/processes": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listProcesses"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/processes/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getProcess"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/processes/{id}/execution": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["execute"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/processes/{id}/estimate": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["estimate"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listJobs"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getJob"];
        put?: never;
        post?: never;
        delete: operations["deleteJob"];
        options?: never;
        head?: never;
        patch: operations["labelJob"];
        trace?: never;
    };
    "/v1/jobs/{id}/results": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getResults"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}/results/{output}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getOutput"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}/events": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["followJob"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/jobs/{id}/cancel": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["cancelJob"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/events": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["followJobs"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/tickets": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["createTicket"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/leases": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["leaseTask"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/leases/{task}/contents/{digest}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["getTaskContent"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/leases/{task}/heartbeat": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["extendLease"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/leases/{task}/result": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put: operations["returnResult"];
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/leases/{task}/failure": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post: operations["reportFailure"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/leases/{task}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post?: never;
        delete: operations["giveBackTask"];
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/workers": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get: operations["listWorkers"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/v1/workers/bars/{bar}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        post?: never;
        delete: operations["liftBar"];
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
}
export type webhooks = Record<string, never>;
export interface components {
    schemas: {
        Object: Record<string, unknown>;
        Text: string;
        Bytes: string;
        Warning: {
            /** @enum {string} */
            code: "closed-form-inapplicable" | "column-is-text" | "components-missing" | "coordinates-coarse" | "covariate-far" | "covariate-is-date" | "covariate-is-label" | "covariates-collinear" | "duplicate-content" | "encoding-poor" | "extrapolated" | "far-from-group" | "far-from-model" | "few-replicates" | "few-subjects" | "files-passed-over" | "inversion-not-converged" | "label-at-border" | "labels-alike" | "landmark-off-surface" | "landmarks-raise-distance" | "level-says-missing" | "mean-not-converged" | "members-not-compared" | "mirror-images" | "mixed-degrees" | "mixed-routes" | "mixed-units" | "model-uncalibrated" | "names-one-class" | "near-duplicates" | "no-label-column" | "not-above-chance" | "not-analysable" | "not-assessed" | "not-reached" | "p-floor" | "parameters-not-registered" | "path-jumps" | "pose-differs" | "registration-ambiguous" | "registration-distorted" | "registration-not-converged" | "registration-truncated" | "self-crossing" | "shapes-omitted" | "slope-odd" | "slope-reversed" | "spans-differ" | "spreads-differ" | "subjects-alike" | "surface-flat" | "surface-inside-out" | "topology-changed" | "training-subject" | "transform-not-applied" | "visits-apart" | "visits-coincide" | "visits-exchanged" | "visits-off-line";
            detail: string;
            figures?: Record<string, unknown>;
        };
        Problem: {
            type: string;
            title: string;
            status: number;
            code: string;
            detail?: string;
            instance?: string;
            requestId?: string;
            /** @enum {string} */
            quota?: "queued" | "running" | "bytes" | "requests" | "streams";
            limit?: number;
            errors?: {
                pointer: string;
                detail: string;
            }[];
            errorCount?: number;
            neededBy?: {
                /** @enum {string} */
                kind: "mesh" | "surface" | "model" | "job" | "cohort";
                id: string;
            }[];
            neededByCount?: number;
        };
        Version: {
            version: string;
            numericBuild: string;
            workers: number;
            versions: {
                [key: string]: string;
            };
        };
        Caller: {
            tokens: boolean;
            /** @enum {unknown} */
            role: "viewer" | "user" | "admin";
            name?: string;
        };
        Users: {
            items: {
                name: string;
                bytes: number;
                jobsWaiting: number;
                jobsRunning: number;
                tokens: {
                    id: string;
                    /** @enum {unknown} */
                    role: "viewer" | "user" | "admin" | "metrics" | "worker";
                    created?: string;
                    expires?: string;
                    lastUsed?: string;
                    quotas: {
                        queued?: number;
                        running?: number;
                        bytes?: number;
                        requests?: number;
                        streams?: number;
                    };
                }[];
            }[];
        };
        Readiness: {
            /** @constant */
            status: "ready";
            checks: {
                [key: string]: true;
            };
        };
        Links: {
            [key: string]: string;
        };
        LeaseRequest: {
            worker: string;
            host: string;
            cpu: string;
            slots: number;
            numericBuild: string;
            wait: number;
        };
        Lease: {
            task: string;
            kind: string;
            attempt: number;
            secret: string;
            expiresInSeconds: number;
            inputs: string;
            contents: string[];
        };
        Workers: {
            /** @enum {string} */
            executor: "local" | "workers" | "slurm";
            bars: {
                bar: number;
                worker: string;
                host?: string;
                token: string;
                pilots: boolean;
                why: string;
                since: string;
                until: string;
            }[];
            items: {
                worker: string;
                host: string;
                cpu: string;
                token: string;
                slots: number;
                alive: boolean;
                barred: boolean;
                first: string;
                last: string;
                leased: number;
                done: number;
                lost: number;
                kinds: {
                    [key: string]: {
                        leased: number;
                        done: number;
                        lost: number;
                    };
                };
            }[];
        };
        Ticket: {
            ticket: string;
            expiresInSeconds: number;
        };
        Link: {
            href: string;
            rel: string;
            type: string;
            title?: string;
        };
        LandingPage: {
            title: string;
            description: string;
            links: components["schemas"]["Link"][];
        };
        Conformance: {
            conformsTo: string[];
        };
        Total: number;
        Next: string | null;
        MeshList: {
            items: components["schemas"]["Mesh"][];
            total: components["schemas"]["Total"];
            next: components["schemas"]["Next"];
        };
        VolumeList: {
            items: components["schemas"]["Volume"][];
            total: components["schemas"]["Total"];
            next: components["schemas"]["Next"];
        };
        SurfaceList: {
            items: components["schemas"]["Surface"][];
            total: components["schemas"]["Total"];
            next: components["schemas"]["Next"];
        };
        CohortList: {
            items: components["schemas"]["CohortSummary"][];
            total: components["schemas"]["Total"];
            next: components["schemas"]["Next"];
        };
        ModelList: {
            items: components["schemas"]["ModelSummary"][];
            total: components["schemas"]["Total"];
            next: components["schemas"]["Next"];
        };
        JobList: {
            jobs: components["schemas"]["Job"][];
            links: components["schemas"]["Link"][];
            total: components["schemas"]["Total"];
            next?: string;
        };
        ProcessList: {
            processes: components["schemas"]["ProcessSummary"][];
            links: components["schemas"]["Link"][];
            next?: string;
        };
        Mesh: {
            id: string;
            name: string;
            tags?: string[];
            format: string;
            bytes: number;
            vertices: number;
            faces: number;
            created: string;
            report: components["schemas"]["MeshReport"];
            source?: Record<string, unknown> | null;
            mirrored: boolean;
            links: components["schemas"]["Links"];
        };
        Volume: {
            id: string;
            name: string;
            tags?: string[];
            /** @enum {unknown} */
            format: "nifti" | "nrrd";
            bytes: number;
            shape: number[];
            spacing: number[];
            affine: number[][];
            /** @enum {unknown} */
            space: "sform" | "qform" | "RAS" | "LPS" | "LAS" | "other" | "none";
            /** @enum {unknown} */
            units: "millimetres" | "centimetres" | "metres" | "micrometres" | "unknown";
            background: number;
            labelCount: number;
            labels?: {
                value: number;
                voxels: number;
                name: string | null;
            }[];
            created: string;
            links: components["schemas"]["Links"];
        };
        MeshReport: {
            closed: boolean;
            manifold: boolean;
            oriented: boolean;
            components: number;
            eulerCharacteristic: number;
            genus: number | null;
            area: number | null;
            volume: number | null;
            boundingBoxDiagonal: number | null;
            analysable: boolean;
            /** @enum {unknown} */
            route: "area" | null;
            starShaped: {
                value?: boolean;
                center?: (number | null)[];
                margin?: number | null;
                violatingAreaFraction?: number | null;
            } | null;
            repairs: {
                /** @enum {unknown} */
                code?: "duplicate-vertices-merged" | "collapsed-faces-dropped" | "duplicate-faces-dropped" | "folded-faces-dropped" | "touching-vertices-kept-apart" | "unreferenced-vertices-dropped" | "faces-flipped" | "polygons-triangulated" | "face-count-corrected" | "trailing-bytes-ignored";
                count?: number;
            }[];
            problems: {
                code: string;
                count: number;
                first: number | null;
                detail: string;
            }[];
            warnings?: components["schemas"]["Warning"][];
        };
        Surface: {
            id: string;
            name: string;
            tags?: string[];
            lmax: number;
            area: number | null;
            volume: number | null;
            centroid: (number | null)[];
            scale: number;
            /** @enum {unknown} */
            parameterization: "star" | "area" | "given" | "inherited" | "registered";
            /** @enum {unknown} */
            route?: "star" | "area" | "given" | null;
            source: {
                process?: string;
                job?: string | null;
                mesh?: string | null;
            } | null;
            fit: Record<string, unknown> | null;
            starShaped?: Record<string, unknown> | null;
            origin?: number[] | null;
            frame?: {
                of: string;
                mesh?: string | null;
                reflected?: boolean;
                detail: string;
            } | null;
            rotation?: number[][];
            mirrored: boolean;
            smoothing?: number;
            warnings?: components["schemas"]["Warning"][];
            created: string;
            links: components["schemas"]["Links"];
        };
        NewSurface: {
            coefficients?: components["schemas"]["Coefficients"];
            grid?: {
                /** @enum {unknown} */
                kind?: "gauss-legendre" | "equiangular";
                nTheta?: number;
                nPhi?: number;
                xyz?: (number | number[][])[];
            };
            lmax?: number;
            name?: string;
            /** @enum {unknown} */
            scale?: "none" | "unit-area";
            /** @enum {unknown} */
            orientation?: "outward" | "any";
        };
        Coefficients: {
            lmax: number;
            x: number[];
            y: number[];
            z: number[];
        };
        Grid: {
            /** @enum {unknown} */
            kind: "gauss-legendre" | "equiangular";
            nTheta: number;
            nPhi: number;
            theta: number[];
            phi: number[];
            weights: number[];
            values: number[][][];
        };
        CohortMember: {
            id: string;
            label?: string | null;
            subject?: string | null;
            covariates?: {
                [key: string]: number | boolean | string | null;
            } | null;
            time?: number | null;
            /** @enum {unknown} */
            side?: "left" | "right" | null;
            mirror?: boolean;
        };
        NewCohort: {
            name: string;
            members?: components["schemas"]["CohortMember"][];
            from?: string;
            where?: {
                label?: unknown;
                subject?: unknown;
                side?: unknown;
                time?: unknown;
                covariates?: Record<string, unknown>;
            };
        } & (unknown | unknown);
        CohortPatch: {
            name?: string;
            add?: components["schemas"]["CohortMember"][];
            remove?: string[];
            change?: components["schemas"]["CohortMember"][];
        };
        Import: {
            meshes: {
                file: string;
                id: string;
                name: string;
                format: string;
                bytes: number;
                vertices: number;
                faces: number;
                new: boolean;
                analysable: boolean;
                problem: string | null;
                links: components["schemas"]["Links"];
            }[];
            volumes: {
                file: string;
                id: string;
                name: string;
                /** @enum {unknown} */
                format: "nifti" | "nrrd";
                bytes: number;
                shape: number[];
                spacing: number[];
                labelCount: number;
                new: boolean;
                links: components["schemas"]["Links"];
            }[];
            summary: {
                meshes: number;
                volumes: number;
                new: number;
                notAnalysable: number;
                members: number;
                labels?: {
                    [key: string]: number;
                };
                columns?: {
                    name: string;
                    /** @enum {unknown} */
                    kind: "empty" | "text" | "number" | "boolean";
                    missing: number;
                }[];
            };
            warnings: components["schemas"]["Warning"][];
            cohort: components["schemas"]["CohortSummary"] | null;
            restored?: {
                surfaces?: number;
                models?: number;
                jobs?: number;
            };
            refused: {
                file: string;
                code: string;
                detail: string;
            }[];
            refusedCount: number;
        };
        CohortSummary: {
            name: string;
            owner: string | null;
            memberCount: number;
            created: string;
            links: components["schemas"]["Links"];
        };
        Cohort: {
            name: string;
            owner: string | null;
            memberCount: number;
            members?: components["schemas"]["CohortMember"][];
            warnings?: components["schemas"]["Warning"][];
            created: string;
            links: components["schemas"]["Links"];
        };
        ModelSummary: {
            id: string;
            /** @enum {string} */
            kind: "components" | "parts" | "classifier";
            name?: string;
            tags?: string[];
            lmax: number;
            nTheta: number;
            nPhi: number;
            subjects: number;
            components: number;
            totalVariance: number | null;
            madeFrom: {
                process?: string;
                job?: string;
                cohort?: string | null;
                surfaces?: string[];
                contents?: string[];
                mirrored?: boolean[] | null;
            };
            created: string;
            links: components["schemas"]["Links"];
        };
        Model: {
            id: string;
            /** @enum {string} */
            kind: "components" | "parts" | "classifier";
            classifier?: components["schemas"]["Classifier"];
            name?: string;
            tags?: string[];
            parts?: {
                name: string;
                weight: number;
                mean: string;
                size?: number | null;
                relativeEnergy?: number | null;
                variance?: number | null;
                share?: number | null;
            }[];
            positions?: {
                weight?: number;
                mean?: number[][];
            } | null;
            mean: components["schemas"]["Surface"];
            eigenvalues: number[];
            explained: (number | null)[];
            eigenvalueIntervals?: (number[] | null)[];
            explainedIntervals?: (number[] | null)[];
            totalVarianceInterval?: number[] | null;
            cumulative: (number | null)[];
            scores: number[][];
            labels: string[];
            groups?: (string | null)[] | null;
            lmax: number;
            nTheta?: number;
            nPhi?: number;
            subjects: number;
            components: number;
            totalVariance: number | null;
            madeFrom: {
                process?: string;
                job?: string;
                cohort?: string | null;
                surfaces?: string[];
                contents?: string[];
                mirrored?: boolean[] | null;
            };
            created: string;
            links: components["schemas"]["Links"];
        };
        Classifier: {
            /** @enum {string} */
            method: "srnf-gauss" | "srnf-nn";
            classes: string[];
            members: {
                [key: string]: number;
            };
            subjects: {
                [key: string]: number;
            };
            priors: number[];
            template: {
                surface?: string;
                member?: number;
            };
            components: number | null;
            covariance: string | null;
            means?: number[][] | null;
            covariances?: number[][][] | null;
            calibration: {
                slope?: number;
                offsets?: number[];
                targets?: number[];
            };
            nearest?: number[];
            validation: Record<string, unknown>;
        };
        Modes: {
            components: number;
            nTheta: number;
            nPhi: number;
            theta: number[];
            phi: number[];
            weights: number[];
            modes: number[][][][];
        };
        Scores: {
            subjects: number;
            components: number;
            labels: string[];
            groups?: (string | null)[] | null;
            scores: number[][];
        };
        ModelShape: {
            model: string;
            part: string | null;
            coefficients: number[];
            relativeEnergy: number;
            offset: number;
            surface: components["schemas"]["Coefficients"];
        };
        ProcessSummary: {
            id: string;
            title: string;
            description: string;
            version: string;
            jobControlOptions: ("sync-execute" | "async-execute" | "dismiss")[];
            outputTransmission: ("value" | "reference")[];
            links: components["schemas"]["Link"][];
        };
        Process: {
            id: string;
            title: string;
            description: string;
            version: string;
            jobControlOptions: ("sync-execute" | "async-execute" | "dismiss")[];
            outputTransmission: ("value" | "reference")[];
            links: components["schemas"]["Link"][];
            inputs: {
                [key: string]: {
                    title: string;
                    description: string;
                    schema: Record<string, unknown>;
                    minOccurs: number;
                    maxOccurs: number;
                };
            };
            outputs: {
                [key: string]: {
                    title: string;
                    description: string;
                    schema: Record<string, unknown>;
                };
            };
        };
        /** @enum {unknown} */
        JobStatus: "accepted" | "running" | "successful" | "failed" | "dismissed";
        Job: {
            jobID: string;
            id: string;
            /** @enum {string} */
            type: "process";
            name?: string;
            tags?: string[];
            inputs?: Record<string, unknown>;
            processID: string;
            owner?: string;
            status: components["schemas"]["JobStatus"];
            message: string;
            progress?: number;
            estimatedSecondsLeft?: number;
            queuePosition?: number;
            created: string;
            started?: string;
            finished?: string;
            updated: string;
            attempt: number;
            cancelRequested: boolean;
            /** @enum {unknown} */
            cache: "miss" | "hit" | "joined";
            inputsDigest: string;
            numericBuild: string;
            executors?: {
                host: string;
                cpu: string;
                build: string;
                tasks: number;
            }[];
            exception?: components["schemas"]["Problem"];
            links: components["schemas"]["Link"][];
        };
        Labels: {
            name?: string | null;
            tags?: string[] | null;
        };
        OutputWanted: {
            /** @enum {string} */
            transmissionMode?: "value" | "reference";
            format?: {
                /** @enum {string} */
                mediaType?: "application/json";
            };
        };
        Execution: {
            /** @enum {string} */
            response?: "plain" | "document" | "raw";
            outputs?: {
                [key: string]: components["schemas"]["OutputWanted"];
            };
            name?: string | null;
            tags?: string[] | null;
            inputs: components["schemas"]["extractInputs"] | components["schemas"]["encodeInputs"] | components["schemas"]["invertInputs"] | components["schemas"]["geodesicInputs"] | components["schemas"]["registerInputs"] | components["schemas"]["distancesInputs"] | components["schemas"]["meanInputs"] | components["schemas"]["pcaInputs"] | components["schemas"]["modesInputs"] | components["schemas"]["sampleInputs"] | components["schemas"]["projectInputs"] | components["schemas"]["evaluate-modelInputs"] | components["schemas"]["compare-groupsInputs"] | components["schemas"]["shootInputs"] | components["schemas"]["transportInputs"] | components["schemas"]["transferInputs"] | components["schemas"]["classifyInputs"] | components["schemas"]["repairInputs"] | components["schemas"]["mirrorInputs"] | components["schemas"]["regressInputs"] | components["schemas"]["trainInputs"] | components["schemas"]["predictInputs"] | components["schemas"]["scoreInputs"] | components["schemas"]["reportInputs"] | components["schemas"]["changeInputs"] | components["schemas"]["asymmetryInputs"] | components["schemas"]["pca-partsInputs"] | components["schemas"]["trajectoriesInputs"] | components["schemas"]["neighboursInputs"] | components["schemas"]["classify-partsInputs"] | components["schemas"]["train-partsInputs"];
        };
        Estimate: {
            estimatedSeconds: number | null;
            estimatedBytes: number | null;
            memoryLimit: number;
        };
        Any: {
            [key: string]: unknown;
        } | components["schemas"]["Any"][] | (string | null) | number | boolean;
        FramedResults: {
            [key: string]: unknown;
        } | components["schemas"]["Any"][] | (string | null) | number | boolean;
        Results: components["schemas"]["extractOutputs"] | components["schemas"]["encodeOutputs"] | components["schemas"]["invertOutputs"] | components["schemas"]["geodesicOutputs"] | components["schemas"]["registerOutputs"] | components["schemas"]["distancesOutputs"] | components["schemas"]["meanOutputs"] | components["schemas"]["pcaOutputs"] | components["schemas"]["modesOutputs"] | components["schemas"]["sampleOutputs"] | components["schemas"]["projectOutputs"] | components["schemas"]["evaluate-modelOutputs"] | components["schemas"]["compare-groupsOutputs"] | components["schemas"]["shootOutputs"] | components["schemas"]["transportOutputs"] | components["schemas"]["transferOutputs"] | components["schemas"]["classifyOutputs"] | components["schemas"]["repairOutputs"] | components["schemas"]["mirrorOutputs"] | components["schemas"]["regressOutputs"] | components["schemas"]["trainOutputs"] | components["schemas"]["predictOutputs"] | components["schemas"]["scoreOutputs"] | components["schemas"]["reportOutputs"] | components["schemas"]["changeOutputs"] | components["schemas"]["asymmetryOutputs"] | components["schemas"]["pca-partsOutputs"] | components["schemas"]["trajectoriesOutputs"] | components["schemas"]["neighboursOutputs"] | components["schemas"]["classify-partsOutputs"] | components["schemas"]["train-partsOutputs"];
        extractInputs: {
            volume: string;
            labels: number[];
            smoothing?: number;
            /** @enum {unknown} */
            topology?: "correct" | "refuse";
        };
        extractOutputs: {
            mesh?: Record<string, unknown>;
            changed?: Record<string, unknown>;
            volumeChange?: number;
            volume?: number;
            voxels?: number;
            offset?: number;
            smoothing?: number;
            crossings?: number;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        encodeInputs: {
            mesh?: string | null;
            cohort?: string | null;
            lmax?: number;
            /** @enum {unknown} */
            parameterization?: "auto" | "star" | "area" | "given";
            sphere?: string | null;
            center?: "auto" | number[];
            mirror?: boolean;
            /** @enum {unknown} */
            scale?: "unit-area" | "none";
            smoothing?: number;
        };
        encodeOutputs: {
            cohort?: string;
            encoded?: number;
            failed?: number;
            rows?: Record<string, unknown>[];
            surface?: Record<string, unknown>;
            fit?: Record<string, unknown>;
            /** @enum {unknown} */
            route?: "star" | "area" | "given";
            reason?: string;
            starShaped?: Record<string, unknown>;
            distortion?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        invertInputs: {
            srnf: {
                surface: string;
            } | {
                lmax: number;
                nTheta: number;
                nPhi: number;
                q: (number | number[][])[];
            };
            initial?: ("auto" | "sphere" | "star") | string;
            /** @enum {unknown} */
            method?: "auto" | "gauss-newton" | "spectral" | "gradient" | "closed-form";
            lmax?: number;
            tolerance?: number;
            maxIterations?: number | null;
            /** @enum {unknown} */
            certificate?: "auto" | "none" | "require";
        };
        invertOutputs: {
            surface?: Record<string, unknown>;
            energy?: number;
            relativeEnergy?: number;
            gradientNorm?: number | null;
            iterations?: number;
            transforms?: number;
            converged?: boolean;
            /** @enum {unknown} */
            stopped?: "tolerance" | "stationary" | "maxIterations" | "closedForm";
            method?: string;
            history?: Record<string, unknown>[];
            certificate?: Record<string, unknown> | null;
            smallestSingularValue?: number | null;
            surfaceErrorBound?: number | null;
            surfaceError?: number | null;
            flipped?: boolean;
            closedForm?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        geodesicInputs: {
            from: string;
            to: string;
            steps?: number;
            register?: boolean;
            symmetric?: boolean;
            /** @enum {unknown} */
            method?: "srnf" | "closed-form" | "linear" | "pullback";
            landmarks?: {
                from: (number | number[])[];
                to: (number | number[])[];
                weight?: "exact" | number;
                heldOut?: number[];
            } | null;
            /** @enum {unknown} */
            handedness?: "check" | "ignore";
        };
        geodesicOutputs: {
            surfaces?: Record<string, unknown>[];
            times?: number[];
            distance?: number;
            lineLength?: number;
            length?: number;
            energies?: Record<string, unknown>;
            relativeEnergies?: Record<string, unknown>;
            transforms?: number;
            pullback?: Record<string, unknown> | null;
            registration?: Record<string, unknown> | null;
            bridged?: boolean;
            landmarks?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        registerInputs: {
            template: string;
            moving: string;
            rotation?: boolean;
            reparameterization?: boolean;
            degree?: number;
            penalty?: ("default" | "none") | {
                jacobian?: number;
                displacement?: number;
            };
            /** @enum {unknown} */
            start?: "tournament" | "rigid" | "identity";
            commonPose?: boolean;
            symmetric?: boolean;
            exact?: boolean;
            landmarks?: {
                template: (number | number[])[];
                moving: (number | number[])[];
                weight?: "exact" | number;
                heldOut?: number[];
            } | null;
            /** @enum {unknown} */
            handedness?: "check" | "ignore";
        };
        registerOutputs: {
            surface?: Record<string, unknown>;
            rotation?: (number | null)[][];
            distance?: number | null;
            distanceBefore?: number | null;
            objective?: number | null;
            minJacobian?: number | null;
            maxJacobian?: number | null;
            inverseConsistency?: number | null;
            ambiguity?: Record<string, unknown>;
            truncationError?: number | null;
            iterations?: number;
            converged?: boolean;
            /** @enum {unknown} */
            stopped?: "direct" | "tolerance" | "stationary" | "stepRefused" | "maxIterations";
            symmetric?: boolean;
            note?: string;
            bridged?: boolean;
            registration?: Record<string, unknown>;
            landmarks?: Record<string, unknown> | null;
            warp?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        distancesInputs: {
            surfaces?: string[];
            cohort?: string | null;
            mixedRoutes?: boolean;
            register?: boolean;
            /** @enum {unknown} */
            metric?: "srnf" | "harmonic" | "srm" | "icp";
            /** @enum {unknown} */
            handedness?: "check" | "ignore";
            lmax?: number;
        };
        distancesOutputs: {
            labels?: string[];
            groups?: (string | null)[] | null;
            matrix?: (number | null)[][];
            lmax?: number;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        meanInputs: {
            surfaces?: string[];
            cohort?: string | null;
            mixedRoutes?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            landmarks?: {
                vertices?: number[];
                points?: (number | number[])[][];
                weight?: "exact" | number;
                heldOut?: number[];
            } | null;
            /** @enum {unknown} */
            method?: "srnf" | "pullback";
        };
        meanOutputs: {
            surface?: Record<string, unknown>;
            pullback?: Record<string, unknown> | null;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            labels?: string[];
            groups?: (string | null)[] | null;
            distances?: (number | null)[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            landmarks?: Record<string, unknown> | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        pcaInputs: {
            surfaces?: string[];
            cohort?: string | null;
            mixedRoutes?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            landmarks?: {
                vertices?: number[];
                points?: (number | number[])[][];
                weight?: "exact" | number;
                heldOut?: number[];
            } | null;
            /** @enum {unknown} */
            method?: "srnf";
            components?: number | null;
        };
        pcaOutputs: {
            model?: Record<string, unknown>;
            compactness?: Record<string, unknown>[];
            eigenvalueBound?: number;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            labels?: string[];
            groups?: (string | null)[] | null;
            distances?: (number | null)[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            landmarks?: Record<string, unknown> | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        modesInputs: {
            model: string;
            mode?: number;
            coefficients?: number[];
        };
        modesOutputs: {
            surfaces?: Record<string, unknown>[];
            parts?: string[] | null;
            coefficients?: number[];
            standardDeviation?: number;
            relativeEnergy?: (number | null)[];
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        sampleInputs: {
            model: string;
            count?: number;
            seed?: number;
            components?: number;
        };
        sampleOutputs: {
            surfaces?: Record<string, unknown>[];
            parts?: string[] | null;
            scores?: (number | null)[][];
            relativeEnergy?: (number | null)[];
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        projectInputs: {
            model: string;
            surface?: string | null;
            parts?: {
                [key: string]: string;
            } | null;
            /** @enum {unknown} */
            handedness?: "check" | "ignore";
        };
        projectOutputs: {
            scores?: (number | null)[];
            trainingSubject?: boolean;
            residual?: number | null;
            distance?: number | null;
            distanceBefore?: number | null;
            mahalanobis?: number | null;
            typicality?: Record<string, unknown> | null;
            parts?: Record<string, unknown>[] | null;
            position?: Record<string, unknown> | null;
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        "evaluate-modelInputs": {
            model?: string | null;
            surfaces?: string[] | null;
            cohort?: string | null;
            mixedRoutes?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            /** @enum {unknown} */
            method?: "srnf";
            components?: number | null;
            samples?: number;
            seed?: number;
        };
        "evaluate-modelOutputs": {
            members?: number;
            subjects?: number;
            compactness?: Record<string, unknown>[];
            generalisation?: Record<string, unknown>[];
            specificity?: Record<string, unknown>[];
            refitted?: string[];
            shared?: string[];
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        "compare-groupsInputs": {
            cohort: string;
            mixedRoutes?: boolean;
            covariates?: string[];
            permutations?: number;
            seed?: number;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            /** @enum {unknown} */
            method?: "srnf";
        };
        "compare-groupsOutputs": {
            pValue?: number;
            members?: number;
            subjects?: number;
            groupSizes?: Record<string, unknown>;
            pValueIsFloor?: boolean;
            pValueInterval?: (number | null)[];
            leastSignificanceIsFloor?: boolean;
            leastSignificanceInterval?: (number | null)[];
            distance?: number;
            distanceInterval?: (number | null)[];
            spreads?: number[];
            leastSignificance?: number;
            leastFdr?: number;
            largestEffect?: number;
            groups?: string[];
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            /** @enum {unknown} */
            level?: "exact" | "asymptotic";
            regressedOut?: string[];
            map?: Record<string, unknown>;
            surface?: Record<string, unknown>;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        shootInputs: {
            surface: string;
            velocity: {
                toward: string;
            } | {
                coefficients: Record<string, unknown>;
            } | {
                srnf: Record<string, unknown>;
            };
            times?: number[];
            register?: boolean;
            commonPose?: boolean;
            /** @enum {unknown} */
            method?: "srnf" | "pullback";
        };
        shootOutputs: {
            surfaces?: Record<string, unknown>[];
            times?: number[];
            energies?: (number | null)[];
            relativeEnergies?: (number | null)[];
            transforms?: number;
            registration?: Record<string, unknown> | null;
            pullback?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        transportInputs: {
            from: string;
            to: string;
            vector: {
                toward: string;
            } | {
                coefficients: Record<string, unknown>;
            } | {
                srnf: Record<string, unknown>;
            };
            register?: boolean;
            commonPose?: boolean;
            /** @enum {unknown} */
            method?: "srnf" | "pullback";
        };
        transportOutputs: {
            vector?: Record<string, unknown>;
            surface?: Record<string, unknown>;
            norm?: number;
            residual?: number;
            iterations?: number;
            energy?: number;
            relativeEnergy?: number;
            transforms?: number;
            pullback?: Record<string, unknown> | null;
            registration?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        transferInputs: {
            source: string;
            deformed: string;
            target: string;
            /** @enum {unknown} */
            size?: "ratio" | "absolute";
            register?: boolean;
            commonPose?: boolean;
            /** @enum {unknown} */
            method?: "srnf" | "pullback";
        };
        transferOutputs: {
            surface?: Record<string, unknown>;
            sizeRatio?: number;
            energy?: number;
            relativeEnergy?: number;
            transforms?: number;
            pullback?: Record<string, unknown> | null;
            registration?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        classifyInputs: {
            cohort: string;
            mixedRoutes?: boolean;
            method?: ("srnf-gauss" | "srnf-nn" | "srm-gauss" | "srm-nn" | "harmonic-nn" | "icp-nn" | "spharm-pdm") | ("srnf-gauss" | "srnf-nn" | "srm-gauss" | "srm-nn" | "harmonic-nn" | "icp-nn" | "spharm-pdm")[];
            components?: "auto" | number;
            /** @enum {unknown} */
            covariance?: "auto" | "pooled" | "class";
            /** @enum {unknown} */
            validation?: "loo";
            /** @enum {unknown} */
            scale?: "shape" | "shape-and-size";
            covariates?: string[];
            sizeWeight?: number;
            permutations?: number;
            seed?: number;
            /** @enum {unknown} */
            refit?: "fold" | "shared";
            commonPose?: boolean;
            lmax?: number;
        };
        classifyOutputs: {
            methods?: Record<string, unknown>;
            comparisons?: Record<string, unknown>[];
            features?: string[];
            members?: number;
            subjects?: number;
            chance?: number;
            majorityRate?: number;
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            classes?: string[];
            lmax?: number;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        repairInputs: {
            mesh: string;
            orient?: boolean;
            islands?: boolean;
            duplicates?: boolean;
            degenerate?: boolean;
            merge?: number;
            holes?: number;
            handles?: number;
        };
        repairOutputs: {
            mesh?: Record<string, unknown>;
            changes?: Record<string, unknown>[];
            refused?: Record<string, unknown>[];
            distance?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        mirrorInputs: {
            mesh?: string | null;
            surface?: string | null;
            plane?: "sagittal" | number[];
        };
        mirrorOutputs: {
            mesh?: Record<string, unknown> | null;
            surface?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        regressInputs: {
            cohort: string;
            mixedRoutes?: boolean;
            formula: string;
            at?: Record<string, unknown>[];
            permutations?: number;
            bootstraps?: number;
            seed?: number;
            fields?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            /** @enum {unknown} */
            method?: "srnf";
        };
        regressOutputs: {
            formula?: string;
            terms?: Record<string, unknown>[];
            model?: Record<string, unknown>;
            pairwise?: Record<string, unknown>[];
            coefficients?: Record<string, unknown>[];
            predictions?: Record<string, unknown>[];
            residualVariance?: number;
            residualVarianceInterval?: (number | null)[];
            variance?: number;
            varianceInterval?: (number | null)[];
            residualDegreesOfFreedom?: number;
            members?: number;
            subjects?: number;
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            bootstraps?: number;
            surface?: Record<string, unknown>;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        trainInputs: {
            cohort: string;
            mixedRoutes?: boolean;
            /** @enum {unknown} */
            method?: "srnf-gauss" | "srnf-nn";
            components?: "auto" | number;
            /** @enum {unknown} */
            covariance?: "auto" | "pooled" | "class";
            /** @enum {unknown} */
            scale?: "shape" | "shape-and-size";
            covariates?: string[];
            sizeWeight?: number;
            /** @enum {unknown} */
            priors?: "cohort" | "equal";
            commonPose?: boolean;
            lmax?: number;
        };
        trainOutputs: {
            model?: Record<string, unknown>;
            members?: number;
            relativeEnergy?: number | null;
            validation?: Record<string, unknown>;
            perSubject?: Record<string, unknown>[];
            classes?: string[];
            features?: string[];
            refitted?: string[];
            subjects?: number;
            lmax?: number;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        predictInputs: {
            model: string;
            surfaces?: string[];
            cohort?: string | null;
            parts?: ({
                [key: string]: string;
            } | null) | {
                [key: string]: string;
            }[];
            by?: string | null;
            mixedRoutes?: boolean;
            priors?: {
                [key: string]: number;
            } | null;
            covariates?: {
                [key: string]: number | boolean;
            }[] | null;
            /** @enum {unknown} */
            handedness?: "check" | "ignore";
        };
        predictOutputs: {
            predictions?: Record<string, unknown>[];
            classes?: string[];
            priors?: Record<string, unknown>;
            method?: string;
            assessment?: Record<string, unknown> | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        scoreInputs: {
            model: string;
            surface?: string | null;
            parts?: {
                [key: string]: string;
            } | null;
            formula?: string | null;
            /** @default {} */
            covariates: Record<string, unknown>;
            map?: boolean;
            calibration?: boolean;
            /** @enum {unknown} */
            handedness?: "check" | "ignore";
        };
        scoreOutputs: {
            percentile?: number;
            percentileInterval?: number[];
            pValue?: number;
            asOdd?: number;
            subjects?: number;
            mahalanobis?: number;
            residual?: number;
            distance?: number;
            components?: number;
            ranks?: Record<string, unknown>;
            zMap?: Record<string, unknown> | null;
            parts?: Record<string, unknown>[] | null;
            position?: Record<string, unknown> | null;
            calibration?: Record<string, unknown> | null;
            typicality?: Record<string, unknown> | null;
            trainingSubject?: boolean;
            at?: Record<string, unknown> | null;
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        reportInputs: {
            jobs?: string[] | null;
            cohort?: string | null;
            title?: string;
            modes?: number;
            resolution?: number;
        };
        reportOutputs: {
            html?: string;
            bytes?: number;
            shapes?: number;
            sections?: Record<string, unknown>[];
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        changeInputs: {
            cohort: string;
            mixedRoutes?: boolean;
            from?: number | null;
            to?: number | null;
            /** @enum {unknown} */
            scale?: "shape-and-size" | "shape";
            permutations?: number;
            bootstraps?: number;
            seed?: number;
            fields?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            /** @enum {unknown} */
            method?: "srnf";
        };
        changeOutputs: {
            change?: {
                value: number | null;
                interval: number[];
            };
            variation?: {
                value: number | null;
                interval: number[];
            };
            pValue?: number;
            pValueIsFloor?: boolean;
            pValueInterval?: (number | null)[];
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            leastSignificance?: number;
            leastSignificanceIsFloor?: boolean;
            leastSignificanceInterval?: (number | null)[];
            leastFdr?: number;
            largestEffect?: number;
            largestConfidence?: number;
            distance?: number;
            distanceInterval?: (number | null)[];
            individual?: {
                value: number | null;
                interval: number[];
            };
            share?: {
                value: number | null;
                interval: number[];
            };
            perSubject?: {
                subject: string;
                sizes: number[];
                length: number | null;
                deviation: number | null;
                along: number | null;
                distance: number | null;
                field?: (number | null)[];
            }[];
            surface?: Record<string, unknown>;
            subjects?: number;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        asymmetryInputs: {
            cohort: string;
            mixedRoutes?: boolean;
            /** @enum {unknown} */
            scale?: "shape-and-size" | "shape";
            permutations?: number;
            bootstraps?: number;
            seed?: number;
            fields?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            /** @enum {unknown} */
            method?: "srnf";
        };
        asymmetryOutputs: {
            directional?: {
                value: number | null;
                interval: number[];
            };
            fluctuating?: {
                value: number | null;
                interval: number[];
            };
            replicates?: Record<string, unknown> | null;
            pValue?: number;
            pValueIsFloor?: boolean;
            pValueInterval?: (number | null)[];
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            leastSignificance?: number;
            leastSignificanceIsFloor?: boolean;
            leastSignificanceInterval?: (number | null)[];
            leastFdr?: number;
            largestEffect?: number;
            largestConfidence?: number;
            distance?: number;
            distanceInterval?: (number | null)[];
            individual?: {
                value: number | null;
                interval: number[];
            };
            share?: {
                value: number | null;
                interval: number[];
            };
            perSubject?: {
                subject: string;
                sizes: number[];
                length: number | null;
                deviation: number | null;
                along: number | null;
                distance: number | null;
                field?: (number | null)[];
            }[];
            surface?: Record<string, unknown>;
            subjects?: number;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        "pca-partsInputs": {
            cohort: string;
            mixedRoutes?: boolean;
            by?: string;
            /** @default {} */
            weights: {
                [key: string]: number;
            };
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            components?: number | null;
            modes?: number;
            relativePose?: boolean;
            poseWeight?: number;
        };
        "pca-partsOutputs": {
            model?: Record<string, unknown>;
            parts?: Record<string, unknown>[];
            subjects?: string[];
            groups?: (string | null)[];
            eigenvalues?: number[];
            explained?: number[];
            cumulative?: number[];
            totalVariance?: number;
            scores?: (number | null)[][];
            shares?: (number | null)[][];
            modes?: Record<string, unknown>[];
            positions?: Record<string, unknown> | null;
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        trajectoriesInputs: {
            cohort: string;
            mixedRoutes?: boolean;
            formula?: string | null;
            at?: Record<string, unknown>[];
            /** @enum {unknown} */
            scale?: "shape-and-size" | "shape";
            permutations?: number;
            bootstraps?: number;
            seed?: number;
            fields?: boolean;
            register?: boolean;
            commonPose?: boolean;
            tolerance?: number;
            lmax?: number;
            maxIterations?: number;
            /** @enum {unknown} */
            method?: "srnf";
        };
        trajectoriesOutputs: {
            slope?: Record<string, unknown>;
            reference?: number;
            weighted?: boolean;
            within?: number | null;
            between?: number;
            withinInterval?: number[] | null;
            betweenInterval?: (number | null)[];
            perSubject?: Record<string, unknown>[];
            formula?: string | null;
            terms?: Record<string, unknown>[];
            model?: Record<string, unknown> | null;
            pairwise?: Record<string, unknown>[];
            coefficients?: Record<string, unknown>[];
            predictions?: Record<string, unknown>[];
            residualVariance?: number;
            residualVarianceInterval?: (number | null)[];
            variance?: number;
            varianceInterval?: (number | null)[];
            residualDegreesOfFreedom?: number;
            members?: number;
            subjects?: number;
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            bootstraps?: number;
            surface?: Record<string, unknown>;
            iterations?: number;
            converged?: boolean;
            history?: Record<string, unknown>[];
            relativeEnergy?: number | null;
            seconds?: number | null;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        neighboursInputs: {
            surfaces?: string[];
            cohort?: string | null;
            mixedRoutes?: boolean;
            k?: number;
            lmax?: number;
        };
        neighboursOutputs: {
            labels?: string[];
            groups?: (string | null)[] | null;
            indices?: (number | null)[][];
            distances?: (number | null)[][];
            pairs?: Record<string, unknown>;
            lmax?: number;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        "classify-partsInputs": {
            cohort: string;
            mixedRoutes?: boolean;
            by?: string;
            /** @default {} */
            weights: {
                [key: string]: number;
            };
            method?: ("srnf-gauss" | "srnf-nn" | "srm-gauss" | "srm-nn" | "harmonic-nn" | "icp-nn" | "spharm-pdm") | ("srnf-gauss" | "srnf-nn" | "srm-gauss" | "srm-nn" | "harmonic-nn" | "icp-nn" | "spharm-pdm")[];
            components?: "auto" | number;
            /** @enum {unknown} */
            covariance?: "auto" | "pooled" | "class";
            /** @enum {unknown} */
            scale?: "shape" | "shape-and-size";
            covariates?: string[];
            sizeWeight?: number;
            permutations?: number;
            seed?: number;
            commonPose?: boolean;
            relativePose?: boolean;
            poseWeight?: number;
            lmax?: number;
        };
        "classify-partsOutputs": {
            methods?: Record<string, unknown>;
            comparisons?: Record<string, unknown>[];
            parts?: Record<string, unknown>[];
            features?: string[];
            subjects?: number;
            chance?: number;
            majorityRate?: number;
            permutations?: number;
            relabellings?: number | null;
            exact?: boolean | null;
            classes?: string[];
            lmax?: number;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown>;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
        "train-partsInputs": {
            cohort: string;
            mixedRoutes?: boolean;
            by?: string;
            /** @default {} */
            weights: {
                [key: string]: number;
            };
            relativePose?: boolean;
            poseWeight?: number;
            /** @enum {unknown} */
            method?: "srnf-gauss" | "srnf-nn";
            components?: "auto" | number;
            /** @enum {unknown} */
            covariance?: "auto" | "pooled" | "class";
            /** @enum {unknown} */
            scale?: "shape" | "shape-and-size";
            covariates?: string[];
            sizeWeight?: number;
            /** @enum {unknown} */
            priors?: "cohort" | "equal";
            commonPose?: boolean;
            lmax?: number;
        };
        "train-partsOutputs": {
            model?: Record<string, unknown>;
            parts?: Record<string, unknown>[];
            positions?: Record<string, unknown> | null;
            validation?: Record<string, unknown>;
            perSubject?: Record<string, unknown>[];
            classes?: string[];
            features?: string[];
            refitted?: string[];
            subjects?: number;
            lmax?: number;
            bridged?: boolean;
            bridgedSurfaces?: string[];
            registration?: Record<string, unknown> | null;
            inputs?: Record<string, unknown>;
            warnings?: {
                code: string;
                detail: string;
                figures?: Record<string, unknown>;
            }[];
            numericBuild?: string;
        };
    };
    responses: {
        NotModified: {
            headers: {
                ETag: components["headers"]["ETag"];
                [name: string]: unknown;
            };
            content?: never;
        };
        References: {
            headers: {
                Link: components["headers"]["Link"];
                [name: string]: unknown;
            };
            content?: never;
        };
        PreconditionFailed: {
            headers: {
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        Problem: {
            headers: {
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        InUse: {
            headers: {
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        Unauthorized: {
            headers: {
                "WWW-Authenticate": components["headers"]["Challenge"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        Forbidden: {
            headers: {
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
        TooManyRequests: {
            headers: {
                "Retry-After": components["headers"]["RetryAfter"];
                [name: string]: unknown;
            };
            content: {
                "application/problem+json": components["schemas"]["Problem"];
            };
        };
    };
    parameters: {
        UiFile: string;
        MeshId: string;
        VolumeId: string;
        SurfaceId: string;
        CohortName: string;
        Owner: string;
        MembersLimit: number;
        MemberLabel: string;
        MemberSubject: string;
        MemberSide: "left" | "right" | "";
        ImportCohort: string;
        ImportPartial: boolean;
        ContentOwner: string;
        Cascade: boolean;
        ModelId: string;
        TableFormat: "json" | "csv" | "npy";
        Condensed: boolean;
        JobId: string;
        ProcessId: "extract" | "encode" | "invert" | "geodesic" | "register" | "distances" | "mean" | "pca" | "modes" | "sample" | "project" | "evaluate-model" | "compare-groups" | "shoot" | "transport" | "transfer" | "classify" | "repair" | "mirror" | "regress" | "train" | "predict" | "score" | "report" | "change" | "asymmetry" | "pca-parts" | "trajectories" | "neighbours" | "classify-parts" | "train-parts";
        Limit: number;
        Cursor: string;
        ListSort: "created" | "-created" | "name" | "-name";
        MadeSort: "created" | "-created" | "name" | "-name" | "process" | "-process";
        JobSort: "created" | "-created" | "name" | "-name" | "process" | "-process" | "status" | "-status";
        ListName: string;
        ListTag: string;
        ListSince: string;
        ListUntil: string;
        ListProcess: string;
        ListCohort: string;
        ListMesh: string;
        JobType: string[];
        ProcessIDs: string[];
        JobStatus: components["schemas"]["JobStatus"][];
        Datetime: string;
        MinDuration: number;
        MaxDuration: number;
        MeshFormat: "ply" | "obj" | "off" | "stl" | "vtk" | "vtp" | "gii" | "freesurfer" | "freesurfer-ascii" | "glb" | "gltf" | "mz3" | "byu" | "mni-obj" | "gmsh" | "brainvisa";
        Name: string;
        SurfaceLmax: number;
        SurfaceKind: "gauss-legendre" | "equiangular";
        SurfaceScale: "none" | "unit-area";
        SurfaceOrientation: "outward" | "any";
        Response: "plain" | "document" | "raw";
        OutputNames: string[];
        OutputName: string;
        ArrayFormat: "json" | "npy";
        GridKind: "gauss-legendre" | "equiangular";
        GridTheta: number;
        GridPhi: number;
        After: string;
        Coefficients: string;
        ModelPart: string;
        ShapeFormat: "json" | "ply" | "obj" | "stl" | "vtk" | "vtp" | "gii" | "glb" | "positions";
        ViewFormat: "ply" | "obj" | "stl" | "vtk" | "vtp" | "gii" | "glb" | "positions";
        ExportFormat: "ply" | "obj" | "stl" | "vtk" | "vtp" | "gii" | "glb" | "positions";
        Space: "normalized" | "original";
        Resolution: number;
        IfMatch: string;
        IfNoneMatch: string;
        TaskId: string;
        ContentDigest: string;
        LeaseSecret: string;
        ResultDigest: string;
        Bar: string;
        WorkerHost: string;
        WorkerCpu: string;
        WorkerBuild: string;
        Ticket: string;
        LastEventId: string;
        Prefer: string;
        IdempotencyKey: string;
    };
    requestBodies: never;
    headers: {
        Deleted: string;
        Location: string;
        Link: string;
        ETag: string;
        PreferenceApplied: string;
        CacheStatus: string;
        RetryAfter: string;
        Challenge: string;
    };
    pathItems: never;
}
export type $defs = Record<string, never>;
export interface operations {
    landing: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["LandingPage"];
                };
            };
            302: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    dashboardRedirect: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            302: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    dashboard: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "*/*": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    dashboardFile: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                file: components["parameters"]["UiFile"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "*/*": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    exampleFile: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                file: components["parameters"]["UiFile"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "*/*": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    health: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Object"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    readiness: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Readiness"];
                };
            };
            503: {
                headers: {
                    "Retry-After": components["headers"]["RetryAfter"];
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    metrics: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "text/plain; version=0.0.4; charset=utf-8": components["schemas"]["Text"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    base: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["LandingPage"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    conformance: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Conformance"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    version: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Version"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    caller: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Caller"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listUsers: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Users"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    description: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/yaml": components["schemas"]["Text"];
                };
            };
            304: components["responses"]["NotModified"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    description30: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/vnd.oai.openapi+json;version=3.0": components["schemas"]["Object"];
                };
            };
            304: components["responses"]["NotModified"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    docs: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "text/html; charset=utf-8": components["schemas"]["Text"];
                };
            };
            304: components["responses"]["NotModified"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listMeshes: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
                sort?: components["parameters"]["MadeSort"];
                name?: components["parameters"]["ListName"];
                since?: components["parameters"]["ListSince"];
                until?: components["parameters"]["ListUntil"];
                tag?: components["parameters"]["ListTag"];
                process?: components["parameters"]["ListProcess"];
                cohort?: components["parameters"]["ListCohort"];
                mesh?: components["parameters"]["ListMesh"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["MeshList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    createMesh: {
        parameters: {
            query?: {
                format?: components["parameters"]["MeshFormat"];
                name?: components["parameters"]["Name"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/octet-stream": components["schemas"]["Bytes"];
                "text/plain": components["schemas"]["Bytes"];
                "application/x-www-form-urlencoded": components["schemas"]["Bytes"];
                "model/ply": components["schemas"]["Bytes"];
                "model/obj": components["schemas"]["Bytes"];
                "model/off": components["schemas"]["Bytes"];
                "model/stl": components["schemas"]["Bytes"];
                "model/gltf-binary": components["schemas"]["Bytes"];
                "model/gltf+json": components["schemas"]["Bytes"];
                "application/x-vtp": components["schemas"]["Bytes"];
                "application/gzip": components["schemas"]["Bytes"];
                "application/x-vtk": components["schemas"]["Bytes"];
                "application/x-gifti+xml": components["schemas"]["Bytes"];
                "application/x-freesurfer-surface": components["schemas"]["Bytes"];
            };
        };
        responses: {
            200: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Mesh"];
                };
            };
            201: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Mesh"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getMesh: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["MeshId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Mesh"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    deleteMesh: {
        parameters: {
            query?: {
                cascade?: components["parameters"]["Cascade"];
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["MeshId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    "Srnfd-Deleted": components["headers"]["Deleted"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: components["responses"]["InUse"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    labelMesh: {
        parameters: {
            query?: {
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["MeshId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/merge-patch+json": components["schemas"]["Labels"];
                "application/json": components["schemas"]["Labels"];
            };
        };
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Mesh"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getMeshContent: {
        parameters: {
            query?: {
                format?: components["parameters"]["ExportFormat"];
            };
            header?: never;
            path: {
                id: components["parameters"]["MeshId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "*/*": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listVolumes: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
                sort?: components["parameters"]["ListSort"];
                name?: components["parameters"]["ListName"];
                since?: components["parameters"]["ListSince"];
                until?: components["parameters"]["ListUntil"];
                tag?: components["parameters"]["ListTag"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["VolumeList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    createVolume: {
        parameters: {
            query?: {
                name?: components["parameters"]["Name"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/octet-stream": components["schemas"]["Bytes"];
                "application/x-www-form-urlencoded": components["schemas"]["Bytes"];
                "application/gzip": components["schemas"]["Bytes"];
                "application/x-gzip": components["schemas"]["Bytes"];
                "application/x-nifti": components["schemas"]["Bytes"];
                "application/x-nrrd": components["schemas"]["Bytes"];
                "text/plain": components["schemas"]["Bytes"];
            };
        };
        responses: {
            200: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Volume"];
                };
            };
            201: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Volume"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getVolume: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["VolumeId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Volume"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    deleteVolume: {
        parameters: {
            query?: {
                cascade?: components["parameters"]["Cascade"];
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["VolumeId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    "Srnfd-Deleted": components["headers"]["Deleted"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: components["responses"]["InUse"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    labelVolume: {
        parameters: {
            query?: {
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["VolumeId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/merge-patch+json": components["schemas"]["Labels"];
                "application/json": components["schemas"]["Labels"];
            };
        };
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Volume"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getVolumeContent: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["VolumeId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "*/*": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listSurfaces: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
                sort?: components["parameters"]["MadeSort"];
                name?: components["parameters"]["ListName"];
                since?: components["parameters"]["ListSince"];
                until?: components["parameters"]["ListUntil"];
                tag?: components["parameters"]["ListTag"];
                process?: components["parameters"]["ListProcess"];
                cohort?: components["parameters"]["ListCohort"];
                mesh?: components["parameters"]["ListMesh"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SurfaceList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    createSurface: {
        parameters: {
            query?: {
                name?: components["parameters"]["Name"];
                lmax?: components["parameters"]["SurfaceLmax"];
                kind?: components["parameters"]["SurfaceKind"];
                scale?: components["parameters"]["SurfaceScale"];
                orientation?: components["parameters"]["SurfaceOrientation"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["NewSurface"];
                "application/x-npy": components["schemas"]["Bytes"];
                "application/octet-stream": components["schemas"]["Bytes"];
            };
        };
        responses: {
            200: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Surface"];
                };
            };
            201: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Surface"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getSurface: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Surface"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    deleteSurface: {
        parameters: {
            query?: {
                cascade?: components["parameters"]["Cascade"];
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    "Srnfd-Deleted": components["headers"]["Deleted"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: components["responses"]["InUse"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    labelSurface: {
        parameters: {
            query?: {
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/merge-patch+json": components["schemas"]["Labels"];
                "application/json": components["schemas"]["Labels"];
            };
        };
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Surface"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getCoefficients: {
        parameters: {
            query?: {
                format?: components["parameters"]["ArrayFormat"];
            };
            header?: never;
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Coefficients"];
                    "application/x-npy": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getSrnf: {
        parameters: {
            query?: {
                format?: components["parameters"]["ArrayFormat"];
                kind?: components["parameters"]["GridKind"];
                nTheta?: components["parameters"]["GridTheta"];
                nPhi?: components["parameters"]["GridPhi"];
            };
            header?: never;
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Grid"];
                    "application/x-npy": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getGrid: {
        parameters: {
            query?: {
                format?: components["parameters"]["ArrayFormat"];
                kind?: components["parameters"]["GridKind"];
                nTheta?: components["parameters"]["GridTheta"];
                nPhi?: components["parameters"]["GridPhi"];
            };
            header?: never;
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Grid"];
                    "application/x-npy": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getSurfaceMesh: {
        parameters: {
            query?: {
                format?: components["parameters"]["ViewFormat"];
                resolution?: components["parameters"]["Resolution"];
                space?: components["parameters"]["Space"];
            };
            header?: never;
            path: {
                id: components["parameters"]["SurfaceId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "model/ply": components["schemas"]["Bytes"];
                    "model/obj": components["schemas"]["Bytes"];
                    "model/stl": components["schemas"]["Bytes"];
                    "application/x-vtk": components["schemas"]["Bytes"];
                    "application/x-vtp": components["schemas"]["Bytes"];
                    "application/x-gifti+xml": components["schemas"]["Bytes"];
                    "model/gltf-binary": components["schemas"]["Bytes"];
                    "application/octet-stream": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    createImport: {
        parameters: {
            query?: {
                cohort?: components["parameters"]["ImportCohort"];
                partial?: components["parameters"]["ImportPartial"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/zip": components["schemas"]["Bytes"];
                "application/x-tar": components["schemas"]["Bytes"];
                "application/gzip": components["schemas"]["Bytes"];
                "application/octet-stream": components["schemas"]["Bytes"];
                "multipart/form-data": {
                    cohort?: string;
                    /** @enum {unknown} */
                    partial?: "true" | "false" | "on";
                    file?: string[];
                };
            };
        };
        responses: {
            200: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Import"];
                };
            };
            201: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Import"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listCohorts: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
                sort?: components["parameters"]["ListSort"];
                name?: components["parameters"]["ListName"];
                since?: components["parameters"]["ListSince"];
                until?: components["parameters"]["ListUntil"];
                mesh?: components["parameters"]["ListMesh"];
                owner?: components["parameters"]["Owner"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["CohortList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    createCohort: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["NewCohort"];
            };
        };
        responses: {
            200: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Cohort"];
                };
            };
            201: {
                headers: {
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Cohort"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getCohort: {
        parameters: {
            query?: {
                owner?: components["parameters"]["Owner"];
            };
            header?: never;
            path: {
                name: components["parameters"]["CohortName"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Cohort"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    deleteCohort: {
        parameters: {
            query?: {
                owner?: components["parameters"]["Owner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                name: components["parameters"]["CohortName"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    changeCohort: {
        parameters: {
            query?: {
                owner?: components["parameters"]["Owner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                name: components["parameters"]["CohortName"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["CohortPatch"];
            };
        };
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Cohort"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listCohortMembers: {
        parameters: {
            query?: {
                owner?: components["parameters"]["Owner"];
                limit?: components["parameters"]["MembersLimit"];
                cursor?: components["parameters"]["Cursor"];
                label?: components["parameters"]["MemberLabel"];
                subject?: components["parameters"]["MemberSubject"];
                side?: components["parameters"]["MemberSide"];
                format?: components["parameters"]["TableFormat"];
            };
            header?: never;
            path: {
                name: components["parameters"]["CohortName"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": {
                        items: components["schemas"]["CohortMember"][];
                        next: string | null;
                        total: number;
                    };
                    "text/csv": string;
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    replaceCohortMembers: {
        parameters: {
            query?: {
                owner?: components["parameters"]["Owner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                name: components["parameters"]["CohortName"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": {
                    members: components["schemas"]["CohortMember"][];
                };
                "text/csv": string;
                "text/tab-separated-values": string;
            };
        };
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    Location: components["headers"]["Location"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Cohort"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    exportCohort: {
        parameters: {
            query?: {
                owner?: components["parameters"]["Owner"];
            };
            header?: never;
            path: {
                name: components["parameters"]["CohortName"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/zip": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    exportModel: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/zip": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listModels: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
                sort?: components["parameters"]["MadeSort"];
                name?: components["parameters"]["ListName"];
                since?: components["parameters"]["ListSince"];
                until?: components["parameters"]["ListUntil"];
                tag?: components["parameters"]["ListTag"];
                process?: components["parameters"]["ListProcess"];
                cohort?: components["parameters"]["ListCohort"];
                mesh?: components["parameters"]["ListMesh"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["ModelList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getModel: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Model"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    deleteModel: {
        parameters: {
            query?: {
                cascade?: components["parameters"]["Cascade"];
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    "Srnfd-Deleted": components["headers"]["Deleted"];
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: components["responses"]["InUse"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    labelModel: {
        parameters: {
            query?: {
                owner?: components["parameters"]["ContentOwner"];
            };
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/merge-patch+json": components["schemas"]["Labels"];
                "application/json": components["schemas"]["Labels"];
            };
        };
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Model"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getModes: {
        parameters: {
            query?: {
                part?: components["parameters"]["ModelPart"];
                format?: components["parameters"]["TableFormat"];
            };
            header?: never;
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Modes"];
                    "text/csv": components["schemas"]["Text"];
                    "application/x-npy": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getScores: {
        parameters: {
            query?: {
                format?: components["parameters"]["TableFormat"];
            };
            header?: never;
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Scores"];
                    "text/csv": components["schemas"]["Text"];
                    "application/x-npy": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getModelShape: {
        parameters: {
            query: {
                coefficients: components["parameters"]["Coefficients"];
                part?: components["parameters"]["ModelPart"];
                format?: components["parameters"]["ShapeFormat"];
                resolution?: components["parameters"]["Resolution"];
            };
            header?: never;
            path: {
                id: components["parameters"]["ModelId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["ModelShape"];
                    "model/ply": components["schemas"]["Bytes"];
                    "model/obj": components["schemas"]["Bytes"];
                    "model/stl": components["schemas"]["Bytes"];
                    "application/x-vtk": components["schemas"]["Bytes"];
                    "application/x-vtp": components["schemas"]["Bytes"];
                    "application/x-gifti+xml": components["schemas"]["Bytes"];
                    "model/gltf-binary": components["schemas"]["Bytes"];
                    "application/octet-stream": components["schemas"]["Bytes"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listProcesses: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["ProcessList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getProcess: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["ProcessId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Process"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    execute: {
        parameters: {
            query?: never;
            header?: {
                Prefer?: components["parameters"]["Prefer"];
                "Idempotency-Key"?: components["parameters"]["IdempotencyKey"];
            };
            path: {
                id: components["parameters"]["ProcessId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["Execution"];
            };
        };
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    "Preference-Applied": components["headers"]["PreferenceApplied"];
                    "Cache-Status": components["headers"]["CacheStatus"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Results"] | components["schemas"]["FramedResults"];
                    "multipart/related": components["schemas"]["Text"];
                };
            };
            201: {
                headers: {
                    Location: components["headers"]["Location"];
                    Link: components["headers"]["Link"];
                    "Preference-Applied": components["headers"]["PreferenceApplied"];
                    "Cache-Status": components["headers"]["CacheStatus"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            204: components["responses"]["References"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            410: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    estimate: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["ProcessId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["Execution"];
            };
        };
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Estimate"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listJobs: {
        parameters: {
            query?: {
                limit?: components["parameters"]["Limit"];
                cursor?: components["parameters"]["Cursor"];
                sort?: components["parameters"]["JobSort"];
                name?: components["parameters"]["ListName"];
                since?: components["parameters"]["ListSince"];
                until?: components["parameters"]["ListUntil"];
                tag?: components["parameters"]["ListTag"];
                process?: components["parameters"]["ListProcess"];
                type?: components["parameters"]["JobType"];
                processID?: components["parameters"]["ProcessIDs"];
                status?: components["parameters"]["JobStatus"];
                datetime?: components["parameters"]["Datetime"];
                minDuration?: components["parameters"]["MinDuration"];
                maxDuration?: components["parameters"]["MaxDuration"];
                cohort?: components["parameters"]["ListCohort"];
                mesh?: components["parameters"]["ListMesh"];
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    Link: components["headers"]["Link"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["JobList"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getJob: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["JobId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    deleteJob: {
        parameters: {
            query?: never;
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["JobId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    labelJob: {
        parameters: {
            query?: never;
            header?: {
                "If-Match"?: components["parameters"]["IfMatch"];
                "If-None-Match"?: components["parameters"]["IfNoneMatch"];
            };
            path: {
                id: components["parameters"]["JobId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/merge-patch+json": components["schemas"]["Labels"];
                "application/json": components["schemas"]["Labels"];
            };
        };
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            412: components["responses"]["PreconditionFailed"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getResults: {
        parameters: {
            query?: {
                format?: components["parameters"]["TableFormat"];
                condensed?: components["parameters"]["Condensed"];
                response?: components["parameters"]["Response"];
                outputs?: components["parameters"]["OutputNames"];
            };
            header?: never;
            path: {
                id: components["parameters"]["JobId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Results"] | components["schemas"]["FramedResults"];
                    "multipart/related": components["schemas"]["Text"];
                    "text/csv": components["schemas"]["Text"];
                    "application/x-npy": components["schemas"]["Bytes"];
                };
            };
            204: components["responses"]["References"];
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    "Retry-After": components["headers"]["RetryAfter"];
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            410: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getOutput: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["JobId"];
                output: components["parameters"]["OutputName"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    ETag: components["headers"]["ETag"];
                    [name: string]: unknown;
                };
                content: {
                    "application/json": unknown;
                    "text/html": string;
                };
            };
            304: components["responses"]["NotModified"];
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    followJob: {
        parameters: {
            query?: {
                ticket?: components["parameters"]["Ticket"];
            };
            header?: {
                "Last-Event-ID"?: components["parameters"]["LastEventId"];
            };
            path: {
                id: components["parameters"]["JobId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "text/event-stream": components["schemas"]["Text"];
                };
            };
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            503: {
                headers: {
                    "Retry-After": components["headers"]["RetryAfter"];
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    cancelJob: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                id: components["parameters"]["JobId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Job"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    followJobs: {
        parameters: {
            query?: {
                after?: components["parameters"]["After"];
                ticket?: components["parameters"]["Ticket"];
            };
            header?: {
                "Last-Event-ID"?: components["parameters"]["LastEventId"];
            };
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "text/event-stream": components["schemas"]["Text"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            503: {
                headers: {
                    "Retry-After": components["headers"]["RetryAfter"];
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    createTicket: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            201: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Ticket"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    leaseTask: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["LeaseRequest"];
            };
        };
        responses: {
            201: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Lease"];
                };
            };
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    getTaskContent: {
        parameters: {
            query?: never;
            header: {
                "Lease-Secret": components["parameters"]["LeaseSecret"];
            };
            path: {
                task: components["parameters"]["TaskId"];
                digest: components["parameters"]["ContentDigest"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/octet-stream": components["schemas"]["Bytes"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    extendLease: {
        parameters: {
            query?: never;
            header: {
                "Lease-Secret": components["parameters"]["LeaseSecret"];
            };
            path: {
                task: components["parameters"]["TaskId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": {
                        expiresInSeconds: number;
                    };
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    returnResult: {
        parameters: {
            query?: never;
            header: {
                "Lease-Secret": components["parameters"]["LeaseSecret"];
                "Content-Digest": components["parameters"]["ResultDigest"];
                "Worker-Host": components["parameters"]["WorkerHost"];
                "Worker-CPU": components["parameters"]["WorkerCpu"];
                "Worker-Build": components["parameters"]["WorkerBuild"];
            };
            path: {
                task: components["parameters"]["TaskId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/octet-stream": components["schemas"]["Bytes"];
            };
        };
        responses: {
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    reportFailure: {
        parameters: {
            query?: never;
            header: {
                "Lease-Secret": components["parameters"]["LeaseSecret"];
            };
            path: {
                task: components["parameters"]["TaskId"];
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": {
                    detail: string;
                    certain?: boolean;
                };
            };
        };
        responses: {
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    giveBackTask: {
        parameters: {
            query?: never;
            header: {
                "Lease-Secret": components["parameters"]["LeaseSecret"];
            };
            path: {
                task: components["parameters"]["TaskId"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    listWorkers: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Workers"];
                };
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
    liftBar: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                bar: components["parameters"]["Bar"];
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            401: components["responses"]["Unauthorized"];
            403: components["responses"]["Forbidden"];
            429: components["responses"]["TooManyRequests"];
            "4XX": components["responses"]["Problem"];
            "5XX": components["responses"]["Problem"];
        };
    };
}
