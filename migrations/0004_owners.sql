-- Owners: whom meshes, surfaces, models, cohorts and jobs belong to. An owner is the name of a
-- token; '' is the one owner of a service without tokens, and so of all that was there before.

-- What an owner holds and whose turn it is. bytes is kept by the triggers below. turn orders the
-- queue (job_state.c); running_max is 0 where any number of an owner's jobs may run at once.
CREATE TABLE owner (
    name        TEXT PRIMARY KEY NOT NULL,
    bytes       INTEGER NOT NULL DEFAULT 0,
    turn        INTEGER NOT NULL DEFAULT 0,
    running_max INTEGER NOT NULL DEFAULT 0 CHECK (running_max >= 0)
) STRICT;
CREATE INDEX owner_by_turn ON owner (turn, name);
INSERT INTO owner (name) VALUES ('');

-- Content is stored once, but belongs to everyone who sent or computed it. Name, record and time
-- are those that this owner gave it; NULL where they are those of the content's own row.
CREATE TABLE owned (
    owner      TEXT NOT NULL REFERENCES owner (name),
    id         TEXT NOT NULL,
    kind       TEXT NOT NULL CHECK (kind IN ('mesh', 'surface', 'model')),
    name       TEXT,
    record     TEXT,
    bytes      INTEGER NOT NULL CHECK (bytes >= 0),
    created_ms INTEGER NOT NULL,
    PRIMARY KEY (owner, id)
) STRICT, WITHOUT ROWID;
CREATE INDEX owned_by_time ON owned (owner, kind, created_ms, id);
CREATE INDEX owned_by_id ON owned (id);

CREATE TRIGGER owned_added AFTER INSERT ON owned BEGIN
    UPDATE owner SET bytes = bytes + NEW.bytes WHERE name = NEW.owner;
END;
CREATE TRIGGER owned_removed AFTER DELETE ON owned BEGIN
    UPDATE owner SET bytes = bytes - OLD.bytes WHERE name = OLD.owner;
END;
CREATE TRIGGER mesh_removed AFTER DELETE ON mesh BEGIN
    DELETE FROM owned WHERE id = OLD.id;
END;
CREATE TRIGGER surface_removed AFTER DELETE ON surface BEGIN
    DELETE FROM owned WHERE id = OLD.id;
END;
CREATE TRIGGER model_removed AFTER DELETE ON model BEGIN
    DELETE FROM owned WHERE id = OLD.id;
END;

INSERT INTO owned (owner, id, kind, bytes, created_ms)
SELECT '', id, 'mesh', bytes, created_ms FROM mesh;
INSERT INTO owned (owner, id, kind, bytes, created_ms)
SELECT '', surface.id, 'surface',
       blob.size + (SELECT coalesce(sum(size), 0) FROM surface_maps
                    JOIN blob ON blob.hash = content WHERE surface = surface.id), created_ms
FROM surface JOIN blob ON blob.hash = coefficients;
INSERT INTO owned (owner, id, kind, bytes, created_ms)
SELECT '', id, 'model', (SELECT coalesce(sum(size), 0) FROM model_array
                         JOIN blob ON blob.hash = content WHERE model = model.id), created_ms
FROM model;

-- A job has one owner, and its digest is that owner's: nobody is answered from another's cache.
ALTER TABLE job ADD COLUMN owner TEXT NOT NULL DEFAULT '';
CREATE INDEX job_by_owner ON job (owner, created_ms, id);
CREATE INDEX job_waiting ON job (owner, created_ms, id) WHERE status = 'accepted';
CREATE INDEX job_running ON job (owner) WHERE status = 'running';
UPDATE owner SET bytes = bytes + (SELECT coalesce(sum(size), 0) FROM job
                                  JOIN blob ON blob.hash = job.results);
CREATE TRIGGER job_results_added AFTER UPDATE OF results ON job
WHEN OLD.results IS NULL AND NEW.results IS NOT NULL BEGIN
    UPDATE owner SET bytes = bytes + (SELECT size FROM blob WHERE hash = NEW.results)
    WHERE name = NEW.owner;
END;
CREATE TRIGGER job_results_removed BEFORE DELETE ON job WHEN OLD.results IS NOT NULL BEGIN
    UPDATE owner SET bytes = bytes - (SELECT size FROM blob WHERE hash = OLD.results)
    WHERE name = OLD.owner;
END;

-- A cohort's name is its owner's: two owners may give the same one.
CREATE TABLE owned_cohort (
    owner      TEXT NOT NULL REFERENCES owner (name),
    name       TEXT NOT NULL,
    record     TEXT NOT NULL,
    digest     TEXT NOT NULL CHECK (length(digest) = 64),
    members    INTEGER NOT NULL CHECK (members > 0),
    created_ms INTEGER NOT NULL,
    PRIMARY KEY (owner, name)
) STRICT;
CREATE TABLE owned_cohort_member (
    owner    TEXT NOT NULL,
    cohort   TEXT NOT NULL,
    position INTEGER NOT NULL CHECK (position >= 0),
    mesh     TEXT REFERENCES mesh (id),
    surface  TEXT REFERENCES surface (id),
    PRIMARY KEY (owner, cohort, position),
    FOREIGN KEY (owner, cohort) REFERENCES owned_cohort (owner, name) ON DELETE CASCADE,
    CHECK ((mesh IS NULL) <> (surface IS NULL))
) STRICT;
INSERT INTO owned_cohort (owner, name, record, digest, members, created_ms)
SELECT '', name, record, digest, members, created_ms FROM cohort;
INSERT INTO owned_cohort_member (owner, cohort, position, mesh, surface)
SELECT '', cohort, position, mesh, surface FROM cohort_member;
DROP TABLE cohort_member;
DROP TABLE cohort;
ALTER TABLE owned_cohort RENAME TO cohort;
ALTER TABLE owned_cohort_member RENAME TO cohort_member;
CREATE INDEX cohort_by_time ON cohort (created_ms, name);
CREATE INDEX cohort_by_owner ON cohort (owner, created_ms, name);
CREATE INDEX cohort_by_name ON cohort (name, created_ms);
CREATE INDEX cohort_member_by_mesh ON cohort_member (mesh) WHERE mesh IS NOT NULL;
CREATE INDEX cohort_member_by_surface ON cohort_member (surface) WHERE surface IS NOT NULL;

-- When each token was last used, by its id; the tokens themselves are in a file (token.c).
CREATE TABLE token_use (
    token   TEXT PRIMARY KEY NOT NULL,
    last_ms INTEGER NOT NULL
) STRICT;
