-- What made a mesh: the record of the process and job for a mesh that a job put out, '' or NULL for
-- one that was uploaded. It is the first owner's; that of others is owned.record.
ALTER TABLE mesh ADD COLUMN source TEXT;
