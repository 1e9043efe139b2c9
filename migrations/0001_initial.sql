-- The first schema. Each migration runs once, in one transaction, in the order of its number; the
-- number of the last one is the database's user_version.
--
-- Times are milliseconds since the epoch; 0 means "not yet". JSON texts are opaque to the database.

-- Content of any kind by its SHA-256. bytes is NULL where the content is a file under blobs/.
CREATE TABLE blob (
    hash  TEXT PRIMARY KEY NOT NULL CHECK (length(hash) = 64),
    size  INTEGER NOT NULL CHECK (size >= 0),
    bytes BLOB CHECK (bytes IS NULL OR length(bytes) = size)
) STRICT;

CREATE TABLE mesh (
    id         TEXT PRIMARY KEY NOT NULL,
    name       TEXT NOT NULL,
    format     TEXT NOT NULL,
    report     TEXT NOT NULL,
    bytes      INTEGER NOT NULL,
    vertices   INTEGER NOT NULL,
    faces      INTEGER NOT NULL,
    created_ms INTEGER NOT NULL,
    content    TEXT NOT NULL REFERENCES blob (hash)
) STRICT;
CREATE INDEX mesh_by_time ON mesh (created_ms, id);
CREATE INDEX mesh_by_content ON mesh (content);

CREATE TABLE surface (
    id           TEXT PRIMARY KEY NOT NULL,
    name         TEXT NOT NULL,
    record       TEXT NOT NULL,
    lmax         INTEGER NOT NULL CHECK (lmax >= 0),
    created_ms   INTEGER NOT NULL,
    coefficients TEXT NOT NULL REFERENCES blob (hash)
) STRICT;
CREATE INDEX surface_by_time ON surface (created_ms, id);
CREATE INDEX surface_by_coefficients ON surface (coefficients);

CREATE TABLE job (
    id               TEXT PRIMARY KEY NOT NULL,
    process          TEXT NOT NULL,
    status           TEXT NOT NULL
                     CHECK (status IN ('accepted', 'running', 'successful', 'failed', 'dismissed')),
    inputs           TEXT NOT NULL,
    digest           TEXT NOT NULL CHECK (length(digest) = 64),
    numeric_build    TEXT NOT NULL,
    message          TEXT NOT NULL,
    progress         REAL NOT NULL,
    created_ms       INTEGER NOT NULL,
    started_ms       INTEGER NOT NULL DEFAULT 0,
    finished_ms      INTEGER NOT NULL DEFAULT 0,
    updated_ms       INTEGER NOT NULL,
    attempt          INTEGER NOT NULL DEFAULT 0 CHECK (attempt >= 0),
    cancel_requested INTEGER NOT NULL DEFAULT 0 CHECK (cancel_requested IN (0, 1)),
    problem_code     TEXT,
    problem_detail   TEXT,
    results          TEXT REFERENCES blob (hash),
    CHECK ((status = 'successful') = (results IS NOT NULL)),
    CHECK ((status = 'failed') = (problem_code IS NOT NULL))
) STRICT;
CREATE INDEX job_by_time ON job (created_ms, id);
CREATE INDEX job_by_status ON job (status, created_ms, id);
CREATE INDEX job_by_digest ON job (digest, created_ms, id);
CREATE INDEX job_by_results ON job (results) WHERE results IS NOT NULL;
-- The same work is never queued or done twice, however many ask for it at once. A job that is being
-- cancelled does not stand in the way of a new one.
CREATE UNIQUE INDEX job_once ON job (digest)
    WHERE status IN ('accepted', 'running', 'successful') AND cancel_requested = 0;

CREATE TABLE idempotency (
    key         TEXT PRIMARY KEY NOT NULL,
    job         TEXT NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    body_digest TEXT NOT NULL,
    created_ms  INTEGER NOT NULL
) STRICT;
CREATE INDEX idempotency_by_time ON idempotency (created_ms);
CREATE INDEX idempotency_by_job ON idempotency (job);
