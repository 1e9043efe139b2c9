-- Label volumes. record is what was read of the content: format, shape, affine, labels.
CREATE TABLE volume (
    id         TEXT PRIMARY KEY NOT NULL,
    name       TEXT NOT NULL,
    record     TEXT NOT NULL,
    bytes      INTEGER NOT NULL,
    created_ms INTEGER NOT NULL,
    content    TEXT NOT NULL REFERENCES blob (hash)
) STRICT;
CREATE INDEX volume_by_time ON volume (created_ms, id);
CREATE INDEX volume_by_content ON volume (content);

-- owned takes volumes too. A check cannot be changed: the table is made anew. Its triggers go with
-- it, and those that name it must not be there while it has another name.
DROP TRIGGER mesh_removed;
DROP TRIGGER surface_removed;
DROP TRIGGER model_removed;
CREATE TABLE owned_new (
    owner      TEXT NOT NULL REFERENCES owner (name),
    id         TEXT NOT NULL,
    kind       TEXT NOT NULL CHECK (kind IN ('mesh', 'surface', 'model', 'volume')),
    name       TEXT,
    record     TEXT,
    bytes      INTEGER NOT NULL CHECK (bytes >= 0),
    created_ms INTEGER NOT NULL,
    first      INTEGER NOT NULL DEFAULT 0 CHECK (first IN (0, 1)),
    PRIMARY KEY (owner, id)
) STRICT, WITHOUT ROWID;
INSERT INTO owned_new SELECT owner, id, kind, name, record, bytes, created_ms, first FROM owned;
DROP TABLE owned;
ALTER TABLE owned_new RENAME TO owned;
CREATE INDEX owned_by_time ON owned (owner, kind, created_ms, id);
CREATE INDEX owned_by_id ON owned (id);
CREATE TRIGGER owned_added AFTER INSERT ON owned BEGIN
    UPDATE owner SET bytes = bytes + NEW.bytes WHERE name = NEW.owner;
END;
CREATE TRIGGER owned_removed AFTER DELETE ON owned BEGIN
    UPDATE owner SET bytes = bytes - OLD.bytes WHERE name = OLD.owner;
END;
CREATE TRIGGER owned_needs_removed AFTER DELETE ON owned BEGIN
    DELETE FROM need WHERE owner = OLD.owner AND needing = OLD.id;
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
CREATE TRIGGER volume_removed AFTER DELETE ON volume BEGIN
    DELETE FROM owned WHERE id = OLD.id;
END;
