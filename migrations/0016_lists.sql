-- What lists are filtered by, beside what the rows have already: the process that made a thing, and the
-- cohort that it was made of.
ALTER TABLE owned ADD COLUMN process TEXT NOT NULL DEFAULT '';
ALTER TABLE owned ADD COLUMN cohort TEXT NOT NULL DEFAULT '';
ALTER TABLE job ADD COLUMN cohort TEXT NOT NULL DEFAULT '';

CREATE TABLE told (owner TEXT, id TEXT, record TEXT, PRIMARY KEY (owner, id));
INSERT INTO told SELECT owned.owner, owned.id,
                        coalesce(owned.record, surface.record, model.record, mesh.source)
FROM owned LEFT JOIN surface ON surface.id = owned.id LEFT JOIN model ON model.id = owned.id
LEFT JOIN mesh ON mesh.id = owned.id;
DELETE FROM told WHERE record IS NULL OR NOT json_valid(record);
UPDATE owned SET process = coalesce(json_extract(told.record, '$.source.process'),
                                    json_extract(told.record, '$.madeFrom.process'),
                                    json_extract(told.record, '$.process'), ''),
                 cohort = coalesce(json_extract(told.record, '$.madeFrom.cohort'), '')
FROM told WHERE told.owner = owned.owner AND told.id = owned.id;
DROP TABLE told;
UPDATE job SET cohort = coalesce(json_extract(inputs, '$.cohort.name'), '')
WHERE instr(inputs, '"cohort"') > 0 AND json_valid(inputs);

-- Each list, of one owner and of all, in order of time, with all that is filtered and sorted by: a page
-- and its total are read from the index alone. Those of before are their beginnings.
DROP INDEX owned_by_time;
CREATE INDEX owned_by_time ON owned (owner, kind, created_ms, id, name, process, cohort);
CREATE INDEX owned_first ON owned (kind, created_ms, id, name, process, cohort, first)
WHERE first = 1;
DROP INDEX job_by_owner;
CREATE INDEX job_by_owner ON job (owner, created_ms, id, process, status, title, cohort);
DROP INDEX job_by_time;
CREATE INDEX job_by_time ON job (created_ms, id, process, status, title, cohort);
DROP INDEX cohort_by_time;
CREATE INDEX cohort_by_time ON cohort (created_ms, name, owner);
-- Content is listed by its rows of owned alone.
DROP INDEX mesh_by_time;
DROP INDEX surface_by_time;
DROP INDEX model_by_time;
DROP INDEX volume_by_time;
