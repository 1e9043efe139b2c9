-- What needs what, so that nothing goes from under what was made of it.

-- The first of those who have content describes it in the content's own row; when that one leaves,
-- the next does (store/erase.c).
ALTER TABLE owned ADD COLUMN first INTEGER NOT NULL DEFAULT 0 CHECK (first IN (0, 1));
UPDATE owned SET first = 1 WHERE name IS NULL AND record IS NULL;

-- needing, which is the owner's, was given or made of id: a job of its inputs, a surface of a mesh or
-- of the job that made it. So a job stands here, too, after its own row has gone, as long as
-- something needs it. along: a job whose results only name id; it does not keep id, but goes with it.
CREATE TABLE need (
    owner   TEXT NOT NULL,
    needing TEXT NOT NULL,
    id      TEXT NOT NULL,
    along   INTEGER NOT NULL CHECK (along IN (0, 1)),
    PRIMARY KEY (owner, needing, id)
) STRICT, WITHOUT ROWID;
CREATE INDEX need_by_id ON need (id, along, owner, needing);
CREATE INDEX need_by_needing ON need (needing);

-- 256 for each in what its owner holds.
CREATE TRIGGER need_added AFTER INSERT ON need BEGIN
    UPDATE owner SET bytes = bytes + 256 WHERE name = NEW.owner;
END;
CREATE TRIGGER need_removed AFTER DELETE ON need BEGIN
    UPDATE owner SET bytes = bytes - 256 WHERE name = OLD.owner;
END;
-- With the last that needs a job goes what the job needed, where its row has gone before.
CREATE TRIGGER need_job_removed AFTER DELETE ON need
WHEN OLD.id GLOB 'job-*' AND NOT EXISTS (SELECT 1 FROM need WHERE id = OLD.id)
     AND NOT EXISTS (SELECT 1 FROM job WHERE id = OLD.id) BEGIN
    DELETE FROM need WHERE needing = OLD.id;
END;
CREATE TRIGGER job_needs_removed AFTER DELETE ON job BEGIN
    DELETE FROM need WHERE needing = OLD.id
    AND (along = 1 OR NOT EXISTS (SELECT 1 FROM need AS other WHERE other.id = OLD.id));
END;
CREATE TRIGGER owned_needs_removed AFTER DELETE ON owned BEGIN
    DELETE FROM need WHERE owner = OLD.owner AND needing = OLD.id;
END;

-- What there is already says so in its texts.
INSERT OR IGNORE INTO need (owner, needing, id, along)
SELECT job.owner, job.id, atom, 0 FROM job, json_tree(iif(json_valid(inputs), inputs, '{}')) AS t
WHERE t.type = 'text' AND EXISTS (SELECT 1 FROM owned WHERE id = atom);
CREATE TABLE told (owner TEXT, id TEXT, record TEXT);
INSERT INTO told SELECT owned.owner, owned.id,
                        coalesce(owned.record, surface.record, model.record, mesh.source)
FROM owned LEFT JOIN surface ON surface.id = owned.id LEFT JOIN model ON model.id = owned.id
LEFT JOIN mesh ON mesh.id = owned.id;
UPDATE told SET record = '{}' WHERE record IS NULL OR NOT json_valid(record);
INSERT OR IGNORE INTO need (owner, needing, id, along)
SELECT told.owner, told.id, atom, 0 FROM told, json_tree(record) AS t
WHERE t.type = 'text' AND atom <> told.id AND EXISTS (SELECT 1 FROM owned WHERE id = atom);
INSERT OR IGNORE INTO need (owner, needing, id, along)
SELECT owned.owner, owned.id, mean, 0 FROM owned JOIN model ON model.id = owned.id;
-- The job, where it may have had other inputs than the mesh that an encode names.
INSERT OR IGNORE INTO need (owner, needing, id, along)
SELECT told.owner, told.id, job.id, 0 FROM told, json_tree(record) AS t JOIN job ON job.id = atom
WHERE t.type = 'text' AND coalesce(json_extract(record, '$.source.process'), '') <> 'encode';
-- The results of jobs, where they are in the database, and otherwise what says which job made it.
INSERT OR IGNORE INTO need (owner, needing, id, along)
SELECT job.owner, job.id, atom, 1 FROM job JOIN blob ON hash = results,
json_tree(iif(json_valid(CAST(blob.bytes AS TEXT)), CAST(blob.bytes AS TEXT), '{}')) AS t
WHERE t.type = 'text' AND EXISTS (SELECT 1 FROM owned WHERE id = atom);
INSERT OR IGNORE INTO need (owner, needing, id, along)
SELECT told.owner, job.id, told.id, 1 FROM told, json_tree(record) AS t
JOIN job ON job.id = atom AND job.owner = told.owner WHERE t.type = 'text';
DROP TABLE told;
