-- Cohorts, models, and the checkpoints of jobs that run.

-- A cohort is named by its user. record is its JSON text, digest that text's SHA-256.
CREATE TABLE cohort (
    name       TEXT PRIMARY KEY NOT NULL,
    record     TEXT NOT NULL,
    digest     TEXT NOT NULL CHECK (length(digest) = 64),
    members    INTEGER NOT NULL CHECK (members > 0),
    created_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX cohort_by_time ON cohort (created_ms, name);

-- What a cohort names, in its order: each member holds its mesh or surface in place.
CREATE TABLE cohort_member (
    cohort   TEXT NOT NULL REFERENCES cohort (name) ON DELETE CASCADE,
    position INTEGER NOT NULL CHECK (position >= 0),
    mesh     TEXT REFERENCES mesh (id),
    surface  TEXT REFERENCES surface (id),
    PRIMARY KEY (cohort, position),
    CHECK ((mesh IS NULL) <> (surface IS NULL))
) STRICT;
CREATE INDEX cohort_member_by_mesh ON cohort_member (mesh) WHERE mesh IS NOT NULL;
CREATE INDEX cohort_member_by_surface ON cohort_member (surface) WHERE surface IS NOT NULL;

-- Principal components about a mean surface, which stays as long as its model.
CREATE TABLE model (
    id         TEXT PRIMARY KEY NOT NULL,
    record     TEXT NOT NULL,
    mean       TEXT NOT NULL REFERENCES surface (id),
    lmax       INTEGER NOT NULL CHECK (lmax >= 0),
    n_theta    INTEGER NOT NULL CHECK (n_theta > 0),
    n_phi      INTEGER NOT NULL CHECK (n_phi > 0),
    subjects   INTEGER NOT NULL CHECK (subjects > 0),
    components INTEGER NOT NULL CHECK (components > 0),
    created_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX model_by_time ON model (created_ms, id);
CREATE INDEX model_by_mean ON model (mean);

CREATE TABLE model_array (
    model   TEXT NOT NULL REFERENCES model (id) ON DELETE CASCADE,
    name    TEXT NOT NULL CHECK (name IN ('mean_q', 'modes', 'eigenvalues', 'scores')),
    content TEXT NOT NULL REFERENCES blob (hash),
    PRIMARY KEY (model, name)
) STRICT;
CREATE INDEX model_array_by_content ON model_array (content);

-- Where an unfinished job can go on from. The row goes when the job ends.
CREATE TABLE checkpoint (
    job     TEXT PRIMARY KEY NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    content TEXT NOT NULL REFERENCES blob (hash)
) STRICT;
CREATE INDEX checkpoint_by_content ON checkpoint (content);
