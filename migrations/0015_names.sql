-- Names and tags, which are each owner's and can be changed. tags is a JSON array of strings, as the
-- record shows it; the table tag has the same, for lists.
UPDATE owned SET name = coalesce(name, (SELECT name FROM mesh WHERE mesh.id = owned.id),
                                 (SELECT name FROM surface WHERE surface.id = owned.id),
                                 (SELECT name FROM volume WHERE volume.id = owned.id), '');
ALTER TABLE owned ADD COLUMN tags TEXT NOT NULL DEFAULT '[]';
-- The name of a job, by another word than that of owners, which statements on jobs join.
ALTER TABLE job ADD COLUMN title TEXT NOT NULL DEFAULT '';
ALTER TABLE job ADD COLUMN tags TEXT NOT NULL DEFAULT '[]';

CREATE TABLE tag (
    owner TEXT NOT NULL,
    tag   TEXT NOT NULL,
    id    TEXT NOT NULL,
    PRIMARY KEY (owner, tag, id)
) STRICT, WITHOUT ROWID;
CREATE INDEX tag_by_id ON tag (id, owner);

-- In what their owner holds tags count as their text, and 256 for the rows of each. The bytes of what
-- is owned have its name already.
CREATE TRIGGER tag_added AFTER INSERT ON tag BEGIN
    UPDATE owner SET bytes = bytes + 256 WHERE name = NEW.owner;
END;
CREATE TRIGGER tag_removed AFTER DELETE ON tag BEGIN
    UPDATE owner SET bytes = bytes - 256 WHERE name = OLD.owner;
END;
CREATE TRIGGER owned_changed AFTER UPDATE OF bytes ON owned BEGIN
    UPDATE owner SET bytes = bytes + NEW.bytes - OLD.bytes WHERE name = NEW.owner;
END;
CREATE TRIGGER job_named AFTER UPDATE OF title, tags ON job BEGIN
    UPDATE owner SET bytes = bytes
        + length(CAST(NEW.title AS BLOB)) - length(CAST(OLD.title AS BLOB))
        + length(CAST(NEW.tags AS BLOB)) - length(CAST(OLD.tags AS BLOB))
    WHERE name = NEW.owner;
END;
CREATE TRIGGER job_name_removed AFTER DELETE ON job BEGIN
    UPDATE owner SET bytes = bytes - length(CAST(OLD.title AS BLOB))
                                 - (length(CAST(OLD.tags AS BLOB)) - 2)
    WHERE name = OLD.owner;
    DELETE FROM tag WHERE id = OLD.id;
END;
CREATE TRIGGER owned_tags_removed AFTER DELETE ON owned BEGIN
    DELETE FROM tag WHERE id = OLD.id AND owner = OLD.owner;
END;
