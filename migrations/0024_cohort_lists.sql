-- The members of a cohort are a list with a number of its own: a cohort is changed or renamed without
-- its members, and a list is filled before and emptied after its cohort is there, in several
-- transactions. The text comes last: what stands before it is read without it.
CREATE TABLE listed_cohort (
    list       INTEGER PRIMARY KEY NOT NULL,
    owner      TEXT NOT NULL REFERENCES owner (name),
    name       TEXT NOT NULL,
    digest     TEXT NOT NULL CHECK (length(digest) = 64),
    members    INTEGER NOT NULL CHECK (members > 0),
    created_ms INTEGER NOT NULL,
    record     TEXT NOT NULL,
    UNIQUE (owner, name)
) STRICT;
CREATE TABLE listed_member (
    list     INTEGER NOT NULL,
    position INTEGER NOT NULL CHECK (position >= 0),
    mesh     TEXT REFERENCES mesh (id),
    surface  TEXT REFERENCES surface (id),
    PRIMARY KEY (list, position),
    CHECK ((mesh IS NULL) <> (surface IS NULL))
) STRICT, WITHOUT ROWID;

-- Lists without a cohort: one that is being filled, until its cohort comes; and one whose cohort has
-- gone, until its members have.
CREATE TABLE loose_list (
    list    INTEGER PRIMARY KEY NOT NULL,
    filling INTEGER NOT NULL CHECK (filling IN (0, 1))
) STRICT;

INSERT INTO listed_cohort (list, owner, name, digest, members, created_ms, record)
SELECT rowid, owner, name, digest, members, created_ms, record FROM cohort;
INSERT INTO listed_member (list, position, mesh, surface)
SELECT list, position, mesh, surface FROM cohort_member AS member JOIN listed_cohort
ON listed_cohort.owner = member.owner AND listed_cohort.name = member.cohort;
DROP TABLE cohort_member;
DROP TABLE cohort;
ALTER TABLE listed_cohort RENAME TO cohort;
ALTER TABLE listed_member RENAME TO cohort_member;
CREATE INDEX cohort_by_time ON cohort (created_ms, name, owner);
CREATE INDEX cohort_by_owner ON cohort (owner, created_ms, name);
CREATE INDEX cohort_by_name ON cohort (name, created_ms);
CREATE INDEX cohort_member_by_mesh ON cohort_member (mesh) WHERE mesh IS NOT NULL;
CREATE INDEX cohort_member_by_surface ON cohort_member (surface) WHERE surface IS NOT NULL;

-- As migration 8 counts them.
CREATE TRIGGER cohort_added AFTER INSERT ON cohort BEGIN
    UPDATE owner SET bytes = bytes + 1024 + 512 * NEW.members + length(CAST(NEW.record AS BLOB))
    WHERE name = NEW.owner;
END;
CREATE TRIGGER cohort_changed AFTER UPDATE ON cohort BEGIN
    UPDATE owner SET bytes = bytes + 512 * (NEW.members - OLD.members)
                     + length(CAST(NEW.record AS BLOB)) - length(CAST(OLD.record AS BLOB))
    WHERE name = NEW.owner;
END;
CREATE TRIGGER cohort_removed AFTER DELETE ON cohort BEGIN
    UPDATE owner SET bytes = bytes - 1024 - 512 * OLD.members - length(CAST(OLD.record AS BLOB))
    WHERE name = OLD.owner;
END;

CREATE TRIGGER cohort_list_changed AFTER UPDATE OF list ON cohort WHEN OLD.list <> NEW.list BEGIN
    INSERT INTO loose_list (list, filling) VALUES (OLD.list, 0);
END;
CREATE TRIGGER cohort_list_removed AFTER DELETE ON cohort BEGIN
    INSERT INTO loose_list (list, filling) VALUES (OLD.list, 0);
END;
