-- Encodings of meshes that jobs have made: kept for the jobs after them, and made again where they
-- are not there. name is a digest of the owner, the numeric build and all options; checksum is that
-- of value. Nobody's quota counts them: the oldest give way beyond a limit of their own.
CREATE TABLE encoding (
    name       TEXT PRIMARY KEY NOT NULL CHECK (length(name) = 64),
    mesh       TEXT NOT NULL REFERENCES mesh (id) ON DELETE CASCADE,
    checksum   TEXT NOT NULL CHECK (length(checksum) = 64),
    value      BLOB NOT NULL,
    created_ms INTEGER NOT NULL
) STRICT;
CREATE INDEX encoding_by_mesh ON encoding (mesh);
CREATE INDEX encoding_by_time ON encoding (created_ms, name, length(value));
